/* The tool_in_hand plant: a grinder in a compliant hand beside a human. README.md has the equations. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model.h"

#define ROUGH_TIME 0.05 /* s */
#define SWAY_TIME 1.0   /* s */

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
    const double *x = self->x, t = now(self, vars), half = 0.5 * self->angle_set;
    double dx[X_SIZE];
    Forces f;
    rhs(self, vars, t, x, dx, &f);
    sensors_publish(self, vars, t);
    vars[V_tip_command] = WRIST_X + self->set_point + vars[V_length] * cos(self->angle_set);
    vars[V_tip_command + 1] = vars[V_length] * sin(self->angle_set);
    vars[V_tip_command + 2] = WRIST_Z;
    vars[V_angle_command] = vars[V_angle_command + 1] = 0.0;
    vars[V_angle_command + 2] = sin(half);
    vars[V_angle_command + 3] = cos(half);
    vars[V_rate_command] = self->angle_set_rate;
    vars[V_depth] = f.depth;
    vars[V_advance] = x[X_ADVANCE];
    vars[V_advance_rate] = x[X_ADVANCE_RATE];
    vars[V_angle] = x[X_ANGLE];
    vars[V_angle_rate] = x[X_ANGLE_RATE];
    vars[V_normal_force] = f.normal;
    vars[V_tangential_force] = f.tangential;
    vars[V_true_wrist_torque] = f.wrist;
    vars[V_spindle_torque_now] = f.motor;
    vars[V_spindle_rate] = x[X_SPINDLE];
    vars[V_wear] = wear_at(vars, t);
    vars[V_overload] = self->overload;
    vars[V_faulted] = self->faulted;
    vars[V_off_edge] = f.off_edge;
    vars[V_gap] = forearm_gap(self, vars, x);
    vars[V_human_rate] = x[X_HUMAN_RATE];
    vars[V_human_force] = f.human;
    vars[V_human_force_peak] = self->peak;
    vars[V_cut_speed] = self->cut_speed;
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
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    double *x = self->x; /* near equilibrium, small angles */
    self->feed = self->set_point = vars[V_feed];
    const double k = vars[V_contact_stiffness], ka = vars[V_stiffness];
    x[X_ADVANCE] = ka * self->feed / (ka + k);
    const double normal = k * x[X_ADVANCE];
    self->forward = vars[V_length] * (vars[V_cutting_ratio] - vars[V_coupling]) * normal;
    x[X_SPINDLE] = vars[V_spindle_speed];
    x[X_INTEGRAL] = vars[V_disc_radius] * vars[V_cutting_ratio] * normal * vars[V_spindle_reset] / vars[V_spindle_gain];
    sensors_sample(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

static double clip(double x, double most) { return x > most ? most : x < -most ? -most : x; }

/* Once a tick: process noise (always as many draws), strengths, set points, the wrist drive's overload. */
static void tick(Plant *self, const double *vars, double t) {
    double keep = exp(-TICK / ROUGH_TIME);
    self->rough = keep * self->rough + vars[V_roughness] * sqrt(1.0 - keep * keep) * stream_normal(&self->process);
    keep = exp(-TICK / SWAY_TIME);
    self->sway = keep * self->sway + vars[V_human_sway] * sqrt(1.0 - keep * keep) * stream_normal(&self->process);
    const double wanted[ACT_SIZE] = {vars[V_hold], vars[V_tool_off], vars[V_reorient], vars[V_slow]};
    for (int i = 0; i < ACT_SIZE; i++)
        self->act[i] += clip(wanted[i] - self->act[i], TICK / vars[wanted[i] > self->act[i] ? V_act_rise : V_act_release]);

    /* without feed the disc grinds itself free; fed again, the set point returns as slowly */
    const double feed = vars[V_feed] * (1.0 - self->act[ACT_HOLD]) * (1.0 - 0.5 * self->act[ACT_SLOW]);
    self->feed += TICK / vars[V_feed_time] * (feed - self->feed);
    /* the moment of a sharp disc at the planned feed is known and fed forward */
    const double planned = vars[V_stiffness] * vars[V_contact_stiffness] / (vars[V_stiffness] + vars[V_contact_stiffness]);
    const double away = self->act[ACT_REORIENT], lag = TICK / vars[V_reorient_time];
    const double to = away > 0.0 ? (1.0 - away) * self->feed - away * vars[V_retract] : self->feed;
    self->set_point += lag * (to - self->set_point);
    const double turned = lag * (-away * vars[V_reorient_angle] - self->angle_set);
    self->angle_set += turned;
    self->angle_set_rate = turned / TICK;
    const double pressed = self->set_point > 0.0 ? planned * self->set_point : 0.0;
    self->forward = vars[V_length] * (vars[V_cutting_ratio] - vars[V_coupling]) * pressed;

    double dx[X_SIZE];
    Forces f;
    rhs(self, vars, t, self->x, dx, &f);
    const double use = f.wrist / vars[V_wrist_continuous]; /* I2t protection */
    self->overload = fmax(0.0, self->overload + TICK * (use * use - 1.0));
    if (self->overload > vars[V_trip_time]) self->faulted = 1;
}

/* One step of the classical Runge-Kutta method of order 4. */
static void runge_kutta(const Plant *self, const double *vars, double t, double *x, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    double k[X_SIZE] = {0}, probe[X_SIZE], sum[X_SIZE] = {0};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < X_SIZE; i++) probe[i] = x[i] + at[stage] * h * k[i];
        rhs(self, vars, t + at[stage] * h, probe, k, 0);
        for (int i = 0; i < X_SIZE; i++) sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < X_SIZE; i++) x[i] += h * sum[i];
    if (x[X_SPINDLE] < 0.0) x[X_SPINDLE] = 0.0; /* a one-way gear: the disc does not turn back */
}

static void advance(Plant *self, const double *vars) {
    const double t = now(self, vars);
    if (self->step % steps_in(vars, TICK) == 0) tick(self, vars, t);
    runge_kutta(self, vars, t, self->x, vars[V_dt]);
    double dx[X_SIZE];
    Forces f;
    rhs(self, vars, t + vars[V_dt], self->x, dx, &f);
    if (f.human > self->peak) self->peak = f.human;
    if (f.human > 1.0 && self->x[X_SPINDLE] * vars[V_disc_radius] > self->cut_speed)
        self->cut_speed = self->x[X_SPINDLE] * vars[V_disc_radius];
    self->step++;
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars, now(self, vars));
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - now(self, vars)) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_hold; i <= V_slow; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    for (int i = 0; i < X_SIZE; i++)
        if (!isfinite(self->x[i])) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
