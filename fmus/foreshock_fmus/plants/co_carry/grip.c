/* The robot's grip: as much as the load needs that the planned gait lets it expect, and slip where that is too little. */
#include <math.h>

#include "model.h"

#define SPREAD_S 1.5  /* s, over which the size of the load's swing is learnt */
#define PASSIVE_N 5.0 /* N, least grip */

void grip_tick(Plant *self, const double *vars, double dt) {
    Carrier *robot = &self->carrier[ROBOT];
    if (robot->lost > 0.5) {
        self->command = self->grip = 0.0;
        return;
    }
    const double load = fabs(robot->force), off = load - self->mean;
    self->mean += off * fmin(1.0, dt / vars[V_grip_average]);
    self->spread += (off * off - self->spread) * fmin(1.0, dt / SPREAD_S);
    /* A load that is moved as A sin(phase) weighs more by -A w^2 sin(phase). */
    const double swing = -robot->walk * sqrt(2.0 * self->spread) * sin(self->plan_phase + vars[V_grip_phase]);
    const double wanted = vars[V_grip_margin] * (self->mean + swing) / (2.0 * vars[V_grip_friction]);
    self->command = clip(wanted + vars[V_regrasp_force] * self->act[REGRASP], PASSIVE_N, vars[V_grip_max]);
    self->grip += (self->command - self->grip) * fmin(1.0, dt / vars[V_grip_lag]);
    const double most = 2.0 * vars[V_friction] * self->grip;
    if (load > most) { /* return mapping: the pads hold no more, the load gives way by the rest */
        const double k = vars[V_robot_stiffness] + vars[V_robot_damping] / dt;
        self->slip += (robot->force - copysign(most, robot->force)) / k;
        robot->force = copysign(most, robot->force);
    }
    if (self->slip > vars[V_pad_length]) robot->lost = 1.0, robot->force = 0.0;
}
