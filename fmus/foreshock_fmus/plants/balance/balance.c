/* The balance plant: a humanoid of TALOS's size in the frontal plane, on feet that can slip. README.md has the equations. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "model.h"

#define TICK 0.002 /* s, period of the robot's balance controller */

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
    const double *x = self->x, t = now(self, vars), sign = vars[V_first_support], w = dcm_rate();
    const double single = vars[V_single_support], period = single + vars[V_double_support];
    double discard[X_SIZE], fall[T_SIZE], y = com_of(x), v = com_rate_of(x);
    Contact contact = {0};
    if (self->stage == STAGE_STANDING) standing_rhs(self, vars, x, discard, &contact);
    else fall_rhs(self, vars, self->fall, fall, &contact);
    if (self->stage == STAGE_DOWN) contact = (Contact){.cop = self->fall_edge, .low = self->fall_edge, .high = self->fall_edge};
    sensors_publish(self, vars, t);
    long long number = (long long)floor(t / period + 1e-6);
    double half_sign = (number % 2 == 0 ? 1.0 : -1.0) * sign * self->gait_amplitude;
    const double u = t - (double)number * period, rest = TALOS_HALF_STANCE - vars[V_cop_inset];
    Reference r = gait_reference(w, rest, single, vars[V_double_support], u);
    vars[V_com_ref_x] = 0.0056868;
    vars[V_com_ref_y] = half_sign * r.com;
    vars[V_com_ref_z] = TALOS_COM_HEIGHT;
    vars[V_support_left] = self->left_down;
    vars[V_support_right] = self->right_down;
    vars[V_com_y] = y;
    vars[V_com_vy] = v;
    vars[V_xi_y] = y + v / w;
    vars[V_zmp_y] = contact.cop;
    vars[V_support_min_y] = contact.low;
    vars[V_support_max_y] = contact.high;
    vars[V_foot_left_y] = x[X_YL];
    vars[V_foot_right_y] = x[X_YR];
    vars[V_slip_left] = self->slip[0];
    vars[V_slip_right] = self->slip[1];
    vars[V_com_deviation] = y - 0.5 * (x[X_YL] + x[X_YR]) - vars[V_com_ref_y];
    vars[V_torso_roll] = x[X_ROLL];
    vars[V_torso_rate] = x[X_RATE];
    vars[V_hip_moment] = contact.hip;
    vars[V_friction_left] = contact.force_left;
    vars[V_friction_right] = contact.force_right;
    vars[V_load_left] = self->stage == STAGE_STANDING ? contact.share * WEIGHT : self->left_down ? contact.load : 0.0;
    vars[V_load_right] = self->stage == STAGE_STANDING ? (1.0 - contact.share) * WEIGHT : self->right_down ? contact.load : 0.0;
    vars[V_arm_left] = x[X_AL];
    vars[V_arm_right] = x[X_AR];
    vars[V_tilt] = self->stage == STAGE_STANDING ? 0.0 : self->fall_side * (self->fall[T_TURN] - self->fall_start);
    vars[V_contact_force] = contact.human_force;
    vars[V_contact_force_peak] = self->contact_peak;
    vars[V_contact_limit] = 2.0 * vars[V_contact_limit_quasi_static];
    vars[V_human_true_y] = self->stage == STAGE_STANDING ? vars[V_human_place_y] : self->fall_side * self->fall[T_HUMAN];
    vars[V_tipping] = self->stage != STAGE_STANDING;
    vars[V_upright] = self->stage == STAGE_STANDING;
    vars[V_fallen] = self->fallen;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= 0.002) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.002 s or a whole fraction of it", vars[V_dt]);
    if (fabs(vars[V_first_support]) != 1.0)
        return fail(self, PLANT_ERROR, "first_support = %g; expected 1 (left) or -1 (right)", vars[V_first_support]);
    if (steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    if (steps_in(vars, vars[V_single_support]) < 0 || steps_in(vars, vars[V_double_support]) < 0)
        return fail(self, PLANT_ERROR, "single_support = %g s, or double_support; expected multiples of dt",
                    vars[V_single_support]);
    if (vars[V_latency] > vars[V_sensor_period] * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 63 sensor periods", vars[V_latency]);
    if (vars[V_delay] > TICK * (DELAY_SIZE - 1))
        return fail(self, PLANT_ERROR, "delay = %g s; expected at most 0.51 s", vars[V_delay]);
    const double sign = vars[V_first_support], a = TALOS_HALF_STANCE, w = dcm_rate();
    const int stepping = vars[V_stepping] > 0.5;
    Reference r = gait_reference(w, a - vars[V_cop_inset], vars[V_single_support], vars[V_double_support], 0.0);
    double *x = self->x, y = stepping ? sign * r.com : 0.0, v = stepping ? sign * w * (r.dcm - r.com) : 0.0;
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    x[X_YL] = self->touchdown[0] = a, x[X_YR] = self->touchdown[1] = -a;
    x[X_Y] = y * TALOS_MASS / BODY_MASS, x[X_V] = v * TALOS_MASS / BODY_MASS;
    x[X_COP] = stepping ? sign * r.cop : 0.0;
    x[X_AL] = x[X_AR] = TALOS_ARM_START;
    self->estimate_v = v;
    self->cop_command = x[X_COP];
    self->gait_amplitude = stepping;
    self->left_down = !stepping || sign > 0.0, self->right_down = !stepping || sign < 0.0;
    self->mode = stepping ? MODE_STEPPING : MODE_BOTH;
    if (stepping) lift_plan(&self->lift[sign > 0.0], 0.0, 0.4 * vars[V_single_support], vars[V_step_height]);
    for (int i = 0; i < DELAY_SIZE; i++) self->delay[i] = (Measurement){stepping ? sign * r.dcm : 0.0, y, 0.0, 0.0, 0.0};
    self->mu[0] = self->mu[1] = vars[V_mu];
    sensors_sample(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

static void disturb(Plant *self, const double *vars, double t) {
    const double tiny = 1e-6 * vars[V_dt];
    const int low = t >= vars[V_drop_time] - tiny && t < vars[V_drop_time] + vars[V_drop_duration] - tiny;
    const int foot = (int)vars[V_drop_foot]; /* 0 left, 1 right, 2 both */
    for (int i = 0; i < 2; i++) self->mu[i] = low && (foot == i || foot == 2) ? vars[V_drop_mu] : vars[V_mu];
    const int pushed = t >= vars[V_push_time] - tiny && t < vars[V_push_time] + vars[V_push_duration] - tiny;
    self->push = pushed ? vars[V_push_impulse] / vars[V_push_duration] : 0.0;
}

/* One step of the classical Runge-Kutta method of order 4 on n states. */
typedef void Rhs(const Plant *self, const double *vars, const double *x, double *dx, Contact *contact);

static void runge_kutta(const Plant *self, const double *vars, Rhs *rhs, double *x, int n, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    double k[X_SIZE] = {0}, probe[X_SIZE], sum[X_SIZE] = {0};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < n; i++) probe[i] = x[i] + at[stage] * h * k[i];
        rhs(self, vars, probe, k, 0);
        for (int i = 0; i < n; i++) sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < n; i++) x[i] += h * sum[i];
}

/* Return mapping: the bristle holds no more than friction can. */
static void return_mapping(Plant *self, const double *vars) {
    const double s0 = vars[V_friction_stiffness] * (1.0 + self->act[ACT_COMPLIANCE]);
    for (int i = 0; i < 2; i++) {
        double *z = &self->x[i ? X_ZR : X_ZL], most = self->mu[i] / s0;
        *z = *z > most ? most : *z < -most ? -most : *z;
    }
}

static void advance(Plant *self, const double *vars) {
    const double dt = vars[V_dt], t = now(self, vars);
    if (self->stage == STAGE_STANDING) {
        gait_tick(self, vars, t);
        disturb(self, vars, t);
    }
    if (self->step % steps_in(vars, TICK) == 0) control_tick(self, vars, t, TICK);
    if (self->stage == STAGE_STANDING) {
        runge_kutta(self, vars, standing_rhs, self->x, X_SIZE, dt);
        return_mapping(self, vars);
        for (int i = 0; i < 2; i++)
            if (i ? self->right_down : self->left_down) self->slip[i] = fabs(self->x[i ? X_YR : X_YL] - self->touchdown[i]);
        if (fall_begins(self, vars)) fall_start(self, vars, t + dt);
    } else if (self->stage == STAGE_TIPPING) {
        runge_kutta(self, vars, fall_rhs, self->fall, T_SIZE, dt);
        fall_after_step(self, vars);
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
    for (int i = V_step_suppression; i <= V_impact_mitigation; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    if (!isfinite(self->x[X_Y]) || !isfinite(self->x[X_ROLL]))
        return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
