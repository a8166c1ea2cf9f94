/* The robot: its plan, an arm under admittance control, and a gripper that holds the harder the more it is pulled. */
#include <math.h>

#include "model.h"

#define PULL_S 0.03     /* s, filter of the pull that the plan goes by */
#define RETREAT_MS 0.4  /* m/s */
#define SERVO_RATIO 0.8 /* damping ratio of the position servo */
#define FINGER_RATIO 0.3 /* damping ratio of the jaws on their spring */
#define SLIPS_MS 0.02   /* m/s, slip that the pads' sensor notices */

static double delayed(Delay *d, double value, double delay, double dt) {
    d->value[d->at] = value;
    const int back = (int)(delay / dt + 0.5);
    const double old = d->value[(d->at + RING - back) % RING];
    d->at = (d->at + 1) % RING;
    return old;
}

void robot_cycle(Plant *self) {
    self->phase = PRESENT, self->releasing = self->open = self->lost = 0;
    self->tau = self->since = self->pulled = 0.0;
    self->x_s = self->x_a = self->x_r = self->x_o = self->object_seen = FAR;
    self->v_a = self->v_r = self->v_o = self->z_r = self->gap_v = self->closing = self->reflex = 0.0;
    self->felt = self->load_filtered = self->pull_filtered = self->confirmed = self->withdraw_from = 0.0;
    self->in_jaws = 1, self->dropped = 0, self->pinch_for = 0.0;
}

static void enter(Plant *self, int phase) {
    self->phase = phase, self->since = self->tau, self->pulled = 0.0, self->withdraw_from = self->x_s;
}

static void plan(Plant *self, const double *vars, double dt) {
    const double in_phase = self->tau - self->since;
    const int pulled = self->pull_filtered > vars[V_pull_on];
    if (pulled) self->pulled += dt;
    switch (self->phase) {
    case PRESENT:
        self->x_s = FAR * (1.0 - min_jerk(self->tau / vars[V_present_time]));
        if (self->tau >= vars[V_transfer_time]) enter(self, TRANSFER);
        break;
    case TRANSFER:
        if (self->pulled <= 0.0 && in_phase > vars[V_expected_after] + vars[V_patience]) enter(self, WITHDRAW);
        break;
    case WITHDRAW:
        self->x_s = self->withdraw_from - vars[V_withdraw_way] * min_jerk(in_phase);
        if (self->pulled > vars[V_reoffer_time]) enter(self, TRANSFER);
        else if (in_phase > 2.0 && self->pulled <= 0.0) enter(self, RETREAT);
        break;
    default: self->x_s = fmax(FAR, self->x_s - RETREAT_MS * dt);
    }
    if ((self->lost || (self->open && !self->in_jaws)) && self->phase != RETREAT) enter(self, RETREAT);
}

/* Grip force by load (Chan et al., 2012), a slip reflex, and letting go when the plan allows and the partner pulls. */
static void grip(Plant *self, const double *vars, double dt) {
    const double load = hypot(self->pull + self->finger_pull, self->weight), slip = fabs(self->v_o - self->v_r);
    const int asked = self->act[1] > 0.5, held = self->act[0] > 0.5 && !asked;
    self->load_filtered += (load - self->load_filtered) * fmin(1.0, dt / vars[V_grip_filter]);
    self->reflex *= exp(-dt / vars[V_reflex_decay]);
    if (self->slips && !self->releasing && slip > SLIPS_MS) self->reflex += vars[V_reflex_rate] * dt;
    self->confirmed = self->phase == TRANSFER && self->pull_filtered > vars[V_pull_on] ? self->confirmed + dt : 0.0;
    if (asked || (self->confirmed >= vars[V_pull_confirm] && !held)) self->releasing = 1;
    else if (self->pull_filtered < vars[V_pull_off] && !self->open) self->releasing = 0;
    if (self->releasing) self->command = fmax(0.0, self->command - vars[V_release_rate] * dt);
    else if (!held) {
        const double wanted = vars[V_grip_base] + vars[V_grip_gain] * self->load_filtered + self->reflex;
        self->command = fmin(vars[V_grip_max], wanted);
    }
    if (self->releasing && self->command < CARRIES_N) self->open = 1;
    if (self->gap < EMPTY) self->lost = self->open = 1;
}

/* A motor behind a spring moves the jaws (series-elastic fingers): it closes by the error of the force in the spring. */
static void jaws(Plant *self, const double *vars, double dt) {
    const double k = vars[V_finger_stiffness], m = vars[V_finger_mass], most = vars[V_jaw_speed];
    const double spring = k * (self->gap - self->motor), felt = delayed(&self->grip, spring, vars[V_grip_delay], dt);
    const double wanted = self->open ? -most : clip(vars[V_grip_servo] * (self->command - felt), -most, most);
    self->closing += (wanted - self->closing) * fmin(1.0, dt / vars[V_grip_lag]);
    self->motor -= dt * self->closing;
    if (self->motor > WIDE) self->motor = WIDE, self->closing = 0.0;
    const double damping = 2.0 * FINGER_RATIO * sqrt(k * m) * (self->closing + self->gap_v);
    self->gap_v += dt * (self->normal - spring - damping) / m;
    self->gap += dt * self->gap_v;
    if (self->gap < 0.0) self->gap = 0.0, self->gap_v = fmax(0.0, self->gap_v);
}

static void arm(Plant *self, const double *vars, double dt) {
    const double force = self->pull + self->finger_pull, free_ = 1.0 - self->act[0], w = vars[V_servo];
    const double felt = delayed(&self->wrench, force, vars[V_wrench_delay], dt);
    self->felt += (felt - self->felt) * fmin(1.0, dt / vars[V_wrench_filter]);
    double goal = self->x_s;
    if (self->act[2] > 0.5 && self->open) goal = self->x_s = fmax(FAR, self->x_s - RETREAT_MS * dt);
    const double a = free_ * self->felt - vars[V_virtual_damping] * self->v_a - vars[V_virtual_stiffness] * (self->x_a - goal);
    self->v_a = clip(self->v_a + dt * a / vars[V_virtual_mass], -vars[V_speed_max], vars[V_speed_max]);
    self->x_a += dt * self->v_a;
    const double servo = w * w * (self->x_a - self->x_r) + 2.0 * SERVO_RATIO * w * (self->v_a - self->v_r);
    self->v_r += dt * (servo + force / vars[V_reflected_mass]);
    self->x_r += dt * self->v_r;
}

void robot_tick(Plant *self, const double *vars, double dt) {
    self->pull_filtered += (self->pull + self->finger_pull - self->pull_filtered) * fmin(1.0, dt / PULL_S);
    if (self->act[0] <= 0.5) {
        self->tau += dt;
        plan(self, vars, dt);
    }
    grip(self, vars, dt);
    jaws(self, vars, dt);
    arm(self, vars, dt);
}
