/* The actuator-chain plant: a joint that carries a payload over a hand, its drive, supply and control. See README.md. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model.h"

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

static void publish(Plant *self, double *vars) {
    const double *x = self->x, t = now(self, vars);
    sensors_publish(self, vars, t);
    vars[V_angle] = x[X_ARM];
    vars[V_angle_rate] = x[X_ARM_RATE];
    vars[V_motor_angle] = x[X_MOTOR];
    vars[V_motor_rate] = x[X_MOTOR_RATE];
    vars[V_due_angle] = self->due.angle;
    vars[V_drive_torque] = joint_torque(vars, self->current);
    vars[V_torque_limit] = joint_torque(vars, current_limit(vars, x));
    vars[V_volts] = x[X_VOLTS];
    vars[V_heat] = x[X_HEAT];
    vars[V_loop_latency] = self->round_trip;
    vars[V_gap] = vars[V_arm_length] * sin(x[X_ARM]) - vars[V_hand_height] - self->hand_off;
    vars[V_contact_force] = contact_force(self, vars, x);
    vars[V_contact_force_peak] = self->force_peak;
    vars[V_contact_limit] = body_hand.limit;
    vars[V_energy] = chain_energy(self, vars, x);
    vars[V_braked] = self->braked;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= CYCLE) || steps_in(vars, CYCLE) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected a whole fraction of 0.005 s", vars[V_dt]);
    if (steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    if (vars[V_latency] > vars[V_sensor_period] * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 63 sensor periods", vars[V_latency]);
    if (!(vars[V_volts_least] < vars[V_volts_fold] && vars[V_heat_fold] < vars[V_heat_most]))
        return fail(self, PLANT_ERROR, "volts_least must be below volts_fold (%g V), heat_fold below heat_most", vars[V_volts_fold]);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    self->pace = vars[V_passive] < 0.5;
    plan(self, vars, vars[V_dt]);
    self->phase = 0.0;
    double *x = self->x;
    const double load = vars[V_passive] < 0.5 ? weight_torque(vars, vars[V_angle_low]) : 0.0;
    x[X_ARM] = vars[V_angle_low];
    x[X_MOTOR] = vars[V_angle_low] + load / vars[V_gear_stiffness] + 0.5 * vars[V_backlash];
    self->wanted = load;
    self->current = load / vars[V_torque_per_ampere];
    x[X_VOLTS] = vars[V_supply] - vars[V_supply_resistance] * vars[V_rest_current];
    x[X_HEAT] = vars[V_heat_start];
    for (int i = 0; i < DELAY_SIZE; i++) self->measured[i][0] = x[X_MOTOR];
    sensors_sample(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

/* One step of the classical Runge-Kutta method of order 4. */
static void runge_kutta(Plant *self, const double *vars, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    double k[X_SIZE] = {0}, probe[X_SIZE], sum[X_SIZE] = {0};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < X_SIZE; i++) probe[i] = self->x[i] + at[stage] * h * k[i];
        chain_rhs(self, vars, probe, k);
        for (int i = 0; i < X_SIZE; i++) sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < X_SIZE; i++) self->x[i] += h * sum[i];
}

static void advance(Plant *self, const double *vars) {
    if (self->step % steps_in(vars, CYCLE) == 0 && vars[V_passive] < 0.5) control_cycle(self, vars);
    runge_kutta(self, vars, vars[V_dt]);
    if (self->braked) brake_slip(self, vars);
    const double force = contact_force(self, vars, self->x);
    if (force > self->force_peak) self->force_peak = force;
    self->step++;
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars, now(self, vars));
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - now(self, vars)) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_derate; i <= V_brake_joints; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0)) return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    for (int i = 0; i < X_SIZE; i++)
        if (!isfinite(self->x[i])) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
