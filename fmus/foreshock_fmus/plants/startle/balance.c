/* The human's balance: a linear inverted pendulum with ankles, a delayed capture-point feedback and steps back. */
#include <math.h>

#include "model.h"

#define G 9.81

static double spring(double depth, double rate, const BodyRegion *region) {
    double force = region->stiffness * depth + 150.0 * rate; /* 150 N s/m: a few percent of critical */
    return depth > 0.0 && force > 0.0 ? force : 0.0;
}

/* A step back: seen late, decided, in the air, landed behind the capture point as far as leg and floor allow. */
static void step_back(Plant *self, const double *vars, double t, double w, double felt) {
    if (!self->stepping) {
        if (self->steps < 2 && felt > self->edge - 0.01) {
            self->stepping = 1;
            self->lift_at = t + vars[V_step_reaction];
            self->land_at = self->lift_at + vars[V_step_time];
        }
    } else if (t >= self->land_at) {
        double reach = self->edge + vars[V_step_max], wanted = self->u + self->vu / w + 0.1;
        double room = vars[V_heel] + vars[V_foot_room];
        double put = wanted < reach ? wanted : reach;
        if (put > room) put = room;
        if (put > self->edge) self->edge = put;
        self->steps++;
        self->stepping = 0;
    }
}

void balance_step(Plant *self, const double *vars, double t, double jerk_back) {
    const double h = vars[V_dt], w = sqrt(G / vars[V_com_height]), capture = self->u + self->vu / w;
    int back = (int)(vars[V_balance_delay] / h + 0.5);
    if (back > DELAY - 1) back = DELAY - 1;
    self->capture_at = (self->capture_at + 1) % DELAY;
    self->capture[self->capture_at] = capture;
    const double felt = self->capture[(self->capture_at + DELAY - back) % DELAY];
    step_back(self, vars, t, w, felt);
    double wanted = felt + vars[V_ankle_gain] / w * felt + self->sway;
    if (self->steps > 0) wanted = felt + vars[V_ankle_gain] / w * (felt - (self->edge - 0.1)) + self->sway;
    self->cop += (wanted - self->cop) * h / vars[V_ankle_lag];
    if (self->cop > self->edge) self->cop = self->edge;
    if (self->cop < -vars[V_toe]) self->cop = -vars[V_toe];
    self->bench_force = spring(self->u - vars[V_bench_gap], self->vu, &body_pelvis);
    self->robot_force = spring(self->x - vars[V_distance] - self->u, self->v - self->vu, &body_chest);
    if (self->bench_force > self->bench_peak) self->bench_peak = self->bench_force;
    if (self->robot_force > self->robot_peak) self->robot_peak = self->robot_force;
    double a = w * w * (self->u - self->cop) + jerk_back + (self->robot_force - self->bench_force) / vars[V_human_mass];
    if (self->fallen) a = 0.0, self->vu = 0.0;
    self->vu += h * a;
    self->u += h * self->vu;
    double farthest = self->edge + (self->steps < 2 || self->stepping ? vars[V_step_max] : 0.0);
    double room = vars[V_heel] + vars[V_foot_room];
    if (farthest > room) farthest = room > self->edge ? room : self->edge;
    if (self->u + self->vu / w > farthest + 0.1 && self->u < vars[V_bench_gap]) self->fallen = 1;
}
