/* The grasp plant: a gripper that carries an object which gets heavier. README.md has the equations. */
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
    double n = time_s / vars[V_dt], whole = floor(n + 0.5);
    return whole >= 1.0 && fabs(n - whole) < 1e-6 * (1.0 + n) ? (long long)whole : -1;
}

static double now(const Plant *self, const double *vars) { return (double)self->step * vars[V_dt]; }

static void publish(Plant *self, double *vars) {
    const double *x = self->x, t = now(self, vars);
    double dx[X_SIZE];
    Forces f = {0};
    held_rhs(self, vars, t, x, dx, &f);
    const int held = self->stage == STAGE_HELD;
    sensors_publish(self, vars, t);
    vars[V_force_command] = self->force_command;
    vars[V_mass_planned] = held ? vars[V_mass_assumed] : 0.0;
    vars[V_height_command] = vars[V_drop_height] - x[X_LOWERED];
    vars[V_speed_command] = -x[X_LOWER_RATE];
    vars[V_true_mass] = mass_at(vars, t);
    vars[V_true_tangential] = held ? f.tangential : 0.0;
    vars[V_true_normal] = x[X_NORMAL];
    vars[V_friction_use] = held ? f.use : 0.0;
    vars[V_slide] = x[X_SLIDE];
    vars[V_slide_rate] = x[X_SLIDE_RATE];
    vars[V_wrist_angle] = x[X_WRIST];
    vars[V_wrist_rate] = x[X_WRIST_RATE];
    vars[V_tilt] = x[X_TILT];
    vars[V_com_rate] = held ? com_rate(vars, t, x) : self->fall_rate;
    vars[V_support_force] = f.support;
    vars[V_hand_acceleration] = self->hand;
    vars[V_heat] = x[X_HEAT];
    vars[V_released] = !held;
    vars[V_landed] = self->landed;
    vars[V_fall_distance] = held ? 0.0 : self->fall_start - self->fall_height;
    vars[V_impact_force] = falling_force(self, vars);
    vars[V_impact_force_peak] = self->peak;
    vars[V_impact_over] = self->stage == STAGE_DOWN;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= 0.001) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.001 s or a whole fraction of it", vars[V_dt]);
    if (steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    if (vars[V_latency] > vars[V_sensor_period] * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 63 sensor periods", vars[V_latency]);
    if (vars[V_wrist_delay] > TICK * (DELAY_SIZE - 1))
        return fail(self, PLANT_ERROR, "wrist_delay = %g s; expected at most 0.063 s", vars[V_wrist_delay]);
    const double weight = vars[V_mass] * GRAVITY, force = vars[V_grip_force], moment = weight * vars[V_offset_x];
    const double limit = 2.0 * vars[V_mu] * force;
    if (hypot(weight / limit, moment / (limit * vars[V_pad_radius])) >= 1.0)
        return fail(self, PLANT_ERROR, "grip_force = %g N cannot hold the object even at rest", force);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    double *x = self->x;
    x[X_SHEAR] = weight / vars[V_pad_stiffness];
    x[X_TWIST] = -moment / (vars[V_pad_stiffness] * vars[V_pad_radius] * vars[V_pad_radius]);
    x[X_TORQUE] = self->torque_command = weight * vars[V_wrist_lever] + moment;
    x[X_NORMAL] = self->force_command = force;
    x[X_HEAT] = force * force / (vars[V_force_continuous] * vars[V_force_continuous]);
    self->footfall_peak = 1.0;
    sensors_sample(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

/* One step of the classical Runge-Kutta method of order 4. */
static void runge_kutta(const Plant *self, const double *vars, double t, double *x, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    double k[X_SIZE] = {0}, probe[X_SIZE], sum[X_SIZE] = {0};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < X_SIZE; i++) probe[i] = x[i] + at[stage] * h * k[i];
        held_rhs(self, vars, t + at[stage] * h, probe, k, 0);
        for (int i = 0; i < X_SIZE; i++) sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < X_SIZE; i++) x[i] += h * sum[i];
}

/* The object has slid out of the pads: from here it falls. Over the support that is less deep than onto the foot. */
static void release(Plant *self, const double *vars, double t) {
    const double *x = self->x;
    self->stage = STAGE_FALLING;
    self->fall_mass = mass_at(vars, t);
    const double floor_below = x[X_LOWERED] > 0.02 ? vars[V_support_below] : vars[V_drop_height];
    self->fall_start = floor_below - x[X_LOWERED] - x[X_SLIDE];
    self->fall_height = self->fall_start;
    self->fall_rate = -x[X_SLIDE_RATE] - x[X_LOWER_RATE];
}

/* The gripper goes on alone: what held the object up is gone. */
static void empty_step(Plant *self, const double *vars) {
    double *x = self->x, dt = vars[V_dt];
    x[X_TORQUE] += dt * (self->torque_command - x[X_TORQUE]) / vars[V_wrist_lag];
    x[X_WRIST_RATE] += dt * (x[X_TORQUE] + self->tremor) / vars[V_wrist_inertia];
    x[X_WRIST] += dt * x[X_WRIST_RATE];
    x[X_NORMAL] += dt * (self->force_command - x[X_NORMAL]) / vars[V_grip_lag];
}

static void advance(Plant *self, const double *vars) {
    const double dt = vars[V_dt], t = now(self, vars);
    if (self->step % steps_in(vars, TICK) == 0) control_tick(self, vars, t);
    if (self->stage == STAGE_HELD) {
        runge_kutta(self, vars, t, self->x, dt);
        return_mapping(self, vars);
        double dx[X_SIZE];
        Forces f;
        held_rhs(self, vars, t + dt, self->x, dx, &f);
        if (f.support > 0.9 * f.mass * GRAVITY) self->landed = 1;
        if (self->x[X_SLIDE] > vars[V_pad_length] && !self->landed) release(self, vars, t + dt);
    } else {
        empty_step(self, vars);
        if (self->stage == STAGE_FALLING) falling_step(self, vars);
    }
    self->step++;
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars, now(self, vars));
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - now(self, vars)) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_regrasp; i <= V_slow; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    for (int i = 0; i < X_SIZE; i++)
        if (!isfinite(self->x[i])) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
