/* The handover plant: robot gripper, object and a partner's hand on one line. README.md has the equations. */
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
    vars[V_pinch_force] = self->pinch;
    vars[V_pinch_ratio] = self->pinch_ratio;
    vars[V_dropped] = self->dropped;
    vars[V_handed_over] = (double)self->handed_over;
    vars[V_robot_x] = self->x_r;
    vars[V_object_x] = self->x_o;
    vars[V_hand_x] = self->x_h;
    vars[V_finger_depth] = finger_depth(self);
    vars[V_pull] = self->pull + self->finger_pull;
    vars[V_effort] = self->effort;
    vars[V_grip_force] = self->normal;
    vars[V_slip] = self->x_o - self->x_r;
    vars[V_arm_force] = self->arm;
    vars[V_momentum] = vars[V_object_mass] * self->v_o + vars[V_hand_mass] * self->v_h;
    vars[V_holding] = self->hold > 0.0 && !self->dropped;
}

static void begin_cycle(Plant *self, const double *vars) {
    self->t = 0.0;
    robot_cycle(self);
    partner_cycle(self, vars);
    self->weight = vars[V_object_mass] * GRAVITY;
    self->load_filtered = self->weight;
    self->command = vars[V_grip_base] + vars[V_grip_gain] * self->weight;
    self->gap = vars[V_object_width] - self->command / vars[V_pad_stiffness];
    self->motor = self->gap - self->command / vars[V_finger_stiffness];
    for (int i = 0; i < RING; i++) self->grip.value[i] = self->command, self->wrench.value[i] = 0.0;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0) || steps_in(vars, vars[V_sensor_period]) < 0)
        return fail(self, PLANT_ERROR, "sensor_period = %g s; expected a multiple of dt", vars[V_sensor_period]);
    if (steps_in(vars, vars[V_cycle]) < 0) return fail(self, PLANT_ERROR, "cycle = %g s; expected a multiple of dt", vars[V_cycle]);
    if (vars[V_latency] > (FRAMES - 1) * vars[V_sensor_period])
        return fail(self, PLANT_ERROR, "latency = %g s; expected less than 15 sensor periods", vars[V_latency]);
    if (fmax(vars[V_wrench_delay], vars[V_grip_delay]) > (RING - 1) * vars[V_dt])
        return fail(self, PLANT_ERROR, "wrench_delay or grip_delay = %g s; expected less than 255 dt", fmax(vars[V_wrench_delay], vars[V_grip_delay]));
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    begin_cycle(self, vars);
    contact_tick(self, vars, 0.0);
    sensors_sample(self, vars);
    publish(self, vars);
    return PLANT_OK;
}

static void advance(Plant *self, const double *vars) {
    const double dt = vars[V_dt];
    for (int i = 0; i < 3; i++) /* an intervention takes hold within 50 ms */
        self->act[i] += clip(vars[V_hold + i] - self->act[i], -dt / 0.05, dt / 0.05);
    contact_tick(self, vars, dt);
    partner_tick(self, vars, dt);
    robot_tick(self, vars, dt);
    self->step++;
    self->t += dt;
    if (self->step % steps_in(vars, vars[V_cycle]) == 0) {
        self->cycle++;
        begin_cycle(self, vars);
    }
    if (self->step % steps_in(vars, vars[V_sensor_period]) == 0) sensors_sample(self, vars);
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const long long n = steps_in(vars, h);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - (double)self->step * vars[V_dt]) > 0.5 * vars[V_dt])
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_hold; i <= V_retreat; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0)) return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) advance(self, vars);
    publish(self, vars);
    if (!isfinite(self->x_o + self->x_h + self->x_r)) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
