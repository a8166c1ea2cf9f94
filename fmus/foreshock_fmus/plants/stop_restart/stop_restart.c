/* The stop-restart plant: life cycle, sensors, outputs. README.md has the equations. */
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

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* The human stands beside the tool's way, at -y, 0.3 m beyond the end of the reach, and looks at the place of the hand. */
static void sense(Plant *self, const double *vars, double t) {
    self->ring_at = (self->ring_at + 1) % RING;
    if (self->ring_fill < RING) self->ring_fill++;
    double *s = self->ring[self->ring_at], lever = vars[V_lever];
    s[S_ANGLE] = noisy(self, self->x / lever, vars[V_encoder_noise]);
    s[S_RATE] = noisy(self, self->v / lever, vars[V_rate_noise]);
    s[S_EFFORT] = noisy(self, self->drive * lever, 0.3);
    s[S_HAND_X] = noisy(self, self->hand, vars[V_hand_noise]);
    s[S_HAND_Y] = noisy(self, -vars[V_reach] * (1.0 - self->in), vars[V_hand_noise]);
    s[S_HAND_Z] = noisy(self, 1.1, vars[V_hand_noise]);
    s[S_HUMAN_Y] = noisy(self, -vars[V_reach] - 0.3, vars[V_hand_noise]);
    s[S_YAW] = noisy(self, self->look_aside, vars[V_gaze_noise]);
    s[S_PITCH] = noisy(self, -0.5, vars[V_gaze_noise]);
    s[S_TIME] = t;
}

static const double *measured(const Plant *self, double age_s) {
    int back = (int)(age_s / TICK + 0.5);
    if (back > self->ring_fill - 1) back = self->ring_fill - 1;
    return self->ring[(self->ring_at + RING - back) % RING];
}

static void publish(Plant *self, double *vars) {
    const double t = (double)self->step * vars[V_dt];
    const double *arm = measured(self, vars[V_latency]), *human = measured(self, vars[V_vision_latency]);
    Plan plan = plan_at(self, vars, t);
    vars[V_sensor_time] = arm[S_TIME];
    vars[V_vision_time] = human[S_TIME];
    vars[V_joint_position] = arm[S_ANGLE];
    vars[V_joint_velocity] = arm[S_RATE];
    vars[V_joint_effort] = arm[S_EFFORT];
    vars[V_hand_x] = human[S_HAND_X];
    vars[V_hand_y] = human[S_HAND_Y];
    vars[V_hand_z] = human[S_HAND_Z];
    vars[V_human_y] = human[S_HUMAN_Y];
    vars[V_gaze] = sin(human[S_YAW]) * cos(human[S_PITCH]); /* the tool lies at +y of the human */
    vars[V_gaze + 1] = cos(human[S_YAW]) * cos(human[S_PITCH]);
    vars[V_gaze + 2] = sin(human[S_PITCH]);
    vars[V_enabled] = plan.enabled;
    vars[V_stop_requested] = plan.stop;
    vars[V_announced] = plan.announced;
    vars[V_command_speed] = fabs(plan.speed);
    vars[V_phase] = plan.phase;
    vars[V_due] = plan.due;
    vars[V_tool_x] = self->x;
    vars[V_tool_v] = self->v;
    vars[V_drive] = self->drive;
    vars[V_integrator] = self->integral;
    vars[V_brake] = self->brake;
    vars[V_park_x] = self->park;
    vars[V_stopped_x] = self->stopped;
    vars[V_hand_in] = self->in;
    vars[V_hand_place] = self->hand;
    vars[V_hand_force] = self->hand_force;
    vars[V_hand_peak] = self->hand_peak;
    vars[V_clamped] = self->clamped;
    vars[V_fixture_force] = self->fixture_force;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= 0.001) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.001 s or less, a whole fraction of 0.01 s", vars[V_dt]);
    if (vars[V_vision_latency] > TICK * (RING - 1))
        return fail(self, PLANT_ERROR, "vision_latency = %g s is longer than 0.63 s", vars[V_vision_latency]);
    if (!(vars[V_stop_at] < vars[V_restart_at] && vars[V_restart_at] + vars[V_return_time] < vars[V_cycle]))
        return fail(self, PLANT_ERROR, "stop_at < restart_at, restart_at + return_time < cycle = %g s must hold", vars[V_cycle]);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    self->reaction = vars[V_hand_reaction], self->dwell = vars[V_hand_dwell];
    self->park = self->stopped = park_of(vars);
    self->hand = self->park - vars[V_hand_before];
    sense(self, vars, 0.0);
    publish(self, vars);
    return PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    self->message[0] = 0;
    const double dt = vars[V_dt];
    const long long n = steps_in(vars, h), tick = steps_in(vars, TICK);
    if (n < 0) return fail(self, PLANT_DISCARD, "communication step %g s is no multiple of dt", h);
    if (fabs(t - (double)self->step * dt) > 0.5 * dt)
        return fail(self, PLANT_DISCARD, "asked to step from %g s, which is not the plant's time", t);
    for (int i = V_announce; i <= V_slow_approach; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) {
        const double now = (double)self->step * dt;
        if (self->step % tick == 0) hand_tick(self, vars, now);
        hand_step(self, vars, now);
        axis_step(self, vars, now);
        self->step++;
        if (self->step % tick == 0) sense(self, vars, (double)self->step * dt);
    }
    publish(self, vars);
    if (!isfinite(self->x) || !isfinite(self->hand)) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
