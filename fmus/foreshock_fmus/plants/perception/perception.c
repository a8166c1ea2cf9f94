/* The perception plant: a robot that reaches for what it takes for a tool, beside a human's forearm. See README.md. */
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
    const Picture *p = network_newest(self, vars);
    const double *x = self->x;
    vars[V_sensor_time] = p->time;
    for (int i = 0; i < THINGS; i++) {
        const Found *f = &p->found[i];
        double *to = vars + (i == TOOL ? V_tool_seen : V_forearm_seen);
        to[0] = f->seen, to[1] = f->as_tool, to[2] = f->confidence;
        memcpy(to + 3, f->centre, sizeof f->centre);
    }
    vars[V_luminance] = p->luminance;
    vars[V_contrast] = p->contrast;
    vars[V_sharpness] = p->sharpness;
    vars[V_saturated] = p->saturated;
    vars[V_depth] = self->depth;
    vars[V_illumination] = self->illumination;
    vars[V_exposure] = self->exposure;
    vars[V_visibility] = self->image.visibility;
    vars[V_forearm_belief] = self->belief[FOREARM];
    vars[V_tool_belief] = self->belief[TOOL];
    vars[V_phase] = self->phase;
    vars[V_target] = self->target;
    vars[V_hand_x] = x[0], vars[V_hand_y] = x[1], vars[V_hand_z] = x[2];
    vars[V_hand_vz] = x[X_SPEED + 2];
    vars[V_forearm_true_x] = forearm_x(self, vars);
    vars[V_contact_force] = contact_force(self, vars, x);
    vars[V_contact_force_peak] = self->force_peak;
    vars[V_contact_time] = self->contact_time;
    vars[V_contact_load] = self->load_peak;
    double kinetic = 0.0;
    for (int k = 0; k < 3; k++) kinetic += 0.5 * vars[V_arm_mass] * x[X_SPEED + k] * x[X_SPEED + k];
    vars[V_energy] = kinetic + contact_energy(self, vars, x);
    vars[V_servo_work] = x[X_WORK];
    vars[V_heat] = x[X_HEAT];
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= TICK) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.002 s or a whole fraction of it", vars[V_dt]);
    if (vars[V_latency] > FRAME * (RING_SIZE - 1))
        return fail(self, PLANT_ERROR, "latency = %g s; expected at most 0.3 s", vars[V_latency]);
    if (vars[V_cause] != floor(vars[V_cause]))
        return fail(self, PLANT_ERROR, "cause = %g; expected 0, 1 or 2", vars[V_cause]);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    self->illumination = self->exposure = 1.0;
    self->belief[TOOL] = self->believed[TOOL] = 1;
    self->target = -1;
    self->place[TOOL][0] = vars[V_tool_x], self->place[TOOL][1] = vars[V_tool_y];
    self->place[FOREARM][0] = vars[V_forearm_x], self->place[FOREARM][1] = vars[V_forearm_y];
    self->x[0] = self->reference[0] = self->goal[0] = vars[V_home_x];
    self->x[2] = self->reference[2] = self->goal[2] = vars[V_hover];
    self->image = optics_image(self, vars);
    for (int i = 0; i < RING_SIZE; i++) network_frame(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

/* One step of the classical Runge-Kutta method of order 4. */
static void runge_kutta(Plant *self, const double *vars, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    double k[X_SIZE] = {0}, probe[X_SIZE], sum[X_SIZE] = {0};
    for (int stage = 0; stage < 4; stage++) {
        for (int i = 0; i < X_SIZE; i++) probe[i] = self->x[i] + at[stage] * h * k[i];
        arm_rhs(self, vars, probe, k);
        for (int i = 0; i < X_SIZE; i++) sum[i] += weight[stage] * k[i];
    }
    for (int i = 0; i < X_SIZE; i++) self->x[i] += h * sum[i];
}

/* ISO/TS 15066: contact is transient for half a second; then the quasi-static limit holds. */
static void judge(Plant *self, const double *vars) {
    const double force = contact_force(self, vars, self->x);
    self->contact_time = force > 0.0 ? self->contact_time + vars[V_dt] : 0.0;
    const double limit = body_forearm.limit * (self->contact_time <= 0.5 ? body_forearm.transient : 1.0);
    self->force_peak = fmax(self->force_peak, force);
    self->load_peak = fmax(self->load_peak, force / limit);
}

static void advance(Plant *self, const double *vars) {
    const double t = now(self, vars);
    if (self->step % steps_in(vars, FRAME) == 0) {
        optics_frame(self, vars, t);
        human_frame(self, vars);
        network_frame(self, vars, t);
        planner_frame(self, vars);
    }
    if (self->step % steps_in(vars, TICK) == 0) planner_tick(self, vars);
    runge_kutta(self, vars, vars[V_dt]);
    self->step++;
    judge(self, vars);
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - now(self, vars)) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_slow_approach; i <= V_speed_scale; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0)) return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    for (int i = 0; i < X_SIZE; i++)
        if (!isfinite(self->x[i])) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
