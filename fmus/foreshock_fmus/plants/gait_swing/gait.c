/* The walk: footholds, the swing foot's plan, the pelvis, and the torques that follow the plan. */
#include <math.h>
#include <string.h>

#include "model.h"

#define EPSILON 1e-3 /* s, of the central differences of the planned joint angles */

double gait_speed(const double *vars) { return vars[V_step_length] / (vars[V_swing_time] + vars[V_double_time]); }

/* Quintic from (p, v, a) to (goal, 0, 0) in the given time. */
static void quintic(double c[TERMS], double p, double v, double a, double goal, double span) {
    const double d = goal - p - v * span - 0.5 * a * span * span, e = -v - a * span, f = -a;
    const double s2 = span * span, s3 = s2 * span;
    c[0] = p, c[1] = v, c[2] = 0.5 * a;
    c[3] = 10.0 * d / s3 - 4.0 * e / s2 + 0.5 * f / span;
    c[4] = -15.0 * d / (s3 * span) + 7.0 * e / s3 - f / s2;
    c[5] = 6.0 * d / (s3 * s2) - 3.0 * e / (s3 * span) + 0.5 * f / s3;
    c[6] = 0.0;
}

void plan_at(const Plan *plan, double t, double p[AXES], double v[AXES]) {
    const double span = plan->end - plan->start, u = fmin(span, fmax(0.0, t - plan->start));
    for (int axis = 0; axis < AXES; axis++) {
        p[axis] = v[axis] = 0.0;
        for (int k = TERMS - 1; k >= 0; k--) v[axis] = v[axis] * u + p[axis], p[axis] = p[axis] * u + plan->c[axis][k];
        if (u >= span) v[axis] = 0.0;
    }
}

static double wanted_scale(const double *vars) {
    return (1.0 - (1.0 - vars[V_short_share]) * vars[V_shorten_step]) * (1.0 - vars[V_speed_scale]);
}

/* Least x of the foothold under way: the capture point must not lie beyond the toes. */
static double capture_foothold(const double x[X_SIZE], double span) {
    const double reach = x[X_PELVIS] + x[X_PELVIS_V] * span;
    return reach + x[X_PELVIS_V] / CAPTURE_RATE - SOLE_TOE - SOLE_HALF;
}

static void lift_off(Plant *self, const double *vars, double t, const double draw[TICK_DRAWS]) {
    const int swing = self->swing = 1 - self->swing;
    const double span = vars[V_swing_time], from = self->placed[swing][0], out = self->placed[swing][1];
    const double *x = self->x;
    Plan *plan = &self->plan;
    self->scale = wanted_scale(vars);
    plan->start = t, plan->end = t + span;
    plan->goal = self->placed[1 - swing][0] + self->scale * vars[V_step_length] + vars[V_foothold_noise] * draw[4];
    quintic(plan->c[AXIS_X], from, 0.0, 0.0, plan->goal, span);
    quintic(plan->c[AXIS_OUT], out, 0.0, 0.0, vars[V_foothold_noise] * draw[5], span);
    double *lift = plan->c[AXIS_LIFT]; /* 64 h u^3 (1 - u)^3 */
    const double h = 64.0 * vars[V_step_height], s3 = span * span * span;
    memset(lift, 0, TERMS * sizeof *lift);
    lift[3] = h / s3, lift[4] = -3.0 * h / (s3 * span), lift[5] = 3.0 * h / (s3 * span * span), lift[6] = -h / (s3 * s3);
    double q[3], next[3];
    leg_solve(from - x[X_PELVIS], out, vars[V_hip_height], q);
    leg_solve(from - x[X_PELVIS] - x[X_PELVIS_V] * EPSILON, out, vars[V_hip_height], next);
    for (int i = 0; i < 3; i++) self->x[i] = q[i], self->x[L_PITCH_RATE + i] = (next[i] - q[i]) / EPSILON;
    self->phase = PHASE_SWING;
}

/* Another goal, and another end, for the step under way. */
static void replan(Plant *self, double t, double goal, double end) {
    double p[AXES], v[AXES], vb[AXES], va[AXES], scratch[AXES];
    Plan *plan = &self->plan, old = self->plan;
    plan_at(&old, t, p, v);
    plan_at(&old, t - EPSILON, scratch, vb);
    plan_at(&old, t + EPSILON, scratch, va);
    plan->start = t, plan->end = end, plan->goal = goal;
    for (int axis = 0; axis < AXES; axis++) {
        const double target = axis == AXIS_X ? goal : 0.0;
        quintic(plan->c[axis], p[axis], v[axis], (va[axis] - vb[axis]) / (2.0 * EPSILON), target, end - t);
    }
}

