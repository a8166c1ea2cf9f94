/* The two who carry: their gaits, how the one follows the other, and the forces of their arms. */
#include <math.h>

#include "model.h"

#define NOISE_S 1.5   /* s, correlation of the partner's cadence and bounce */
#define SHARE_S 0.5   /* s, in which an overload tells on the robot's legs */
#define HAND_M_S2 0.7 /* m/s2, with which a load is put down */

static double min_jerk(double s) {
    s = clip(s, 0.0, 1.0);
    return s * s * s * (10.0 + s * (6.0 * s - 15.0));
}

/* What the partner has noticed of an intervention by now. */
static double noticed(const Plant *self, const double *vars, int act, double dt) {
    const long long back = (long long)(vars[V_partner_reaction] / dt + 0.5), at = self->step - back;
    return at < 0 ? 0.0 : self->past[act][at % PAST];
}

void carriers_init(Plant *self, const double *vars) {
    for (int i = 0; i < 2; i++)
        self->carrier[i] = (Carrier){.height = vars[V_carry_height], .wanted = vars[V_carry_height]};
    self->share = 0.5;
}

/* Walking goes over to a stand, or to half speed; the bounce of the hands goes with it. */
static void walk(Carrier *c, const double *vars, double slow, double hold, double dt) {
    const double goal = hold > 0.5 ? 0.0 : slow > 0.5 ? 0.5 : 1.0, most = dt / vars[V_stop_time];
    c->walk += clip(goal - c->walk, -most, most);
}

/* Down at lower_speed and up again at half of it, with an acceleration and a way to brake that hands can follow. */
static void lower(Carrier *c, const double *vars, double down, double dt) {
    const double goal = down > 0.5 ? vars[V_grip_height] : vars[V_carry_height], left = goal - c->height;
    const double fastest = down > 0.5 ? vars[V_lower_speed] : 0.5 * vars[V_lower_speed];
    const double braking = sqrt(2.0 * HAND_M_S2 * fabs(left)), wanted = copysign(fmin(fastest, braking), left);
    c->speed += clip(wanted - c->speed, -HAND_M_S2 * dt, HAND_M_S2 * dt);
    c->height += dt * c->speed;
}

void carriers_tick(Plant *self, const double *vars, double t, double dt) {
    const double keep = exp(-dt / NOISE_S), fresh = sqrt(1.0 - keep * keep);
    const double draws[2] = {stream_normal(&self->process), stream_normal(&self->process)};
    self->cadence_noise = keep * self->cadence_noise + vars[V_cadence_noise] * fresh * draws[0];
    self->bounce_noise = keep * self->bounce_noise + vars[V_bounce_noise] * fresh * draws[1];
    Carrier *robot = &self->carrier[ROBOT], *partner = &self->carrier[PARTNER];
    walk(robot, vars, self->act[SLOW], self->act[HOLD], dt);
    walk(partner, vars, noticed(self, vars, SLOW, dt), noticed(self, vars, HOLD, dt), dt);
    lower(robot, vars, self->act[LOWER], dt);
    const double putting_down = noticed(self, vars, LOWER, dt);
    lower(partner, vars, putting_down, dt);
    const double weight = (vars[V_box_mass] + vars[V_content_mass]) * GRAVITY;
    self->share += (robot->force / weight - self->share) * fmin(1.0, dt / SHARE_S);
    /* Half the speed is walked with 0.7 of the cadence; legs that carry too much step more slowly. */
    const double overload = fmax(0.0, self->share - vars[V_overload_share]);
    const double legs = fmax(0.5, 1.0 - vars[V_overload_slowing] * overload);
    const double robot_hz = vars[V_robot_cadence] * legs * sqrt(robot->walk);
    const double partner_hz = (vars[V_partner_cadence] + self->cadence_noise) * sqrt(partner->walk);
    /* The plan keeps step with the partner, the legs with the plan; what holds them back may be more than that. */
    const double both = fmin(robot->walk, partner->walk), tie = vars[V_entrainment];
    const double planned_hz = vars[V_robot_cadence] * sqrt(robot->walk);
    const double lag = self->plan_phase - robot->phase;
    self->plan_phase += dt * TURN * (planned_hz + tie * sin(partner->phase - self->plan_phase) * both);
    robot->phase += dt * TURN * (robot_hz + tie * sin(lag) * robot->walk);
    partner->phase += dt * TURN * partner_hz;
    self->x += dt * vars[V_step_length] * robot_hz * sqrt(robot->walk);
    /* The lift is undone as the partner puts the load down. */
    const double lift = vars[V_lift] * min_jerk((t - vars[V_lift_time]) / vars[V_lift_duration]);
    const double carried = clip((partner->height - vars[V_grip_height]) / (vars[V_carry_height] - vars[V_grip_height]), 0.0, 1.0);
    /* Legs that carry more sink in more. */
    const double sag = fmax(0.0, self->share / 0.5);
    const double bounce[2] = {vars[V_robot_bounce] * sag * robot->walk,
                              vars[V_partner_bounce] * fmax(0.0, 1.0 + self->bounce_noise) * partner->walk};
    const double stiffness[2] = {vars[V_robot_stiffness], vars[V_partner_stiffness]};
    const double damping[2] = {vars[V_robot_damping], vars[V_partner_damping]};
    for (int i = 0; i < 2; i++) {
        Carrier *c = &self->carrier[i];
        const double before = c->wanted;
        c->wanted = c->height + bounce[i] * sin(c->phase) + (i == PARTNER ? lift * carried : 0.0);
        c->rate = (c->wanted - before) / dt;
        /* Arms hold a load at its height: the spring's rest lies above by the weight that they expect, half of it. */
        const double slip = i == ROBOT ? self->slip : 0.0;
        c->force = 0.5 * weight + stiffness[i] * (c->wanted - slip - end_z(self, vars, i)) + damping[i] * (c->rate - end_v(self, vars, i));
        if (c->lost > 0.5) c->force = 0.0;
    }
    if (partner->lost <= 0.5) {
        self->overloaded_for = partner->force > vars[V_partner_hold] ? self->overloaded_for + dt : 0.0;
        if (self->overloaded_for > 0.02) partner->lost = 1.0;
    }
}
