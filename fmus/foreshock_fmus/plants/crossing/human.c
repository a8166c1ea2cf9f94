/* The walking human: the social force of Helbing and Molnar (1995), felt only when the robot has been noticed. */
#include <math.h>

#include "model.h"

static double uniform(Stream *r) { return (double)(stream_next(r) >> 11) * 0x1p-53; }

void human_start(Plant *self, const double *vars) {
    double *x = self->x;
    const double c = cos(vars[V_human_heading]), s = sin(vars[V_human_heading]), v = vars[V_human_speed];
    const double back = v * (vars[V_meet_time] + vars[V_human_late]), aside = vars[V_human_aside];
    x[X_HX] = vars[V_robot_speed] * vars[V_meet_time] - c * back - s * aside;
    x[X_HY] = -s * back + c * aside;
    x[X_HVX] = c * v, x[X_HVY] = s * v;
    /* Drawn whatever happens later: paired runs share them. */
    self->reaction = vars[V_reaction_time] * exp(0.25 * stream_normal(&self->process));
    self->hearing = uniform(&self->process);
    self->aware = uniform(&self->process) < vars[V_attention];
    self->announced_at = -1.0;
}

void human_tick(Plant *self, const double *vars, double t, double tick_s) {
    for (int i = 0; i < 2; i++) {
        const double draw = stream_normal(&self->process), time = vars[V_wander_time];
        self->wander[i] += -self->wander[i] / time * tick_s + vars[V_wander_noise] * sqrt(2.0 * tick_s / time) * draw;
    }
    if (vars[V_announce] > 0.5 && self->announced_at < 0.0) self->announced_at = t;
    if (self->announced_at >= 0.0 && t >= self->announced_at + self->reaction && self->hearing < vars[V_hears])
        self->aware = 1;
    const double *x = self->x;
    const double rx = x[X_HX] - x[X_RX], ry = x[X_HY] - x[X_RY], vx = x[X_HVX] - x[X_RVX], vy = x[X_HVY] - x[X_RVY];
    const double v2 = fmax(vx * vx + vy * vy, 1e-6), when = -(rx * vx + ry * vy) / v2;
    const double miss = sqrt(fmax(0.0, rx * rx + ry * ry - when * when * v2 * (when > 0.0)));
    const int conflict = when > 0.0 && when < 3.0 && miss < vars[V_yield_distance];
    /* One who has stopped waits until the robot has gone by or stands. */
    const int waits = self->yielding && rx * rx + ry * ry < 9.0 && x[X_RVX] > 0.1 && rx > -0.3;
    self->yielding = self->aware && (conflict || waits) && sight_share(vars, x[X_HX], x[X_HY], x[X_RX], x[X_RY]) > 0.5;
}

void human_wish(const Plant *self, const double *vars, const double x[X_SIZE], double a[2]) {
    const double c = cos(vars[V_human_heading]), s = sin(vars[V_human_heading]);
    const double v = self->yielding ? 0.0 : vars[V_human_speed], most = vars[V_human_acceleration];
    double ax = (c * v - x[X_HVX]) / vars[V_human_lag], ay = (s * v - x[X_HVY]) / vars[V_human_lag];
    if (self->aware) {
        const double dx = x[X_HX] - x[X_RX], dy = x[X_HY] - x[X_RY], range = fmax(sqrt(dx * dx + dy * dy), 1e-9);
        const double push = vars[V_social_strength] *
            exp((vars[V_robot_radius] + vars[V_human_radius] - range) / vars[V_social_range]);
        ax += push * dx / range, ay += push * dy / range;
    }
    const double norm = sqrt(ax * ax + ay * ay), cut = norm > most ? most / norm : 1.0;
    a[0] = cut * ax + self->wander[0], a[1] = cut * ay + self->wander[1];
}
