/* What the robot does by itself: it believes something to be a tool, reaches for the nearest such thing, and grasps it. */
#include "model.h"

#define PATIENCE 0.3 /* s without belief in the target, until the reach is given up */

static double follow(double from, double to, double h, double rise, double release) {
    return from + (to - from) * (1.0 - exp(-h / (to > from ? rise : release)));
}

static void believe(Plant *self, const double *vars) {
    const Picture *p = network_newest(self, vars);
    const double gain = 1.0 - exp(-FRAME / vars[V_belief_time]), track = 1.0 - exp(-FRAME / 0.1);
    for (int i = 0; i < THINGS; i++) {
        const Found *f = &p->found[i];
        if (!f->seen) continue; /* what is not reported keeps what was believed of it */
        self->belief[i] += gain * (f->share - self->belief[i]);
        for (int k = 0; k < 2; k++) self->place[i][k] += track * (f->centre[k] - self->place[i][k]);
        if (self->belief[i] > vars[V_belief_on]) self->believed[i] = 1;
        if (self->belief[i] < vars[V_belief_off]) self->believed[i] = 0;
    }
}

static int wanted(const Plant *self, const double *vars, int i) {
    return self->believed[i] && self->place[i][0] <= vars[V_reach_most];
}

static int nearest(const Plant *self, const double *vars) {
    int best = -1;
    double least = 1e9;
    for (int i = 0; i < THINGS; i++) {
        const double d = hypot(self->place[i][0] - self->x[0], self->place[i][1] - self->x[1]);
        if (wanted(self, vars, i) && d < least) best = i, least = d;
    }
    return best;
}

static int arrived(const Plant *self, double within) {
    double square = 0.0;
    for (int k = 0; k < 3; k++) square += (self->goal[k] - self->x[k]) * (self->goal[k] - self->x[k]);
    return square < within * within;
}

static void enter(Plant *self, int phase) {
    self->phase = phase;
    self->phase_time = 0.0;
}

/* A hand that is low goes up before it goes aside. */
static void head_for(Plant *self, const double *vars, double x, double y, double z) {
    const double aside = hypot(x - self->x[0], y - self->x[1]);
    self->goal[0] = x, self->goal[1] = y, self->goal[2] = z;
    if (aside > 0.03 && self->x[2] < vars[V_hover] - 0.05) {
        self->goal[0] = self->reference[0], self->goal[1] = self->reference[1], self->goal[2] = vars[V_hover];
    }
}

void planner_frame(Plant *self, const double *vars) {
    believe(self, vars);
    self->slow = follow(self->slow, vars[V_slow_approach], FRAME, vars[V_act_rise], vars[V_act_release]);
    self->held = follow(self->held, vars[V_hold], FRAME, vars[V_act_rise], vars[V_act_release]);
    self->scaled = follow(self->scaled, vars[V_speed_scale], FRAME, vars[V_act_rise], vars[V_act_release]);
    self->withdrawn = follow(self->withdrawn, vars[V_withdraw], FRAME, vars[V_act_rise], vars[V_act_release]);
    const double free = (1.0 - vars[V_slow_share] * self->slow) * (1.0 - self->held) * (1.0 - self->scaled);
    self->phase_time += free * FRAME; /* a robot that is held does not count its pauses down */
    if (self->withdrawn > 0.5 && self->phase != PHASE_READY) enter(self, PHASE_RETURN);
    if (self->phase == PHASE_REACH || self->phase == PHASE_DESCEND) {
        self->lost_time = wanted(self, vars, self->target) ? 0.0 : self->lost_time + FRAME;
        if (self->lost_time > PATIENCE) enter(self, PHASE_RETURN);
    }
    self->speed_limit = vars[V_reach_speed];
    switch (self->phase) {
    case PHASE_READY:
        head_for(self, vars, vars[V_home_x], 0.0, vars[V_hover]);
        self->target = -1;
        if (self->phase_time >= vars[V_rest_time] && self->withdrawn < 0.5 && (self->target = nearest(self, vars)) >= 0) {
            self->lost_time = 0.0;
            enter(self, PHASE_REACH);
        }
        break;
    case PHASE_REACH:
        head_for(self, vars, self->place[self->target][0], self->place[self->target][1], vars[V_hover]);
        if (arrived(self, 0.025)) enter(self, PHASE_DESCEND);
        break;
    case PHASE_DESCEND:
        self->speed_limit = vars[V_descent_speed];
        for (int k = 0; k < 2; k++) self->goal[k] = self->place[self->target][k];
        self->goal[2] = vars[V_grasp_height];
        if (self->reference[2] - self->goal[2] < 0.002) enter(self, PHASE_GRASP);
        break;
    case PHASE_GRASP:
        if (self->phase_time >= vars[V_grasp_time]) enter(self, PHASE_RETURN);
        break;
    default:
        head_for(self, vars, vars[V_home_x], 0.0, vars[V_hover]);
        if (arrived(self, 0.03)) enter(self, PHASE_READY);
    }
    self->speed_limit *= free;
}

void planner_tick(Plant *self, const double *vars) {
    const double most = vars[V_acceleration], stop = 2.0 * most; /* it brakes twice as hard as it speeds up */
    double way[3], distance = 0.0, change[3], size = 0.0, speed = 0.0;
    for (int k = 0; k < 3; k++) {
        way[k] = self->goal[k] - self->reference[k];
        distance += way[k] * way[k];
        speed += self->reference_speed[k] * self->reference_speed[k];
    }
    distance = sqrt(distance), speed = sqrt(speed);
    /* just so fast that it can still brake, and no further than the goal within a tick */
    const double fast = fmin(fmin(self->speed_limit, sqrt(2.0 * most * distance)), distance / TICK);
    for (int k = 0; k < 3; k++) {
        change[k] = (distance > 1e-9 ? way[k] / distance * fast : 0.0) - self->reference_speed[k];
        size += change[k] * change[k];
    }
    size = sqrt(size);
    const double allowed = (fast < speed ? stop : most) * TICK, part = size > allowed ? allowed / size : 1.0;
    for (int k = 0; k < 3; k++) {
        self->reference_speed[k] += part * change[k];
        self->reference[k] += self->reference_speed[k] * TICK;
    }
}
