/* What is measured: true values with noise by the sensor stream, late by a ring. */
#include <math.h>

#include "model.h"

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    const double *angle = self->x + X_ANGLE, *rate = self->x + X_RATE;
    double dx[X_SIZE];
    chain_rhs(self, vars, self->x, dx);
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    double *s = self->ring[self->ring_at];
    s[S_TIME] = t;
    for (int i = 0; i < JOINTS; i++) {
        s[S_JOINT + i] = noisy(self, angle[i] - (i ? angle[i - 1] : 0.0), vars[V_encoder_noise]);
        s[S_JOINT_RATE + i] = noisy(self, rate[i] - (i ? rate[i - 1] : 0.0), vars[V_joint_rate_noise]);
    }
    for (int i = 0; i < 3; i++) {
        s[S_TILT + i] = noisy(self, i == 1 ? angle[TRUNK] : 0.0, vars[V_attitude_noise]);
        s[S_GYRO + i] = noisy(self, i == 1 ? rate[TRUNK] : 0.0, vars[V_gyro_noise]);
    }
    /* the IMU sits at the hips, so that its specific force is that of the legs' end */
    const double l = vars[V_legs_length], ax = l * (dx[X_RATE] * cos(angle[0]) - rate[0] * rate[0] * sin(angle[0]));
    const double az = -l * (dx[X_RATE] * sin(angle[0]) + rate[0] * rate[0] * cos(angle[0])) + GRAVITY;
    const double sn = sin(angle[TRUNK]), cs = cos(angle[TRUNK]);
    const double specific[3] = {cs * ax - sn * az, 0.0, sn * ax + cs * az};
    for (int i = 0; i < 3; i++) s[S_SPECIFIC + i] = noisy(self, specific[i], vars[V_accelerometer_noise]);
    const Point hand = chain_hand(vars, angle, rate);
    const double place[3] = {hand.x, vars[V_hand_side], hand.z + vars[V_ankle_height]}, speed[3] = {hand.vx, 0.0, hand.vz};
    for (int i = 0; i < 3; i++) {
        s[S_HAND + i] = noisy(self, place[i], vars[V_hand_noise]);
        s[S_HAND_RATE + i] = noisy(self, speed[i], vars[V_hand_rate_noise]);
    }
    s[S_HUMAN] = noisy(self, self->x[X_HUMAN], vars[V_human_noise]);
    s[S_HUMAN_RATE] = noisy(self, self->x[X_HUMAN_RATE], 2.0 * vars[V_human_noise]);
}

void sensors_publish(Plant *self, double *vars, double t) {
    int at = self->ring_at;
    for (int age = 1; age < self->ring_fill && self->ring[at][S_TIME] > t - vars[V_latency] + 1e-9; age++)
        at = (at + RING_SIZE - 1) % RING_SIZE;
    const double *s = self->ring[at];
    vars[V_sensor_time] = s[S_TIME];
    for (int i = 0; i < JOINTS; i++) {
        vars[V_joint_position + i] = s[S_JOINT + i];
        vars[V_joint_velocity + i] = s[S_JOINT_RATE + i];
    }
    double norm = 1.0, half[3];
    for (int i = 0; i < 3; i++) half[i] = tan(0.5 * s[S_TILT + i]), norm += half[i] * half[i];
    for (int i = 0; i < 3; i++) {
        vars[V_imu_orientation + i] = half[i] / sqrt(norm);
        vars[V_imu_gyro + i] = s[S_GYRO + i];
        vars[V_imu_acceleration + i] = s[S_SPECIFIC + i];
        vars[V_hand_position + i] = s[S_HAND + i];
        vars[V_hand_velocity + i] = s[S_HAND_RATE + i];
    }
    vars[V_imu_orientation + 3] = 1.0 / sqrt(norm);
    vars[V_human_x] = s[S_HUMAN];
    vars[V_human_vx] = s[S_HUMAN_RATE];
}
