/* The arm-strike plant: a humanoid that keeps its balance by swinging trunk and arms, a human in reach. See README.md. */
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
    const double *angle = self->x + X_ANGLE, *rate = self->x + X_RATE, t = now(self, vars);
    const Point com = chain_com(vars, angle, rate), hand = chain_hand(vars, angle, rate);
    sensors_publish(self, vars, t);
    task(self, vars, t, vars + V_plan_position, vars + V_plan_velocity);
    vars[V_com_x] = com.x;
    vars[V_com_vx] = com.vx;
    vars[V_cop_x] = -self->torque[ANKLE] / (chain_mass(vars) * GRAVITY);
    vars[V_torso_pitch] = angle[TRUNK];
    vars[V_torso_rate] = rate[TRUNK];
    for (int i = 0; i < LINKS; i++) vars[V_link_angle + i] = angle[i];
    for (int i = 0; i < JOINTS; i++) vars[V_torque + i] = self->torque[i];
    vars[V_momentum_wanted] = self->excess * chain_mass(vars) * GRAVITY;
    vars[V_hand_x] = hand.x;
    vars[V_hand_z] = hand.z;
    vars[V_hand_vx] = hand.vx;
    vars[V_human_true_x] = self->x[X_HUMAN];
    vars[V_separation] = self->x[X_HUMAN] - vars[V_human_depth] - hand.x;
    vars[V_contact_force] = contact_force(self, vars, self->x);
    vars[V_contact_force_peak] = self->force_peak;
    vars[V_strike_speed] = self->strike_speed;
    vars[V_contact_use] = self->use_peak;
    vars[V_energy] = chain_energy(vars, self->x);
    vars[V_tipping] = self->tipping;
    vars[V_fallen] = self->down;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= TICK) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.002 s or a whole fraction of it", vars[V_dt]);
    if (steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    if (vars[V_latency] > vars[V_sensor_period] * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 63 sensor periods", vars[V_latency]);
    if (vars[V_delay] > TICK * (DELAY_SIZE - 1))
        return fail(self, PLANT_ERROR, "delay = %g s; expected at most 0.126 s", vars[V_delay]);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    double plan[JOINTS], rate[JOINTS], *angle = self->x + X_ANGLE;
    task(self, vars, 0.0, plan, rate);
    for (int i = 0; i < LINKS; i++) angle[i] = (i ? angle[i - 1] : 0.0) + plan[i];
    for (int i = 0; i < LINKS; i++) angle[i] += vars[V_start_off] * (i == FORE);
    self->x[X_HUMAN] = vars[V_human_place_x];
    for (int k = 0; k < DELAY_SIZE; k++) memcpy(self->delay[k].angle, angle, sizeof self->delay[k].angle);
    for (int i = JOINTS - 1; i >= 0 && vars[V_passive] < 0.5; i--)
        self->torque[i] = (i + 1 < JOINTS ? self->torque[i + 1] : 0.0) - GRAVITY * first_moment(vars, i) * sin(angle[i]);
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
    const double dt = vars[V_dt], t = now(self, vars);
    if (self->step % steps_in(vars, TICK) == 0 && vars[V_passive] < 0.5) control_tick(self, vars, t);
    disturb(self, vars, t);
    if (!self->down) {
        runge_kutta(self, vars, dt);
        const double *angle = self->x + X_ANGLE, *rate = self->x + X_RATE, force = contact_force(self, vars, self->x);
        const Point com = chain_com(vars, angle, rate);
        const Point hand = chain_hand(vars, angle, rate);
        if (force > 0.0 && !self->touching) {
            self->touch_height = hand.z;
            if (self->force_peak == 0.0) self->strike_speed = hand.vx;
        }
        self->touching = force > 0.0;
        if (force > self->force_peak) self->force_peak = force;
        if (force / contact_limit(self, vars) > self->use_peak) self->use_peak = force / contact_limit(self, vars);
        if (vars[V_passive] < 0.5 && (com.x < -vars[V_fall_beyond] || com.x > vars[V_fall_beyond])) self->tipping = 1;
        if (self->tipping && (com.z < 0.7 * vars[V_com_height] || fabs(com.x) > 0.6)) {
            self->down = 1;
            memset(self->x + X_RATE, 0, LINKS * sizeof(double));
        }
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
    for (int i = V_soften_arms; i <= V_withdraw_arm; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0)) return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    for (int i = 0; i < X_SIZE; i++)
        if (!isfinite(self->x[i])) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
