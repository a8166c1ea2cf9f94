/* The partner: reaches, grasps, pulls, and when the object resists pulls harder, stiffens and grasps further forward. */
#include <math.h>

#include "model.h"

#define GRASP_S 0.15    /* s, closing of the hand */
#define REGRASP_S 0.35  /* s, reaching forward */
#define TAKE_S 1.0      /* s, taking the object away */
#define YIELD_S 0.2     /* s, in which the arm settles to where it is pulled */
#define TREMOR_S 0.1    /* s, correlation of the tremor */
#define LATE_S 0.15     /* s after the transfer begins: when a partner on time arrives */

void partner_cycle(Plant *self, const double *vars) {
    const double scatter = stream_normal(&self->process); /* one draw a cycle, whatever happens */
    const int disturbed = vars[V_disturbed_cycle] < 0.0 || (double)self->cycle == vars[V_disturbed_cycle];
    const double limited = clip(scatter, -3.0, 3.0) * vars[V_arrival_sd];
    self->arrival = vars[V_transfer_time] + LATE_S + limited + (disturbed ? vars[V_arrival_shift] : 0.0);
    self->stage = RESTING, self->came = 0;
    self->x_h = self->x_eq = REST, self->v_h = self->hold = self->effort = self->advance = self->z_h = self->z_f = 0.0;
}

static double stiffness_of(const Plant *self, const double *vars) {
    return vars[V_arm_stiffness] + vars[V_stiffening] * self->effort; /* co-contraction grows with force */
}

static void reach(Plant *self, const double *vars, double dt) {
    const double s = (self->t - (self->arrival - vars[V_reach_time])) / vars[V_reach_time];
    const double before = self->x_h, target = self->object_seen + CLEARANCE;
    self->x_h = REST + (target - REST) * min_jerk(s);
    self->v_h = (self->x_h - before) / dt;
    if (s < 1.0) return;
    if (self->in_jaws && self->x_h - self->x_o < CLEARANCE + 0.02) {
        self->stage = PULLING, self->pull_from = self->t + 0.5 * GRASP_S;
        self->v_h = self->v_o, self->x_eq = self->x_h;
    } else if (self->t > self->arrival + 2.0 || !self->in_jaws) self->stage = TAKING;
}

/* The voluntary pull rises to what usually suffices, and beyond it while the object resists. */
static void strive(Plant *self, const double *vars, double dt) {
    const double pulled_for = self->t - self->pull_from, resisted = pulled_for - vars[V_resisted_time];
    const int trapped = self->pinch > 0.0;
    const double goal = pulled_for < 0.0 ? 0.0 : resisted < 0.0 && !trapped ? vars[V_pull_nominal] : vars[V_pull_max];
    const double rate = (resisted < 0.0 && !trapped ? 60.0 : vars[V_pull_rate]) * dt;
    self->effort += clip(goal - self->effort, -rate, rate);
    const double forward = (pulled_for - vars[V_regrasp_time]) / REGRASP_S;
    if (self->in_jaws) self->advance = fmax(self->advance, (CLEARANCE + vars[V_regrasp_depth]) * min_jerk(forward));
}

void partner_tick(Plant *self, const double *vars, double dt) {
    const double draw = stream_normal(&self->process), keep = exp(-dt / TREMOR_S);
    self->tremor = keep * self->tremor + vars[V_tremor] * sqrt(1.0 - keep * keep) * draw;
    self->object_seen += (self->x_o - self->object_seen) * fmin(1.0, dt / 0.1);
    self->arm = 0.0;
    if (self->stage == RESTING && self->t >= self->arrival - vars[V_reach_time]) self->stage = REACHING;
    if (self->stage == REACHING) reach(self, vars, dt);
    if (self->stage == RESTING || self->stage == REACHING) return;
    if (self->stage == PULLING) {
        self->hold = fmin(1.0, self->hold + dt / GRASP_S);
        strive(self, vars, dt);
        self->x_eq += (self->x_h - self->x_eq) * fmin(1.0, dt / YIELD_S);
        if (!self->in_jaws && self->pinch <= 0.0) {
            self->came += 1;
            /* The partner takes the object once nothing has held the fingers for a reaction time. */
            if (self->came * dt > 0.25) self->stage = TAKING, self->handed_over += !self->dropped;
        } else self->came = 0;
    } else {
        self->effort *= exp(-dt / 0.1);
        self->x_eq += (REST - self->x_eq) * fmin(1.0, 3.0 * dt / TAKE_S);
        self->advance *= exp(-dt / 0.3);
    }
    const double k = stiffness_of(self, vars), c = 2.0 * vars[V_arm_damping] * sqrt(k * vars[V_hand_mass]);
    self->arm = self->effort + k * (self->x_eq - self->x_h) - c * self->v_h + self->tremor;
    if (self->stage == TAKING) self->arm -= 15.0 * self->v_h;
    self->v_h += dt * (self->arm - self->hand_pull - self->finger_pull) / vars[V_hand_mass];
    self->x_h += dt * self->v_h;
}
