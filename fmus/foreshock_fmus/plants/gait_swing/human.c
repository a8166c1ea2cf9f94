/* The human beside the lane: steps in, and steps back when a signal has been heard and minded. */
#include <math.h>

#include "model.h"

/* When an undisturbed swing foot reaches the human. */
double meet_time(const double *vars) { return (vars[V_human_x] - 0.25) / gait_speed(vars); }

void human_start(Plant *self, const double *vars) {
    self->human_y = self->human_target = vars[V_human_y0];
    /* Drawn whatever happens later: paired runs share them. */
    self->reaction = vars[V_reaction_time] * exp(0.25 * stream_normal(&self->process));
    self->hearing = (double)(stream_next(&self->process) >> 11) * 0x1p-53;
    self->announced_at = -1.0;
}

void human_tick(Plant *self, const double *vars, double t, double tick_s, double draw) {
    const double time = 0.6, w = vars[V_human_bandwidth];
    self->sway += -self->sway / time * tick_s + vars[V_human_sway] * sqrt(2.0 * tick_s / time) * draw;
    if (vars[V_announce] > 0.5 && self->announced_at < 0.0) self->announced_at = t;
    const int minds = self->announced_at >= 0.0 && t >= self->announced_at + self->reaction && self->hearing < vars[V_hears];
    const int in = t >= meet_time(vars) - vars[V_step_in_before];
    self->human_target = vars[V_human_y0] - (minds ? -vars[V_step_back] : in ? vars[V_step_in] : 0.0);
    /* A step that begins and ends at rest: critically damped, exact over a tick. */
    const double x = self->human_y - self->human_target, v = self->human_v, e = exp(-w * tick_s), b = v + w * x;
    self->human_y = self->human_target + (x + b * tick_s) * e;
    self->human_v = (v - w * b * tick_s) * e;
}
