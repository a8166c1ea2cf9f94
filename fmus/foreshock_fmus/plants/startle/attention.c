/* Where the human looks: a semi-Markov process of looks and glances, and the attention that follows. */
#include <math.h>

#include "model.h"

/* Once per tick, four draws always: the head's wandering, the dwell if one begins now, the mood that moves his threshold, his sway. */
void gaze_tick(Plant *self, const double *vars, double t) {
    double wander = stream_normal(&self->process), dwell = stream_normal(&self->process);
    double mood = stream_normal(&self->process), sway = stream_normal(&self->process);
    self->wander += -self->wander * TICK / 0.5 + 0.05 * sqrt(2.0 * TICK / 0.5) * wander;
    self->threshold_noise += -self->threshold_noise * TICK / 2.0 + sqrt(2.0 * TICK / 2.0) * mood;
    self->sway += -self->sway * TICK / 0.4 + vars[V_sway] * sqrt(2.0 * TICK / 0.4) * sway;
    int works = vars[V_own_work] > 0.5 && t >= vars[V_stop_time] + vars[V_turn_delay];
    if (works && !self->works) { /* he turns to his own work: a new dwell, away */
        self->works = 1;
        self->looks = 1;
        self->dwell_end = t;
    }
    if (t + 1e-9 >= self->dwell_end) {
        self->looks = !self->looks;
        double median = self->works ? (self->looks ? vars[V_check_median] : vars[V_work_median])
                                    : (self->looks ? vars[V_look_median] : vars[V_glance_median]);
        self->dwell_end = t + median * exp(vars[V_dwell_sd] * dwell);
    }
}

/* Called, he looks at the robot whatever he was at, and a little longer; the process underneath goes on, so that no draw depends on it. */
void attention_step(Plant *self, const double *vars, double t) {
    const double h = vars[V_dt];
    Plan plan = plan_at(self, vars, t);
    const int called = vars[V_announce] > 0.5 || plan.announced > 0.5;
    self->called_for = called ? self->called_for + h : 0.0;
    if (self->called_for > vars[V_announce_latency]) self->watch_until = t + vars[V_watch_after];
    const int looks = self->looks || t < self->watch_until;
    const double aim = looks ? 0.0 : vars[V_work_angle];
    self->yaw += (aim - self->yaw) * h / vars[V_head_lag];
    const int sees = fabs(self->yaw) < 0.5;
    self->attention += ((sees ? 1.0 : 0.0) - self->attention) * h / (sees ? vars[V_attention_rise] : vars[V_attention_fall]);
}
