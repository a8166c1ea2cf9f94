/* What the robot measures: its wrist and grip, and the load by its camera. */
#include <math.h>

#include "model.h"

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

void sensors_sample(Plant *self, const double *vars) {
    double *f = self->frame[self->frames++ % FRAMES];
    const Carrier *robot = &self->carrier[ROBOT];
    const double tilt = noisy(self, self->tilt, vars[V_tilt_noise]), c = cos(self->tilt), s = sin(self->tilt);
    const double speed = vars[V_step_length] * vars[V_robot_cadence] * robot->walk, sd = vars[V_rate_noise];
#define AT(name) f[V_##name - V_sensor_time]
    AT(sensor_time) = (double)self->step * vars[V_dt];
    double *w = &AT(wrist_force), *p = &AT(load_position), *q = &AT(load_orientation), *v = &AT(load_linear), *r = &AT(load_angular);
    for (int i = 0; i < 3; i++) w[i] = noisy(self, i == 2 ? -robot->force : 0.0, vars[V_wrench_noise]);
    AT(grip_normal) = noisy(self, self->grip, vars[V_grip_noise]);
    AT(grip_tangential) = noisy(self, fabs(robot->force), vars[V_grip_noise]);
    AT(grip_command) = self->command;
    AT(grasping) = robot->lost < 0.5;
    /* A load that stands on the floor is nobody's share, and the plan knows when it has put it there. */
    AT(agreed_share) = 0.5 * clip((robot->height - vars[V_grip_height]) / 0.05, 0.0, 1.0);
    AT(assumed_mass) = robot->lost < 0.5 ? 0.5 * (vars[V_box_mass] + vars[V_content_mass]) : 0.0;
    for (int i = 0; i < 3; i++) p[i] = noisy(self, i == 0 ? self->x : i == 2 ? self->z : 0.0, vars[V_position_noise]);
    /* The partner's end up is a turn about -y (REP 103). */
    q[0] = q[2] = 0.0, q[1] = -sin(0.5 * tilt), q[3] = cos(0.5 * tilt);
    v[0] = noisy(self, speed * c + self->vz * s, sd), v[1] = noisy(self, 0.0, sd), v[2] = noisy(self, self->vz * c - speed * s, sd);
    for (int i = 0; i < 3; i++) r[i] = noisy(self, i == 1 ? -self->rate : 0.0, vars[V_tilt_rate_noise]);
#undef AT
}