static void touch_down(Plant *self, const double *vars, double t) {
    double p[3], v[3];
    leg_foot(self->x, vars[V_hip_height], p, v);
    self->placed[self->swing][0] = self->x[X_PELVIS] + p[0];
    self->placed[self->swing][1] = p[1];
    self->phase = self->suppressed ? PHASE_STAND : PHASE_BOTH;
    self->phase_end = t + vars[V_double_time];
}

void gait_start(Plant *self, const double *vars) {
    const double v = gait_speed(vars), step = vars[V_step_length];
    double none[TICK_DRAWS] = {0};
    self->x[X_PELVIS_V] = vars[V_stepping] > 0.5 ? v : 0.0;
    self->placed[LEFT][0] = 0.5 * v * vars[V_swing_time];
    self->placed[RIGHT][0] = self->placed[LEFT][0] - step;
    self->scale = 1.0;
    self->swing = LEFT;
    if (vars[V_stepping] > 0.5) {
        lift_off(self, vars, 0.0, none);
        return;
    }
    self->phase = PHASE_FREE; /* one leg hangs from a pelvis at rest */
    self->x[L_PITCH] = vars[V_free_pitch], self->x[L_SHANK] = vars[V_free_pitch] - vars[V_free_knee];
    self->x[L_ROLL] = vars[V_free_roll];
}

/* Where the pelvis should be, and when: over the next foothold in the middle of the next swing. */
static void pelvis_tick(Plant *self, const double *vars, double t) {
    const double half = 0.5 * vars[V_swing_time], *x = self->x;
    double a;
    if (self->suppressed) {
        const double w = 4.0, goal = self->phase == PHASE_SWING ? self->plan.goal : fmax(self->placed[0][0], self->placed[1][0]);
        const double rear = self->placed[1 - self->swing][0];
        a = w * w * (0.5 * (goal + rear) - x[X_PELVIS]) - 2.0 * w * x[X_PELVIS_V];
        if (a > 0.0 || x[X_PELVIS_V] <= 0.0) a = -x[X_PELVIS_V] / 0.1; /* a stop neither speeds up nor goes back */
    } else if (self->phase == PHASE_STAND) {
        a = -4.0 * x[X_PELVIS_V];
    } else {
        const double goal = self->phase == PHASE_SWING ? self->plan.goal : self->placed[self->swing][0];
        const double when = self->phase == PHASE_SWING ? self->plan.end + vars[V_double_time] + half : self->phase_end + half;
        a = ((goal - x[X_PELVIS]) / fmax(when - t, 0.05) - x[X_PELVIS_V]) / 0.15;
    }
    self->pelvis_a = fmin(vars[V_pelvis_acceleration], fmax(-vars[V_pelvis_acceleration], a));
}

void gait_tick(Plant *self, const double *vars, double t, const double draw[TICK_DRAWS]) {
    const int suppress = vars[V_step_suppression] > 0.5;
    double p[3], v[3];
    if (self->phase == PHASE_FREE) return;
    if (self->phase == PHASE_SWING) {
        const double left = self->plan.end - t, scale = wanted_scale(vars);
        double at[AXES], rate[AXES];
        plan_at(&self->plan, t, at, rate);
        if (suppress && !self->suppressed && left > 0.05) {
            const double span = fmin(left, vars[V_landing_time]);
            const double least = fmax(at[AXIS_X] + 0.35 * rate[AXIS_X] * span, capture_foothold(self->x, span));
            replan(self, t, fmin(self->plan.goal, least), t + span);
        } else if (scale < self->scale - 0.02 && left > 0.15 && !self->suppressed) {
            const double wanted = self->placed[1 - self->swing][0] + scale * vars[V_step_length];
            const double least = fmax(at[AXIS_X] + 0.35 * rate[AXIS_X] * left, capture_foothold(self->x, left));
            replan(self, t, fmin(self->plan.goal, fmax(wanted, least)), self->plan.end);
            self->scale = scale;
        }
        self->suppressed = self->suppressed || suppress;
        leg_foot(self->x, vars[V_hip_height], p, v);
        const int late = t > self->plan.start + 0.6 * (self->plan.end - self->plan.start);
        if ((t >= self->plan.end - 1e-9 && (p[2] < 0.02 || t > self->plan.end + 0.1)) || (late && p[2] <= 0.0 && v[2] < 0.0))
            touch_down(self, vars, t);
    } else {
        self->suppressed = suppress;
        if (suppress) self->phase = PHASE_STAND;
        else if (self->phase == PHASE_STAND) self->phase = PHASE_BOTH, self->phase_end = t + vars[V_resume_time];
        else if (t >= self->phase_end - 1e-9) lift_off(self, vars, t, draw);
    }
    pelvis_tick(self, vars, t);
}

