/* What the robot and its surroundings measure: true values by kinematics, noise by the sensor stream, latency by a ring. */
#include <math.h>
#include <string.h>

#include "model.h"

#define EPSILON 2e-4 /* s, of the central differences along the motion: errors below 1e-7 m/s and 1e-6 m/s2 */

static const double imu_place[3] = {0.0497762, 0.0, 0.14987}; /* m, in base_link: imu_link of the URDF */

/* q at time offset e along the motion, second order. */
static void pose_at(const Plant *self, double e, const double *c, const double *v, const double *a, int n, double *q) {
    double d[C_SIZE];
    for (int i = 0; i < n; i++) d[i] = c[i] + e * v[i] + 0.5 * e * e * a[i];
    if (self->stage == STAGE_STANDING) talos_standing(d, q);
    else talos_falling(self->fall_q, self->fall_edge, self->fall_side, d, q);
}

static void imu_point(const double *q, double *y, double *z) {
    double r = 2.0 * atan2(q[3], q[6]);
    *y = q[1] - sin(r) * imu_place[2];
    *z = q[2] + cos(r) * imu_place[2];
}

static int motion(const Plant *self, const double *vars, double t, double *c, double *v, double *a, Contact *contact) {
    const double *x = self->x;
    if (self->stage == STAGE_STANDING) {
        double dx[X_SIZE];
        standing_rhs(self, vars, x, dx, contact);
        const int from[C_SIZE] = {-1, X_ROLL, X_YL, X_YR, -1, -1, X_AL, X_AR};
        for (int i = 0; i < C_SIZE; i++)
            if (from[i] >= 0) c[i] = x[from[i]], v[i] = x[from[i] + 1], a[i] = dx[from[i] + 1];
        c[C_Y] = com_of(x), v[C_Y] = com_rate_of(x), a[C_Y] = contact->com_acceleration;
        for (int i = 0; i < 2; i++) c[C_LIFT_LEFT + i] = lift_height(&self->lift[i], t, &v[C_LIFT_LEFT + i], &a[C_LIFT_LEFT + i]);
        return C_SIZE;
    }
    double df[T_SIZE], side = self->fall_side;
    const double *f = self->fall;
    fall_rhs(self, vars, f, df, contact);
    if (self->stage == STAGE_DOWN) {
        memset(df, 0, sizeof df);
        *contact = (Contact){.cop = self->fall_edge, .low = self->fall_edge, .high = self->fall_edge};
    }
    c[F_TURN] = -side * (f[T_TURN] - self->fall_start), c[F_ROLL] = -side * f[T_ROLL];
    c[F_LENGTH] = f[T_LENGTH] / self->fall_length;
    v[F_TURN] = -side * f[T_TURN_RATE], v[F_ROLL] = -side * f[T_ROLL_RATE];
    v[F_LENGTH] = f[T_LENGTH_RATE] / self->fall_length;
    a[F_TURN] = -side * df[T_TURN_RATE], a[F_ROLL] = -side * df[T_ROLL_RATE];
    a[F_LENGTH] = df[T_LENGTH_RATE] / self->fall_length;
    c[F_ARM_LEFT] = x[X_AL], c[F_ARM_RIGHT] = x[X_AR];
    v[F_ARM_LEFT] = v[F_ARM_RIGHT] = a[F_ARM_LEFT] = a[F_ARM_RIGHT] = 0.0;
    return F_SIZE;
}

