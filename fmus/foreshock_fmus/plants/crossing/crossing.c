/* The crossing plant: a biped and a human walk on crossing paths, a rack between them. README.md has the equations. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model.h"

#define TICK 0.01 /* s, period of decisions and of process noise */

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

static void rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]) {
    double robot[2], human[2], n[2], closing;
    const double force = contact_force(vars, x, n, &closing);
    robot_wish(self, vars, x, robot);
    human_wish(self, vars, x, human);
    for (int i = 0; i < 2; i++) {
        dx[X_RX + i] = x[X_RVX + i], dx[X_HX + i] = x[X_HVX + i];
        dx[X_RVX + i] = robot[i] - force * n[i] / vars[V_robot_mass];
        dx[X_HVX + i] = human[i] + force * n[i] / vars[V_human_mass];
    }
}

static void advance(Plant *self, const double *vars) {
    const double t = now(self, vars), h = vars[V_dt];
    double k[4][X_SIZE], y[X_SIZE], n[2], closing;
    if (self->step % steps_in(vars, TICK) == 0) {
        robot_tick(self, vars, t, TICK);
        human_tick(self, vars, t, TICK);
    }
    for (int stage = 0; stage < 4; stage++) {
        const double part = stage == 0 ? 0.0 : stage == 3 ? h : 0.5 * h;
        for (int i = 0; i < X_SIZE; i++) y[i] = self->x[i] + (stage ? part * k[stage - 1][i] : 0.0);
        rhs(self, vars, y, k[stage]);
    }
    for (int i = 0; i < X_SIZE; i++) self->x[i] += h / 6.0 * (k[0][i] + 2.0 * k[1][i] + 2.0 * k[2][i] + k[3][i]);
    self->step++;
    const double force = contact_force(vars, self->x, n, &closing);
    if (force > 0.0 && self->peak == 0.0) self->contact_speed = closing;
    self->peak = fmax(self->peak, force);
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars, now(self, vars));
}

static void publish(Plant *self, double *vars) {
    const double *x = self->x;
    double n[2], closing;
    sensors_publish(self, vars, now(self, vars));
    vars[V_contact_force] = contact_force(vars, x, n, &closing);
    vars[V_contact_force_peak] = self->peak;
    vars[V_contact_speed] = self->contact_speed;
    vars[V_closing_speed] = closing;
    vars[V_gap] = hypot(x[X_HX] - x[X_RX], x[X_HY] - x[X_RY]) - vars[V_robot_radius] - vars[V_human_radius];
    vars[V_robot_true_x] = x[X_RX], vars[V_robot_true_y] = x[X_RY], vars[V_robot_true_speed] = x[X_RVX];
    vars[V_human_true_x] = x[X_HX], vars[V_human_true_y] = x[X_HY];
    vars[V_human_true_vx] = x[X_HVX], vars[V_human_true_vy] = x[X_HVY];
    vars[V_robot_true_vy] = x[X_RVY];
    vars[V_visible] = sight_share(vars, x[X_RX], x[X_RY], x[X_HX], x[X_HY]);
    vars[V_human_aware] = self->aware;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.01 s or a whole fraction of it", vars[V_dt]);
    if (steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    const double oldest = fmax(vars[V_latency], vars[V_camera_latency]);
    if (oldest > vars[V_sensor_period] * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 63 sensor periods", oldest);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    robot_start(self, vars);
    human_start(self, vars);
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
    for (int i = V_slow_approach; i <= V_announce; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    if (!isfinite(self->x[X_RX]) || !isfinite(self->x[X_HX]))
        return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
