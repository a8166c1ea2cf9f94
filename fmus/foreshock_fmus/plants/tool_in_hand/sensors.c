/* What the robot measures: true values, noise by the sensor stream, latency by a ring. */
#include <math.h>
#include <string.h>

#include "model.h"

#define FOREARM_RADIUS 0.05 /* m */
#define HAND_AHEAD 0.05     /* m, the hand lies on the workpiece beside the tip */

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    double dx[X_SIZE], *x = self->x, length = vars[V_length];
    Forces f;
    rhs(self, vars, t, x, dx, &f);
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    double *s = self->ring[self->ring_at];
    const double sine = sin(x[X_ANGLE]), cosine = cos(x[X_ANGLE]);
    s[S_TIME] = t;
    const double tip[3] = {WRIST_X + x[X_ADVANCE] + length * cosine, length * sine, WRIST_Z};
    for (int i = 0; i < 3; i++) s[S_TIP + i] = noisy(self, tip[i], vars[V_place_noise]);
    s[S_YAW] = noisy(self, x[X_ANGLE], vars[V_angle_noise]);
    const double speed[3] = {x[X_ADVANCE_RATE] * cosine, -x[X_ADVANCE_RATE] * sine + length * x[X_ANGLE_RATE], 0.0};
    for (int i = 0; i < 3; i++) s[S_SPEED + i] = noisy(self, speed[i], 0.2 * vars[V_rate_noise]);
    for (int i = 0; i < 3; i++) s[S_RATE + i] = noisy(self, i == 2 ? x[X_ANGLE_RATE] : 0.0, vars[V_rate_noise]);
    const double force[3] = {-f.normal, f.tangential - f.human, 0.0};
    for (int i = 0; i < 3; i++) s[S_FORCE + i] = noisy(self, force[i], vars[V_force_noise]);
    for (int i = 0; i < 3; i++) s[S_MOMENT + i] = noisy(self, i == 2 ? -f.wrist : 0.0, vars[V_torque_noise]);
    /* what the process explains: tangential force by the motor's current, lean of the disc by the normal force, inertia */
    const double current = noisy(self, f.motor, vars[V_current_noise]);
    const double pressed = noisy(self, f.normal, vars[V_force_noise]);
    const double inertial = vars[V_inertia] * noisy(self, f.angle_acceleration, vars[V_acceleration_noise]);
    s[S_EXPECTED_FORCE] = current / vars[V_disc_radius];
    const double lever = length * (vars[V_coupling] * cosine - sine);
    s[S_EXPECTED] = length * cosine * current / vars[V_disc_radius] - lever * pressed - inertial;
    const double beside = vars[V_human_distance] + self->sway + x[X_HUMAN] + FOREARM_RADIUS;
    s[S_HUMAN] = noisy(self, WRIST_X + length + HAND_AHEAD, vars[V_human_noise]);
    s[S_HUMAN + 1] = noisy(self, beside + 0.5, vars[V_human_noise]);
    const double hand[3] = {WRIST_X + length + HAND_AHEAD, beside, WRIST_Z};
    for (int i = 0; i < 3; i++) s[S_HAND + i] = noisy(self, hand[i], vars[V_human_noise]);
    s[S_SPINDLE] = noisy(self, x[X_SPINDLE], 1.0);
}

void sensors_publish(Plant *self, double *vars, double t) {
    int back = 0;
    for (; back < self->ring_fill - 1; back++) {
        const double *s = self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE];
        if (s[S_TIME] <= t - vars[V_latency] + 1e-9) break;
    }
    const double *s = self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE], half = 0.5 * s[S_YAW];
    vars[V_sensor_time] = s[S_TIME];
    memcpy(vars + V_tip_position, s + S_TIP, 3 * sizeof *vars);
    vars[V_tool_orientation] = vars[V_tool_orientation + 1] = 0.0;
    vars[V_tool_orientation + 2] = sin(half);
    vars[V_tool_orientation + 3] = cos(half);
    memcpy(vars + V_tip_velocity, s + S_SPEED, 3 * sizeof *vars);
    memcpy(vars + V_tool_rate, s + S_RATE, 3 * sizeof *vars);
    memcpy(vars + V_wrist_force, s + S_FORCE, 3 * sizeof *vars);
    memcpy(vars + V_wrist_moment, s + S_MOMENT, 3 * sizeof *vars);
    vars[V_expected_force] = vars[V_expected_force + 2] = 0.0;
    vars[V_expected_force + 1] = s[S_EXPECTED_FORCE];
    vars[V_expected_moment] = vars[V_expected_moment + 1] = 0.0;
    vars[V_expected_moment + 2] = s[S_EXPECTED];
    vars[V_human_x] = s[S_HUMAN];
    vars[V_human_y] = s[S_HUMAN + 1];
    memcpy(vars + V_hand, s + S_HAND, 3 * sizeof *vars);
    vars[V_spindle_measured] = s[S_SPINDLE];
}
