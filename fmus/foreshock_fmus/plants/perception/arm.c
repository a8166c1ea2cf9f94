/* The arm at the end of its position servo, the table, and a human's forearm that rests on it. */
#include "model.h"

double forearm_x(const Plant *self, const double *vars) { return vars[V_forearm_x] + self->sway[0] + self->pulled; }

double forearm_y(const Plant *self, const double *vars) { return vars[V_forearm_y] + self->sway[1]; }

void human_frame(Plant *self, const double *vars) {
    const double keep = exp(-FRAME / 1.0), kick = sqrt(1.0 - keep * keep) * vars[V_wander];
    for (int k = 0; k < 2; k++) self->sway[k] = keep * self->sway[k] + kick * stream_normal(&self->process);
    const int warned = vars[V_announce] > 0.5;
    self->warned_time = warned ? self->warned_time + FRAME : 0.0;
    self->quiet_time = warned ? 0.0 : self->quiet_time + FRAME;
    const double step = vars[V_pull_speed] * FRAME;
    /* clamped under the hand it cannot be drawn away */
    if (self->warned_time >= vars[V_reaction_time] && contact_force(self, vars, self->x) < 30.0)
        self->pulled = fmin(self->pulled + step, vars[V_pull_distance]);
    else if (self->quiet_time >= vars[V_return_time]) self->pulled = fmax(self->pulled - 0.5 * step, 0.0);
}

static double depth_of(const Plant *self, const double *vars, const double *x) {
    if (fabs(x[0] - forearm_x(self, vars)) > vars[V_forearm_half_length]) return 0.0;
    if (fabs(x[1] - forearm_y(self, vars)) > vars[V_forearm_half_width]) return 0.0;
    return fmax(vars[V_forearm_height] - x[2], 0.0);
}

/* Elastic and damping share of a contact that pushes only. */
static double push(double stiffness, double damping, double depth, double speed, double *lost) {
    if (depth <= 0.0) return *lost = 0.0;
    const double elastic = stiffness * depth, total = fmax(elastic - damping * speed, 0.0);
    *lost = (elastic - total) * speed;
    return total;
}

double contact_force(const Plant *self, const double *vars, const double *x) {
    double lost;
    return push(body_forearm.stiffness, vars[V_contact_damping], depth_of(self, vars, x), x[X_SPEED + 2], &lost);
}

double contact_energy(const Plant *self, const double *vars, const double *x) {
    const double forearm = depth_of(self, vars, x), table = fmax(-x[2], 0.0);
    return 0.5 * (body_forearm.stiffness * forearm * forearm + TABLE_STIFFNESS * table * table);
}

void arm_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]) {
    double lost_forearm, lost_table, work = 0.0;
    const double up = push(body_forearm.stiffness, vars[V_contact_damping], depth_of(self, vars, x), x[X_SPEED + 2], &lost_forearm) +
                      push(TABLE_STIFFNESS, vars[V_contact_damping], fmax(-x[2], 0.0), x[X_SPEED + 2], &lost_table);
    for (int k = 0; k < 3; k++) {
        const double servo = clip(vars[V_arm_stiffness] * (self->reference[k] - x[k]) +
                                      vars[V_arm_damping] * (self->reference_speed[k] - x[X_SPEED + k]),
                                  -vars[V_arm_force], vars[V_arm_force]);
        dx[k] = x[X_SPEED + k];
        dx[X_SPEED + k] = (servo + (k == 2 ? up : 0.0)) / vars[V_arm_mass];
        work += servo * x[X_SPEED + k];
    }
    dx[X_WORK] = work;
    dx[X_HEAT] = lost_forearm + lost_table;
}
