/* The startle plant: life cycle, sensors, outputs. README.md has the equations. */
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

static void sense(Plant *self, const double *vars, double t) {
    self->ring_at = (self->ring_at + 1) % RING;
    if (self->ring_fill < RING) self->ring_fill++;
    double *s = self->ring[self->ring_at];
    double fired = (t - self->fired_at - vars[V_reflex_latency]) / 0.4; /* knees bend and stretch again within 0.8 s */
    double bend = fired > 0.0 && fired < 2.0 ? fired * (2.0 - fired) * self->strength : 0.0;
    s[S_BASE_X] = noisy(self, self->x, vars[V_position_noise]);
    s[S_BASE_V] = noisy(self, self->v, vars[V_odometry_noise]);
    s[S_HUMAN_X] = noisy(self, vars[V_distance] + 0.12 + self->u, vars[V_human_noise]);
    s[S_HUMAN_V] = noisy(self, self->vu, 3.0 * vars[V_human_noise]);
    s[S_LOWERED] = noisy(self, vars[V_crouch] * bend, vars[V_human_noise]);
    s[S_YAW] = noisy(self, self->yaw + self->wander, vars[V_gaze_noise]);
    s[S_PITCH] = noisy(self, -0.1, vars[V_gaze_noise]);
    s[S_TIME] = t;
}

static const double *measured(const Plant *self, double age_s) {
    int back = (int)(age_s / TICK + 0.5);
    if (back > self->ring_fill - 1) back = self->ring_fill - 1;
    return self->ring[(self->ring_at + RING - back) % RING];
}

static void publish(Plant *self, double *vars) {
    const double t = (double)self->step * vars[V_dt];
    const double *base = measured(self, vars[V_latency]), *human = measured(self, vars[V_vision_latency]);
    Plan plan = plan_at(self, vars, t);
    vars[V_sensor_time] = base[S_TIME];
    vars[V_vision_time] = human[S_TIME];
    vars[V_base_x] = base[S_BASE_X];
    vars[V_base_v] = base[S_BASE_V];
    vars[V_human_x] = human[S_HUMAN_X];
    vars[V_human_vx] = human[S_HUMAN_V];
    vars[V_human_lowered] = human[S_LOWERED] > 0.0 ? human[S_LOWERED] : 0.0;
    vars[V_gaze] = -cos(human[S_YAW]) * cos(human[S_PITCH]); /* the robot lies at -x of the human */
    vars[V_gaze + 1] = -sin(human[S_YAW]) * cos(human[S_PITCH]);
    vars[V_gaze + 2] = sin(human[S_PITCH]);
    vars[V_enabled] = plan.enabled;
    vars[V_stop_requested] = plan.stop;
    vars[V_announced] = plan.announced;
    vars[V_command_speed] = fabs(plan.speed);
    vars[V_phase] = plan.phase;
    vars[V_due] = plan.due;
    vars[V_robot_x] = self->x;
    vars[V_robot_v] = self->v;
    vars[V_drive] = self->drive;
    vars[V_brake] = self->brake;
    vars[V_attention] = self->attention;
    vars[V_stimulus] = self->stimulus;
    vars[V_threshold] = self->threshold;
    vars[V_startle] = self->startle_max;
    vars[V_human_u] = self->u;
    vars[V_human_v] = self->vu;
    vars[V_cop] = self->cop;
    vars[V_heel_edge] = self->edge;
    vars[V_steps] = self->steps;
    vars[V_bench_force] = self->bench_force;
    vars[V_bench_peak] = self->bench_peak;
    vars[V_robot_force] = self->robot_force;
    vars[V_robot_peak] = self->robot_peak;
    vars[V_fallen] = self->fallen;
}

int plant_init(Plant *self, double *vars) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < V_sensor_time; i++) /* parameters and inputs come first */
        if (!isfinite(vars[i])) return fail(self, PLANT_ERROR, "a parameter or input is not finite", 0.0);
    if (!(vars[V_dt] > 0.0 && vars[V_dt] <= 0.002) || steps_in(vars, TICK) < 0)
        return fail(self, PLANT_ERROR, "dt = %g s; expected 0.002 s or less, a whole fraction of 0.01 s", vars[V_dt]);
    if (vars[V_vision_latency] > TICK * (RING - 1) || vars[V_balance_delay] > vars[V_dt] * (DELAY - 1))
        return fail(self, PLANT_ERROR, "vision_latency = %g s, or balance_delay, is too long", vars[V_vision_latency]);
    stream_seed(&self->process, (uint64_t)(int64_t)vars[V_seed], 1);
    stream_seed(&self->sensor, (uint64_t)(int64_t)vars[V_seed], 2);
    self->looks = 0, self->attention = 1.0; /* the first tick begins a look */
    self->fired_at = -1e9;
    self->edge = vars[V_heel];
    self->vu = vars[V_push_speed];
    self->threshold = vars[V_startle_threshold];
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
    for (int i = V_slow_approach; i <= V_hold; i++)
        if (!(vars[i] >= 0.0 && vars[i] <= 1.0))
            return fail(self, PLANT_ERROR, "an intervention is %g; expected 0 to 1", vars[i]);
    for (long long i = 0; i < n; i++) {
        const double now = (double)self->step * dt;
        if (self->step % tick == 0) gaze_tick(self, vars, now);
        robot_step(self, vars, now);
        attention_step(self, vars, now);
        balance_step(self, vars, now, reflex_step(self, vars, now));
        self->step++;
        if (self->step % tick == 0) sense(self, vars, (double)self->step * dt);
    }
    publish(self, vars);
    if (!isfinite(self->u) || !isfinite(self->x)) return fail(self, PLANT_ERROR, "the state is not finite at %g s", t + h);
    return PLANT_OK;
}
