/* Plan, whole-body control with its computing time, and the drive's own hold. */
#include <math.h>

#include "model.h"

static double follow(double from, double to, double h, double span) { return from + (to - from) * (1.0 - exp(-h / span)); }

/* Minimum jerk from 0 to 1 in time 1 (Flash, Hogan 1985). */
static Due minimum_jerk(double s) {
    if (s <= 0.0) return (Due){0.0, 0.0, 0.0};
    if (s >= 1.0) return (Due){1.0, 0.0, 0.0};
    return (Due){s * s * s * (10.0 - s * (15.0 - 6.0 * s)), 30.0 * s * s * (1.0 - s) * (1.0 - s), 60.0 * s * (1.0 - s * (3.0 - 2.0 * s))};
}

/* Up, wait, down, wait; the phase runs slower when derated and stands when stopped. */
void plan(Plant *self, const double *vars, double h) {
    const double move = vars[V_move_time], half = move + vars[V_wait_time], span = vars[V_angle_high] - vars[V_angle_low];
    const double target = (1.0 - vars[V_derate_pace] * self->derate) * (vars[V_protective_stop] > 0.5 || self->braked ? 0.0 : 1.0);
    const double pace = follow(self->pace, target, h, vars[V_pace_time]), push = (pace - self->pace) / h;
    self->pace = pace;
    self->phase += h * pace;
    const double in = fmod(self->phase, 2.0 * half), at = in < half ? in : in - half;
    const Due m = minimum_jerk((at - vars[V_wait_time]) / move);
    const double sign = in < half ? 1.0 : -1.0, v = sign * span * m.rate / move;
    self->due.angle = in < half ? vars[V_angle_low] + span * m.angle : vars[V_angle_high] - span * m.angle;
    self->due.rate = v * pace;
    self->due.acceleration = sign * span * m.acceleration / (move * move) * pace * pace + v * push;
}

/* One cycle of control. Work that does not fit waits in a queue: the command that comes out is as old as the queue is long
 * (Lindley's recursion of a single server). Active limits cost iterations of the active-set solver; a sagging bus slows
 * the clock. All three draws are made in every cycle, so that runs of one seed stay paired. */
void control_cycle(Plant *self, const double *vars) {
    const double jitter = stream_normal(&self->process), rare = stream_normal(&self->process), drift = stream_normal(&self->process);
    const double *x = self->x;
    self->hand_off = self->hand_off * exp(-CYCLE / 0.5) + vars[V_hand_noise] * sqrt(1.0 - exp(-2.0 * CYCLE / 0.5)) * drift;
    self->derate = follow(self->derate, vars[V_derate], CYCLE, vars[V_act_rise]);
    self->stop = follow(self->stop, vars[V_protective_stop], CYCLE, vars[V_act_rise]);
    if (vars[V_brake_joints] > 0.5) {
        self->braking += CYCLE;
        if (!self->braked && self->braking >= vars[V_brake_delay]) self->braked = 1, self->brake_at = x[X_MOTOR];
    } else {
        self->braking = 0.0, self->braked = 0;
    }
    self->measured_at = (self->measured_at + 1) % DELAY_SIZE;
    self->measured[self->measured_at][0] = x[X_MOTOR], self->measured[self->measured_at][1] = x[X_MOTOR_RATE];
    plan(self, vars, CYCLE);
    const double slow = CLIP((vars[V_volts_throttle] - x[X_VOLTS]) / 2.0, 0.0, 1.0), clock = 1.0 - slow * (1.0 - vars[V_throttled]);
    double work = vars[V_solve_time] * exp(vars[V_solve_jitter] * jitter) * (1.0 + vars[V_solve_bound] * self->bound);
    if (rare > 3.1) work += vars[V_solve_spike];
    work /= clock;
    self->round_trip = self->backlog + work;
    self->backlog = CLIP(self->backlog + work - CYCLE, 0.0, vars[V_queue]);
    /* a protective stop hands the joint to the drive, which holds it by itself, without the queue */
    const double age = vars[V_protective_stop] > 0.5 ? 0.0 : self->round_trip;
    int late = (int)(age / CYCLE);
    if (late > DELAY_SIZE - 1) late = DELAY_SIZE - 1;
    const double *seen = self->measured[(self->measured_at + DELAY_SIZE - late) % DELAY_SIZE];
    const double inertia = vars[V_motor_inertia] + arm_inertia(vars);
    self->wanted = weight_torque(vars, self->due.angle) + inertia * self->due.acceleration + vars[V_viscosity] * self->due.rate +
                   vars[V_stiffness] * (self->due.angle - seen[0]) + vars[V_damping] * (self->due.rate - seen[1]);
    const double asked = self->wanted / vars[V_torque_per_ampere], most = current_limit(vars, x);
    self->current = self->braked ? 0.0 : CLIP(asked, -most, most);
    self->bound = follow(self->bound, fabs(asked) > most, CYCLE, 0.05);
}
