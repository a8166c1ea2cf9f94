/* The walking robot: a biped changes its speed only from footfall to footfall, and by no more than a step can take up. */
#include <math.h>

#include "model.h"

/* What the robot wants to walk at, of which protective actions leave a share. */
double robot_goal_speed(const double *vars) {
    double share = 1.0 - (1.0 - vars[V_slow_share]) * vars[V_slow_approach];
    share *= 1.0 - vars[V_speed_scale];
    share *= 1.0 - vars[V_protective_stop];
    return vars[V_robot_speed] * share;
}

void robot_start(Plant *self, const double *vars) {
    const double phase = (double)(stream_next(&self->process) >> 11) * 0x1p-53;
    self->x[X_RVX] = self->command = vars[V_robot_speed];
    self->next_footfall = phase * vars[V_step_time];
}

void robot_tick(Plant *self, const double *vars, double t, double tick_s) {
    for (int i = 0; i < 2; i++) {
        const double draw = stream_normal(&self->process), time = vars[V_sway_time];
        self->sway[i] += -self->sway[i] / time * tick_s + vars[V_sway_noise] * sqrt(2.0 * tick_s / time) * draw;
    }
    if (t + 1e-9 < self->next_footfall) return;
    const double goal = robot_goal_speed(vars), most = vars[V_step_change];
    self->command += fmin(most, fmax(-most, goal - self->command));
    self->next_footfall += vars[V_step_time];
}

void robot_wish(const Plant *self, const double *vars, const double x[X_SIZE], double a[2]) {
    const double most = vars[V_robot_acceleration], lane = vars[V_replan] * vars[V_replan_offset];
    const double sideways = fmin(0.3, fmax(-0.3, TRACK_GAIN * (lane - x[X_RY]))) * fmin(1.0, fabs(self->command) / 0.3);
    a[0] = fmin(most, fmax(-most, (self->command - x[X_RVX]) / vars[V_robot_lag])) + self->sway[0];
    a[1] = fmin(most, fmax(-most, (sideways - x[X_RVY]) / vars[V_robot_lag])) + self->sway[1];
}