/* Joint angles of the plan at time t + e, the pelvis moving on with constant acceleration. */
static void planned_angles(const Plant *self, const double *vars, double t, double e, double q[3]) {
    double p[AXES], v[AXES];
    plan_at(&self->plan, t + e, p, v);
    const double pelvis = self->x[X_PELVIS] + self->x[X_PELVIS_V] * e + 0.5 * self->pelvis_a * e * e;
    leg_solve(p[AXIS_X] - pelvis, p[AXIS_OUT], vars[V_hip_height] - p[AXIS_LIFT], q);
}

/* Computed torque: M (q_d'' + 2 D w e' + w^2 e) + bias, with what the actuators can give. */
void gait_torques(Plant *self, const double *vars, double t) {
    double now[3], before[3], after[3], want[3], *tau = self->torque;
    LegTerms terms;
    memset(tau, 0, sizeof self->torque);
    if (vars[V_control] < 0.5 || self->phase != PHASE_SWING) return;
    planned_angles(self, vars, t, 0.0, now);
    planned_angles(self, vars, t, -EPSILON, before);
    planned_angles(self, vars, t, EPSILON, after);
    leg_terms(self->x, 0.0, self->pelvis_a, &terms); /* the robot takes the floor for level */
    for (int i = 0; i < 3; i++) {
        const double w = i == L_ROLL ? vars[V_roll_bandwidth] : vars[V_swing_bandwidth];
        const double rate = (after[i] - before[i]) / (2.0 * EPSILON), acc = (after[i] - 2.0 * now[i] + before[i]) / (EPSILON * EPSILON);
        want[i] = acc + 2.0 * 0.8 * w * (rate - self->x[L_PITCH_RATE + i]) + w * w * (now[i] - self->x[i]);
    }
    const double pitch = terms.m11 * want[0] + terms.m12 * want[1] + terms.bias[0];
    const double shank = terms.m12 * want[0] + terms.m22 * want[1] + terms.bias[1];
    const double ask[3] = {pitch + shank, -shank, terms.roll * want[2] + terms.bias[2]};
    const double most[3] = {vars[V_hip_share] * vars[V_hip_torque], vars[V_knee_torque], vars[V_hip_share] * vars[V_roll_torque]};
    for (int i = 0; i < 3; i++) tau[i] = fmin(most[i], fmax(-most[i], ask[i])) + self->noise[i];
}

Foot foot_now(const Plant *self, const double *vars, int side) {
    Foot foot = {{0}, {0}};
    const double sign = side == LEFT ? 1.0 : -1.0;
    if ((self->phase == PHASE_SWING || self->phase == PHASE_FREE) && side == self->swing) {
        leg_foot(self->x, vars[V_hip_height], foot.p, foot.v);
        foot.p[0] += self->x[X_PELVIS], foot.v[0] += self->x[X_PELVIS_V];
    } else {
        foot.p[0] = self->placed[side][0], foot.p[1] = self->placed[side][1];
    }
    foot.p[1] = sign * (HIP_BREADTH + foot.p[1]), foot.v[1] *= sign;
    return foot;
}

Foot foot_planned(const Plant *self, int side, double t) {
    Foot foot = {{self->placed[side][0], self->placed[side][1], 0.0}, {0}};
    const double sign = side == LEFT ? 1.0 : -1.0;
    if (self->phase == PHASE_SWING && side == self->swing) plan_at(&self->plan, t, foot.p, foot.v);
    foot.p[1] = sign * (HIP_BREADTH + foot.p[1]), foot.v[1] *= sign;
    return foot;
}
