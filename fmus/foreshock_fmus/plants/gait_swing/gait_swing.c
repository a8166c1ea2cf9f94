/* The gait_swing plant: the swing leg of a walking humanoid beside a human who steps in. README.md has the equations. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model.h"

#define TICK 0.002 /* s, period of the robot's control and of process noise */

const size_t plant_size = sizeof(struct Plant);

const char *plant_message(const Plant *self) { return self->message; }

static int fail(Plant *self, int code, const char *text, double value) {
    snprintf(self->message, sizeof self->message, text, value);
    return code;
}

/* Number of internal steps in a time, or -1 if the time is no multiple of the step. */
static long long steps_in(const double *vars, double time_s) {
    const double n = time_s / vars[V_dt], whole = floor(n + 0.5);
    return whole >= 1.0 && fabs(n - whole) < 1e-6 * (1.0 + n) ? (long long)whole : -1;
}

static double now(const Plant *self, const double *vars) { return (double)self->step * vars[V_dt]; }

static void rhs(const Plant *self, const double *vars, double t, const double x[X_SIZE], double dx[X_SIZE]) {
    double force[2], clearance, general[3];
    LegTerms terms;
    memset(dx, 0, X_SIZE * sizeof *dx);
    dx[X_PELVIS] = x[X_PELVIS_V];
    dx[X_PELVIS_V] = self->pelvis_a;
    if (self->phase != PHASE_SWING && self->phase != PHASE_FREE) return; /* both feet stand */
    const double side = self->swing == LEFT ? 1.0 : -1.0, pull = pull_force(self, vars, t);
    contact_force(self, vars, x, force, &clearance);
    leg_terms(x, side * vars[V_slope], self->pelvis_a, &terms);
    leg_forces(self->torque, force[0] - vars[V_pull_back] * pull, side * force[1] + pull, x, general);
    const double a = general[0] - terms.bias[0], b = general[1] - terms.bias[1];
    const double det = terms.m11 * terms.m22 - terms.m12 * terms.m12;
    for (int i = 0; i < 3; i++) dx[i] = x[L_PITCH_RATE + i];
    dx[L_PITCH_RATE] = (terms.m22 * a - terms.m12 * b) / det;
    dx[L_SHANK_RATE] = (terms.m11 * b - terms.m12 * a) / det;
    dx[L_ROLL_RATE] = (general[2] - terms.bias[2]) / terms.roll;
}

static void advance(Plant *self, const double *vars) {
    const double t = now(self, vars), h = vars[V_dt];
    double k[4][X_SIZE], y[X_SIZE], force[2], clearance;
    if (self->step % steps_in(vars, TICK) == 0) {
        double draw[TICK_DRAWS]; /* a fixed number, whatever happens */
        for (int i = 0; i < TICK_DRAWS; i++) draw[i] = stream_normal(&self->process);
        for (int i = 0; i < 3; i++)
            self->noise[i] += -self->noise[i] * TICK / 0.02 + vars[V_torque_noise] * sqrt(2.0 * TICK / 0.02) * draw[i];
        human_tick(self, vars, t, TICK, draw[3]);
        gait_tick(self, vars, t, draw);
        gait_torques(self, vars, t);
    }
    for (int stage = 0; stage < 4; stage++) {
        const double part = stage == 0 ? 0.0 : stage == 3 ? h : 0.5 * h;
        for (int i = 0; i < X_SIZE; i++) y[i] = self->x[i] + (stage ? part * k[stage - 1][i] : 0.0);
        rhs(self, vars, t + part, y, k[stage]);
    }
    for (int i = 0; i < X_SIZE; i++) self->x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    self->step++;
    const double f = contact_force(self, vars, self->x, force, &clearance);
    self->peak = fmax(self->peak, f);
    self->held = f > vars[V_contact_limit_quasi_static] ? self->held + h : 0.0;
    self->held_longest = fmax(self->held_longest, self->held);
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars, now(self, vars));
}

static void publish(Plant *self, double *vars) {
    const double t = now(self, vars), *x = self->x;
    double force[2], clearance, drift = 0.0;
    sensors_publish(self, vars, t);
    const Foot is = foot_now(self, vars, self->swing), should = foot_planned(self, self->swing, t);
    for (int i = 0; i < 3; i++) drift += (is.p[i] - should.p[i]) * (is.p[i] - should.p[i]);
    drift = self->phase == PHASE_SWING ? sqrt(drift) : 0.0;
    self->drift = fmax(self->drift, drift);
    vars[V_contact_force] = contact_force(self, vars, x, force, &clearance);
    vars[V_contact_force_peak] = self->peak;
    vars[V_contact_held] = self->held_longest;
    vars[V_clearance] = clearance;
    vars[V_drift] = drift;
    vars[V_drift_peak] = self->drift;
    vars[V_pelvis_x] = x[X_PELVIS];
    vars[V_pelvis_speed] = x[X_PELVIS_V];
    vars[V_foot_x] = is.p[0], vars[V_foot_y] = is.p[1], vars[V_foot_lift] = is.p[2], vars[V_foot_speed] = is.v[0];
    vars[V_human_y] = self->human_y + self->sway;
    /* The capture point from the foremost toes; positive: a step is needed. */
    const double front = fmax(self->placed[0][0], self->placed[1][0]) + SOLE_TOE + SOLE_HALF;
    vars[V_capture_excess] = x[X_PELVIS] + x[X_PELVIS_V] / CAPTURE_RATE - front;
    vars[V_leg_energy] = leg_energy(x, vars[V_slope] * (self->swing == LEFT ? 1.0 : -1.0));
    for (int i = 0; i < 3; i++) vars[V_joint_torque + i] = self->torque[i];
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.002 s or a whole fraction of it", vars[V_dt]);
    if (steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    const double oldest = fmax(vars[V_latency], vars[V_camera_latency]);
    if (oldest > vars[V_sensor_period] * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 63 sensor periods", oldest);
    const double stride = vars[V_step_length], reach = THIGH_LENGTH + SHANK_LENGTH, h = vars[V_hip_height];
    if (!(h * h + stride * stride < reach * reach))
        return fail(self, PLANT_ERROR, "step_length = %g m is out of the leg's reach at this hip_height", stride);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    human_start(self, vars);
    gait_start(self, vars);
    sensors_sample(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - now(self, vars)) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_shorten_step; i <= V_announce; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    if (!isfinite(self->x[L_PITCH]) || !isfinite(self->x[L_ROLL]))
        return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
