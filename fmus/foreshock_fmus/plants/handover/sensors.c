/* What the robot measures: noise, and what of hand and object its head camera sees past its own gripper. */
#include <math.h>
#include <string.h>

#include "model.h"

#define HEIGHT 1.0        /* m, of the handover */
#define CAMERA_X (-0.35)  /* m, head camera, from the place of the handover */
#define CAMERA_Z 0.45     /* m, above it */
#define GRIPPER_TOP 0.06  /* m, of the jaws above their middle */
#define HAND_TOP 0.02     /* m, of the partner's fingers */
#define HAND_LENGTH 0.10  /* m, fingertips to wrist as the camera's outline has it */
#define OBJECT_LENGTH 0.16

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* Share of [from, to] (m along the handover) that lies in front of what the gripper's upper edge hides. */
static double seen(const Plant *self, double from, double to) {
    const double slope = (self->x_r - CAMERA_X) / (CAMERA_Z - GRIPPER_TOP);
    const double edge = self->x_r + slope * (GRIPPER_TOP - HAND_TOP);
    return clip((to - edge) / (to - from), 0.0, 1.0);
}

void sensors_sample(Plant *self, const double *vars) {
    double *f = self->frame[self->frames++ % FRAMES];
    const double sd = vars[V_position_noise], tip = self->x_h - self->advance, force = vars[V_force_noise];
    const double draws[5] = {stream_normal(&self->sensor), stream_normal(&self->sensor), stream_normal(&self->sensor),
                             stream_normal(&self->sensor), stream_normal(&self->sensor)};
    const double own = seen(self, tip, tip + HAND_LENGTH);
    /* The hand covers the object from its fingertips on. */
    const double rear = self->x_o - vars[V_overlap], front = fmin(rear + OBJECT_LENGTH, self->hold > 0.5 ? tip : 1e9);
    const double bare = front > rear ? seen(self, rear, front) * (front - rear) / OBJECT_LENGTH : 0.0;
    const int believes = !self->open;
#define AT(name) f[V_##name - V_sensor_time]
    AT(sensor_time) = (double)self->step * vars[V_dt];
    double *w = &AT(wrist_force);
    w[0] = noisy(self, self->pull + self->finger_pull, vars[V_wrench_noise]);
    w[1] = vars[V_wrench_noise] * draws[0];
    w[2] = noisy(self, -self->weight, vars[V_wrench_noise]);
    AT(grip_normal) = noisy(self, self->normal, force);
    AT(grip_tangential) = hypot(self->pull + self->finger_pull, self->weight) + force * draws[1];
    AT(grip_opening) = self->gap;
    AT(grip_command) = self->command;
    AT(grip_acceleration) = 0.02 * draws[2];
    AT(grasping) = believes;
    AT(assumed_mass) = believes ? vars[V_object_mass] : 0.0;
    AT(phase) = self->phase;
    AT(due) = self->phase == PRESENT    ? vars[V_transfer_time] - self->tau
              : self->phase == TRANSFER ? self->since + vars[V_expected_after] - self->tau
                                        : 0.0;
    double *h = &AT(hand_position), *o = &AT(object_position);
    h[0] = noisy(self, tip + 0.5 * HAND_LENGTH, sd), h[1] = noisy(self, 0.0, sd), h[2] = noisy(self, HEIGHT, sd);
    o[0] = noisy(self, rear + 0.5 * OBJECT_LENGTH, sd), o[1] = noisy(self, 0.0, sd), o[2] = noisy(self, HEIGHT, sd);
    AT(hand_visible) = clip(own + vars[V_visible_noise] * draws[3], 0.0, 1.0);
    AT(object_visible) = clip(bare + vars[V_visible_noise] * draws[4], 0.0, 1.0);
    AT(hand_confidence) = clip(0.95 - 0.25 * (1.0 - own) + 0.3 * vars[V_visible_noise] * draws[3], 0.0, 1.0);
#undef AT
}
