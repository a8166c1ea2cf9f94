/* The human's hand: it reaches in after the stop signal by its own schedule, and lies between tool and fixture. */
#include <math.h>

#include "model.h"

/* Once per tick, four draws always: reaction and dwell of the next reach, tremor of the axis, eyes. */
void hand_tick(Plant *self, const double *vars, double t) {
    double reaction = stream_normal(&self->process), dwell = stream_normal(&self->process);
    double tremor = stream_normal(&self->process), look = stream_normal(&self->process);
    self->force_noise += -self->force_noise * TICK / 0.05 + vars[V_tremor] * sqrt(2.0 * TICK / 0.05) * tremor;
    self->look_aside += -self->look_aside * TICK / 0.3 + 0.08 * sqrt(2.0 * TICK / 0.3) * look;
    if (fmod(t + 1e-9, vars[V_cycle]) < TICK) {
        self->reaction = vars[V_hand_reaction] * exp(vars[V_hand_sd] * reaction);
        self->dwell = vars[V_hand_dwell] * exp(vars[V_hand_sd] * dwell);
    }
}

static double spring(double depth, double rate) {
    double force = body_hand.stiffness * depth + 60.0 * rate; /* 60 N s/m: a tenth of critical on 8 kg */
    return depth > 0.0 && force > 0.0 ? force : 0.0;
}

void hand_step(Plant *self, const double *vars, double t) {
    const double h = vars[V_dt], rate = vars[V_hand_rate], half = vars[V_hand_half];
    Plan plan = plan_at(self, vars, t);
    const double since = plan.into - vars[V_stop_at] - self->reaction;
    const int called = vars[V_announce] > 0.5 || plan.announced > 0.5;
    self->called_for = called ? self->called_for + h : 0.0;
    const int wants = since >= 0.0 && since < self->dwell && plan.stop > 0.5 && self->called_for < vars[V_call_latency];
    const double place = park_of(vars) - vars[V_hand_before], wall = place - vars[V_fixture_gap];
    const int was_in = self->in > PATH, caught = self->hand_force > 0.0;
    double depth = self->hand + half - (self->x - half);
    if (!caught) { /* a hand that is caught does not come out */
        double a = rate * rate * ((wants ? 1.0 : 0.0) - self->in) - 2.0 * rate * self->in_rate;
        self->in_rate += h * a;
        self->in += h * self->in_rate;
    } else {
        self->in_rate = 0.0;
    }
    if (!was_in && self->in > PATH && depth > 0.0 && self->x > self->hand - 2.0 * half)
        self->in = PATH, self->in_rate = 0.0; /* the place is taken: the hand rests against the tool's side */
    const int in = self->in > PATH;
    /* The tool comes from the side of the planned stop, towards -x; the fixture lies behind the hand. */
    const int above = self->x > self->hand;
    double squeeze = in && above ? spring(depth, self->hand_v - self->v) : 0.0;
    double wall_force = in ? spring(wall - self->hand, -self->hand_v) : 0.0;
    self->hand_force = squeeze;
    self->fixture_force = wall_force;
    if (squeeze > self->hand_peak) self->hand_peak = squeeze;
    self->clamped_for = squeeze > body_hand.limit ? self->clamped_for + h : 0.0;
    if (self->clamped_for > self->clamped) self->clamped = self->clamped_for;
    double arm = vars[V_arm_stiffness] * (place - self->hand) - vars[V_arm_damping] * self->hand_v;
    self->hand_v += h * (arm - squeeze + wall_force) / body_hand.mass;
    self->hand += h * self->hand_v;
    if (!in) self->hand = place, self->hand_v = 0.0; /* outside the tool's way it is free */
}