/* Ground on the sole in the sole's frame: a normal force whose centre is off along y and x. */
static void wrench(double *w, double fy, double fz, double off_x, double off_y) {
    w[0] = 0.0, w[1] = fy, w[2] = fz;
    w[3] = off_y * fz, w[4] = -off_x * fz, w[5] = off_x * fy;
}

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    double c[C_SIZE] = {0}, v[C_SIZE] = {0}, a[C_SIZE] = {0}, q[TALOS_NQ], before[TALOS_NQ], after[TALOS_NQ], com[3];
    double *s, *sq, *sv, *imu, *w, y0, z0, y1, z1, y2, z2;
    Contact contact;
    int n = motion(self, vars, t, c, v, a, &contact);
    pose_at(self, 0.0, c, v, a, n, q);
    pose_at(self, -EPSILON, c, v, a, n, before);
    pose_at(self, EPSILON, c, v, a, n, after);
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    s = self->ring[self->ring_at], sq = s + S_Q, sv = s + S_V, imu = s + S_IMU, w = s + S_WRENCH;
    s[S_TIME] = t;
    double r = 2.0 * atan2(q[3], q[6]), sr = sin(r), cr = cos(r), h = 0.5 / EPSILON;
    double vy = (after[1] - before[1]) * h, vz = (after[2] - before[2]) * h, rate = v[C_ROLL];
    sq[0] = noisy(self, q[0], vars[V_base_noise]);
    sq[1] = noisy(self, q[1], vars[V_base_noise]);
    sq[2] = noisy(self, q[2], vars[V_base_noise]);
    double tilt[3], norm = 1.0;
    for (int i = 0; i < 3; i++) tilt[i] = noisy(self, i ? 0.0 : r, vars[V_attitude_noise]);
    for (int i = 1; i < 3; i++) norm += 0.25 * tilt[i] * tilt[i];
    norm = sqrt(norm);
    sq[3] = sin(0.5 * tilt[0]) / norm, sq[6] = cos(0.5 * tilt[0]) / norm;
    sq[4] = 0.5 * tilt[1] / norm, sq[5] = 0.5 * tilt[2] / norm;
    sv[0] = noisy(self, 0.0, vars[V_base_rate_noise]);
    sv[1] = noisy(self, cr * vy + sr * vz, vars[V_base_rate_noise]);
    sv[2] = noisy(self, -sr * vy + cr * vz, vars[V_base_rate_noise]);
    for (int i = 0; i < 3; i++) sv[3 + i] = imu[4 + i] = noisy(self, i ? 0.0 : rate, vars[V_gyro_noise]);
    for (int i = 7; i < TALOS_NQ; i++) {
        sq[i] = noisy(self, q[i], vars[V_encoder_noise]);
        sv[i - 1] = noisy(self, (after[i] - before[i]) * h, vars[V_joint_rate_noise]);
    }
    memcpy(imu, sq + 3, 4 * sizeof *imu);
    imu_point(q, &y0, &z0), imu_point(before, &y1, &z1), imu_point(after, &y2, &z2);
    double ay = (y2 - 2.0 * y0 + y1) / (EPSILON * EPSILON), az = (z2 - 2.0 * z0 + z1) / (EPSILON * EPSILON) + GRAVITY;
    const double felt[3] = {0.0, cr * ay + sr * az, -sr * ay + cr * az};
    for (int i = 0; i < 3; i++) imu[7 + i] = noisy(self, felt[i], vars[V_accelerometer_noise]);
    talos_com(q, com);
    double sole_x = -0.0088469465, load = self->stage == STAGE_STANDING ? WEIGHT : contact.load, half = vars[V_sole_half_width];
    double share = self->stage == STAGE_STANDING ? contact.share : self->left_down ? 1.0 : 0.0, off[2];
    for (int i = 0; i < 2; i++) {
        double d = contact.cop - self->x[i ? X_YR : X_YL]; /* between the soles each is loaded in its middle */
        off[i] = share > 0.0 && share < 1.0 ? 0.0 : d > half ? half : d < -half ? -half : d;
    }
    wrench(w, contact.force_left, share * load, com[0] - sole_x, off[0]);
    wrench(w + 6, contact.force_right, (1.0 - share) * load, com[0] - sole_x, off[1]);
    for (int i = 0; i < WRENCH_SIZE; i++) w[i] = noisy(self, w[i], vars[i % 6 < 3 ? V_force_noise : V_torque_noise]);
    double place = vars[V_human_place_y], speed = 0.0;
    if (self->stage != STAGE_STANDING) {
        place = self->fall_side * self->fall[T_HUMAN];
        speed = self->fall_side * self->fall[T_HUMAN_RATE];
    }
    s[S_HUMAN] = noisy(self, vars[V_human_place_x], vars[V_human_noise]);
    s[S_HUMAN + 1] = noisy(self, place, vars[V_human_noise]);
    s[S_HUMAN + 2] = noisy(self, speed, 2.0 * vars[V_human_noise]);
}

void sensors_publish(Plant *self, double *vars, double t) {
    int back = 0;
    for (; back < self->ring_fill - 1; back++) {
        const double *s = self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE];
        if (s[S_TIME] <= t - vars[V_latency] + 1e-9) break;
    }
    const double *s = self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE];
    vars[V_sensor_time] = s[S_TIME];
    memcpy(vars + V_base_position, s + S_Q, TALOS_NQ * sizeof *vars);
    memcpy(vars + V_base_linear, s + S_V, TALOS_NV * sizeof *vars);
    memcpy(vars + V_imu_orientation, s + S_IMU, 4 * sizeof *vars);
    memcpy(vars + V_imu_gyro, s + S_IMU + 4, 3 * sizeof *vars);
    memcpy(vars + V_imu_acceleration, s + S_IMU + 7, 3 * sizeof *vars);
    memcpy(vars + V_left_force, s + S_WRENCH, 3 * sizeof *vars);
    memcpy(vars + V_left_torque, s + S_WRENCH + 3, 3 * sizeof *vars);
    memcpy(vars + V_right_force, s + S_WRENCH + 6, 3 * sizeof *vars);
    memcpy(vars + V_right_torque, s + S_WRENCH + 9, 3 * sizeof *vars);
    vars[V_human_x] = s[S_HUMAN];
    vars[V_human_y] = s[S_HUMAN + 1];
    vars[V_human_vy] = s[S_HUMAN + 2];
}
