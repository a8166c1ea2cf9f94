/* The startle reflex: what the human sees and hears coming, the threshold, and the jerk back. */
#include <math.h>

#include "model.h"

#define PI 3.14159265358979323846
#define FOVEA 0.5       /* rad: within it motion is seen fully */
#define SEEN_BY 1.9     /* rad: half the horizontal field of view, 108 deg */
#define REFRACTORY 2.0  /* s: no second startle within */
#define JUDGED 0.08     /* s: stimulus after the threshold still adds to the strength */

/* Share of peripheral motion that is seen: 1 in the middle, 0.6 at 75 deg, 0 outside the field of view. */
static double seen(double angle) {
    double e = fabs(angle);
    if (e <= FOVEA) return 1.0;
    if (e <= 1.3) return 1.0 - 0.4 * (e - FOVEA) / (1.3 - FOVEA);
    return e < SEEN_BY ? 0.6 * (SEEN_BY - e) / (SEEN_BY - 1.3) : 0.0;
}

double reflex_step(Plant *self, const double *vars, double t) {
    const double h = vars[V_dt], w = vars[V_robot_width];
    double gap = vars[V_distance] + self->u - self->x;
    if (gap < 0.1) gap = 0.1;
    double closing = self->v - self->vu;
    double looming = closing > 0.0 ? w * closing / (gap * gap + 0.25 * w * w) : 0.0; /* rate of the angle that it fills */
    double sound = vars[V_acoustic_gain] * fabs(self->acceleration) / gap;
    double input = seen(self->yaw + self->wander) * looming + sound;
    if (self->vu > 0.1) input = 0.0; /* moving himself, he does not startle again at what he moves against */
    self->stimulus += (input - self->stimulus) * h / vars[V_stimulus_lag];
    self->threshold = vars[V_startle_threshold] * exp(vars[V_threshold_sd] * self->threshold_noise) *
                      (1.0 + vars[V_attention_gain] * self->attention);
    if (self->stimulus > self->threshold && t - self->fired_at > REFRACTORY) {
        self->fired_at = t;
        self->peak = self->strength = 0.0;
    }
    const double since = t - self->fired_at, latency = vars[V_reflex_latency], span = vars[V_reflex_time];
    if (since <= JUDGED && since >= 0.0) {
        double excess = self->stimulus / self->threshold - 1.0;
        if (excess > self->peak) self->peak = excess;
        double s = vars[V_reflex_least] + (1.0 - vars[V_reflex_least]) * self->peak;
        self->strength = s > 1.0 ? 1.0 : s;
        if (self->strength > self->startle_max) self->startle_max = self->strength;
    }
    if (since < latency || since > latency + span) return 0.0;
    return self->strength * vars[V_reflex_speed] * 0.5 * PI / span * sin(PI * (since - latency) / span);
}
