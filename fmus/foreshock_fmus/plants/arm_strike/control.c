/* What the robot does by itself: its task, ankles, and angular momentum of trunk and arms where the foot is too short. */
#include <math.h>

#include "model.h"

/* Up and down with the box: a raised cosine in shoulder and elbow. Joints: ankle, hip, shoulder, elbow. */
void task(const Plant *self, const double *vars, double t, double *position, double *velocity) {
    (void)self;
    const double w = 6.283185307179586 / vars[V_task_period];
    const double u = 0.5 * (1.0 - cos(w * t)), du = 0.5 * w * sin(w * t);
    const double at[JOINTS] = {vars[V_lean], -vars[V_lean], vars[V_shoulder_rest], vars[V_elbow_rest]};
    const double by[JOINTS] = {0.0, 0.0, vars[V_shoulder_task], vars[V_elbow_task]};
    for (int i = 0; i < JOINTS; i++) position[i] = at[i] + by[i] * u, velocity[i] = by[i] * du;
}

void disturb(Plant *self, const double *vars, double t) {
    const double tiny = 1e-6 * vars[V_dt], start = vars[V_push_time], span = vars[V_push_duration];
    self->push = t >= start - tiny && t < start + span - tiny ? vars[V_push_impulse] / span : 0.0;
}

static double follow(double from, double to, double h, double rise, double release) {
    const double span = to > from ? rise : release;
    return from + (to - from) * (1.0 - exp(-h / span));
}

/* Torque that a drive still gives at a speed: its limit, fading out over the last third below the speed limit. */
static double available(double torque, double limit, double speed, double speed_limit) {
    const double share = (speed_limit - (torque > 0.0 ? speed : -speed)) / (speed_limit / 3.0);
    return CLIP(torque, -limit * CLIP(share, 0.0, 1.0), limit * CLIP(share, 0.0, 1.0));
}

void control_tick(Plant *self, const double *vars, double t) {
    /* both draws of a tick are made whatever happens, so that runs of one seed stay paired */
    const double keep = exp(-TICK / 0.02), kick = sqrt(1.0 - keep * keep);
    self->balance_noise = keep * self->balance_noise + kick * vars[V_balance_noise] * stream_normal(&self->process);
    self->sway_force = vars[V_sway_noise] * stream_normal(&self->process);
    self->soften = follow(self->soften, vars[V_soften_arms], TICK, vars[V_act_rise], vars[V_act_release]);
    self->withdraw = follow(self->withdraw, vars[V_withdraw_arm], TICK, vars[V_withdraw_rise], vars[V_act_release]);
    self->delay_at = (self->delay_at + 1) % DELAY_SIZE;
    for (int i = 0; i < LINKS; i++) {
        self->delay[self->delay_at].angle[i] = self->x[X_ANGLE + i];
        self->delay[self->delay_at].rate[i] = self->x[X_RATE + i];
    }
    const int late = (int)(vars[V_delay] / TICK + 0.5);
    const Posture *m = &self->delay[(self->delay_at + DELAY_SIZE - late) % DELAY_SIZE];
    if (self->down) {
        for (int i = 0; i < JOINTS; i++) self->torque[i] = 0.0;
        return;
    }
    const double weight = chain_mass(vars) * GRAVITY;
    const Point com = chain_com(vars, m->angle, m->rate);
    const double w = sqrt(GRAVITY / vars[V_com_height]);
    const double xi = com.x + com.vx / w + self->balance_noise, ref = vars[V_com_place];
    const double wanted = ref + vars[V_dcm_gain] * (xi - ref);
    const double cop = CLIP(wanted, -vars[V_heel], vars[V_toe]);
    self->excess = wanted - cop;
    const double momentum = weight * self->excess; /* N m, wanted rate of angular momentum */
    double plan[JOINTS], rate[JOINTS], hold[JOINTS], aim[JOINTS], lag[JOINTS];
    task(self, vars, t, plan, rate);
    for (int i = JOINTS - 1; i >= 0; i--) /* what carries the weight */
        hold[i] = (i + 1 < JOINTS ? hold[i + 1] : 0.0) - GRAVITY * first_moment(vars, i) * sin(m->angle[i]);
    aim[ANKLE] = -weight * cop;
    aim[HIP] = hold[HIP] - vars[V_trunk_stiffness] * m->angle[TRUNK] - vars[V_trunk_damping] * m->rate[TRUNK] +
               vars[V_trunk_share] * momentum;
    aim[HIP] = CLIP(aim[HIP], -vars[V_hip_torque], vars[V_hip_torque]);
    /* Withdrawn, the elbows bend and the upper arms go back. Softened, they give up swing, stiffness and torque. */
    const double draw = self->withdraw, soft = self->soften, swing = (1.0 - draw) * (1.0 - soft);
    const double target[2] = {vars[V_shoulder_rest] + vars[V_shoulder_withdrawn], vars[V_elbow_rest] + vars[V_elbow_withdrawn]};
    const double share[2] = {vars[V_shoulder_share], vars[V_elbow_share]};
    const double limit[2] = {vars[V_shoulder_torque], vars[V_elbow_torque]};
    const double speed[2] = {vars[V_shoulder_speed], vars[V_elbow_speed]};
    const double stiff[2] = {vars[V_shoulder_stiffness], vars[V_elbow_stiffness]};
    const double damp[2] = {vars[V_shoulder_damping], vars[V_elbow_damping]};
    for (int k = 0; k < 2; k++) {
        const int i = SHOULDER + k;
        const double joint = m->angle[i] - m->angle[i - 1], joint_rate = m->rate[i] - m->rate[i - 1];
        const double to = plan[i] + draw * (target[k] - plan[i]), pace = (1.0 - draw) * rate[i];
        double act = (1.0 - soft * vars[V_soft_stiffness]) * stiff[k] * (to - joint) + damp[k] * (pace - joint_rate) +
                     swing * share[k] * momentum;
        const double most = limit[k] - soft * (limit[k] - vars[V_soft_torque]);
        act = CLIP(act, -most, most);
        aim[i] = available(hold[i] + act, limit[k], joint_rate, speed[k]);
    }
    for (int i = 0; i < JOINTS; i++) {
        lag[i] = i == ANKLE ? vars[V_ankle_lag] : vars[V_joint_lag];
        self->torque[i] += (aim[i] - self->torque[i]) * (1.0 - exp(-TICK / lag[i]));
    }
}
