/* The detector network: a noisy softmax over limb, tool and background, whose separation shrinks with the visibility. */
#include <string.h>

#include "model.h"

void network_frame(Plant *self, const double *vars, double t) {
    const double keep = exp(-FRAME / vars[V_noise_time]), kick = sqrt(1.0 - keep * keep);
    const double v = self->image.visibility, blunt = vars[V_place_noise] / sqrt(fmax(v, 0.05));
    const double rough = vars[V_statistics_noise];
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    Picture *p = &self->ring[self->ring_at];
    p->time = t;
    p->luminance = clip(self->image.luminance * (1.0 + rough * stream_normal(&self->sensor)), 0.0, 1.0);
    p->contrast = clip(self->image.contrast * (1.0 + rough * stream_normal(&self->sensor)), 0.0, 1.0);
    p->sharpness = clip(self->image.sharpness * (1.0 + 2.0 * rough * stream_normal(&self->sensor)), 0.0, 1.0);
    p->saturated = self->image.saturated;
    for (int i = 0; i < THINGS; i++) {
        /* logits of its own class, of the other, of the background; the sleeve gives some tool evidence of its own */
        double z[3] = {vars[V_evidence] * v, i == FOREARM ? vars[V_likeness] : 0.0, vars[V_background]};
        for (int c = 0; c < 3; c++) {
            self->noise[i][c] = keep * self->noise[i][c] + kick * vars[V_evidence_noise] * stream_normal(&self->process);
            z[c] += self->noise[i][c] + vars[V_flicker] * stream_normal(&self->process);
        }
        const double own = exp(z[0]), other = exp(z[1]), all = own + other + exp(z[2]);
        const double tool = i == TOOL ? own : other, limb = i == TOOL ? other : own;
        Found *f = &p->found[i];
        f->as_tool = tool > limb;
        f->confidence = fmax(tool, limb) / all;
        f->share = tool / (tool + limb);
        f->seen = f->confidence >= vars[V_detect_least];
        const double at[3] = {i == TOOL ? vars[V_tool_x] : forearm_x(self, vars),
                              i == TOOL ? vars[V_tool_y] : forearm_y(self, vars),
                              i == TOOL ? 0.02 : 0.5 * vars[V_forearm_height]};
        for (int k = 0; k < 3; k++) f->centre[k] = at[k] + blunt * stream_normal(&self->sensor);
    }
}

const Picture *network_newest(const Plant *self, const double *vars) {
    const int late = (int)(vars[V_latency] / FRAME + 0.5);
    return &self->ring[(self->ring_at + RING_SIZE - late) % RING_SIZE];
}
