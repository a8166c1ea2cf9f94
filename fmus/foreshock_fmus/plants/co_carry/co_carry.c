/* The co-carry plant: a robot and a partner walk with a box between them. README.md has the equations. */
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

static void publish(Plant *self, double *vars) {
    const long long behind = (long long)floor(vars[V_latency] / vars[V_sensor_period] + 0.5);
    const long long at = self->frames - 1 > behind ? self->frames - 1 - behind : 0;
    memcpy(vars + V_sensor_time, self->frame[at % FRAMES], sizeof self->frame[0]);
    const Carrier *robot = &self->carrier[ROBOT], *partner = &self->carrier[PARTNER];
    vars[V_leg_force] = self->leg;
    vars[V_leg_force_peak] = self->leg_peak;
    vars[V_robot_lost] = robot->lost;
    vars[V_partner_lost] = partner->lost;
    vars[V_tilt] = self->tilt;
    vars[V_content] = self->content;
    vars[V_robot_force] = robot->force;
    vars[V_partner_force] = partner->force;
    vars[V_floor_force] = self->floor[ROBOT] + self->floor[PARTNER];
    vars[V_grip_force] = self->grip;
    vars[V_slip] = self->slip;
    vars[V_lag] = remainder(partner->phase - robot->phase, TURN);
    vars[V_robot_end_z] = end_z(self, vars, ROBOT);
    vars[V_partner_end_z] = end_z(self, vars, PARTNER);
    vars[V_vertical_momentum] = vars[V_box_mass] * self->vz +
        vars[V_content_mass] * (self->vz + self->content_v * self->tilt + self->content * self->rate);
    vars[V_energy] = load_energy(self, vars);
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0) || steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    if (vars[V_latency] > (FRAMES - 1) * vars[V_sensor_period])
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 15 sensor periods", vars[V_latency]);
    if (vars[V_partner_reaction] > (PAST - 1) * vars[V_dt])
        return fail(self, PLANT_ERROR, "partner_reaction = %g s; expected less than 1023 dt", vars[V_partner_reaction]);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    const double half = 0.5 * (vars[V_box_mass] + vars[V_content_mass]) * GRAVITY;
    carriers_init(self, vars);
    self->z = vars[V_carry_height];
    self->content = vars[V_content_start];
    self->normal = vars[V_content_mass] * GRAVITY;
    self->carrier[ROBOT].force = self->carrier[PARTNER].force = self->mean = half;
    self->command = self->grip = vars[V_grip_margin] * half / (2.0 * vars[V_grip_friction]);
    sensors_sample(self, vars);
    publish(self, vars);
    return PLANT_OK;
}

static void advance(Plant *self, const double *vars) {
    const double dt = vars[V_dt], t = (double)self->step * dt;
    for (int i = 0; i < ACTS; i++) { /* an intervention takes hold within 50 ms */
        self->act[i] += clip(vars[V_slow_approach + i] - self->act[i], -dt / 0.05, dt / 0.05);
        self->past[i][self->step % PAST] = self->act[i];
    }
    carriers_tick(self, vars, t, dt);
    grip_tick(self, vars, dt);
    load_tick(self, vars, dt);
    self->step++;
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars);
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - (double)self->step * vars[V_dt]) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_slow_approach; i <= V_regrasp; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0)) return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    if (!isfinite(self->z + self->tilt + self->content)) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
