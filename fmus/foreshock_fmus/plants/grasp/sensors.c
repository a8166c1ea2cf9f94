/* What the robot measures: true values, noise by the sensor stream, latency by a ring. */
#include <math.h>
#include <string.h>

#include "model.h"

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    double dx[X_SIZE], *x = self->x;
    Forces f = {0};
    held_rhs(self, vars, t, x, dx, &f);
    const int held = self->stage == STAGE_HELD;
    if (!held) f.tangential = 0.0, f.gripper = self->hand;
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    double *s = self->ring[self->ring_at];
    s[S_TIME] = t;
    s[S_NORMAL] = noisy(self, x[X_NORMAL], vars[V_force_noise]);
    s[S_TANGENTIAL] = noisy(self, f.tangential, vars[V_force_noise]);
    s[S_ACCELERATION] = noisy(self, f.gripper, vars[V_accelerometer_noise]);
    /* pitch about +y lowers what is ahead, so that it is the negative of the angles here */
    for (int i = 0; i < 3; i++) s[S_GYRO + i] = noisy(self, i == 1 ? -x[X_WRIST_RATE] : 0.0, vars[V_gyro_noise]);
    for (int i = 0; i < 3; i++)
        s[S_SPECIFIC + i] = noisy(self, i == 2 ? f.gripper + GRAVITY : 0.0, vars[V_accelerometer_noise]);
    s[S_PITCH] = noisy(self, -x[X_WRIST], vars[V_tilt_noise]);
    s[S_FORCE] = noisy(self, -f.tangential, vars[V_force_noise]);
    s[S_MOMENT] = noisy(self, x[X_TORQUE], vars[V_torque_noise]);
    const double height = held ? vars[V_drop_height] - x[X_LOWERED] - x[X_SLIDE] : self->fall_height;
    const double place[3] = {vars[V_wrist_lever], 0.0, height};
    for (int i = 0; i < 3; i++) s[S_PLACE + i] = noisy(self, place[i], vars[V_place_noise]);
    for (int i = 0; i < 3; i++) s[S_TILT + i] = noisy(self, i == 1 ? -x[X_TILT] : 0.0, vars[V_tilt_noise]);
}

/* Quaternion of a pitch with small rotations about x and z. */
static void quaternion(double roll, double pitch, double yaw, double q[4]) {
    q[0] = 0.5 * roll, q[1] = sin(0.5 * pitch), q[2] = 0.5 * yaw, q[3] = cos(0.5 * pitch);
    const double norm = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int i = 0; i < 4; i++) q[i] /= norm;
}

void sensors_publish(Plant *self, double *vars, double t) {
    int back = 0;
    for (; back < self->ring_fill - 1; back++) {
        const double *s = self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE];
        if (s[S_TIME] <= t - vars[V_latency] + 1e-9) break;
    }
    const double *s = self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE];
    vars[V_sensor_time] = s[S_TIME];
    vars[V_normal_force] = s[S_NORMAL];
    vars[V_tangential_force] = s[S_TANGENTIAL];
    vars[V_acceleration] = s[S_ACCELERATION];
    memcpy(vars + V_gyro, s + S_GYRO, 3 * sizeof *vars);
    memcpy(vars + V_specific_force, s + S_SPECIFIC, 3 * sizeof *vars);
    quaternion(0.0, s[S_PITCH], 0.0, vars + V_gripper_orientation);
    vars[V_wrist_force] = vars[V_wrist_force + 1] = 0.0;
    vars[V_wrist_force + 2] = s[S_FORCE];
    vars[V_wrist_moment] = vars[V_wrist_moment + 2] = 0.0;
    vars[V_wrist_moment + 1] = s[S_MOMENT];
    memcpy(vars + V_object_position, s + S_PLACE, 3 * sizeof *vars);
    quaternion(s[S_TILT], s[S_TILT + 1], s[S_TILT + 2], vars + V_object_orientation);
}
