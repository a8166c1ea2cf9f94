/* The fall: legs and trunk as two links about the edge of the outer sole, and the human as a mass behind a spring.
 * All in the plane turned so that the fall goes to positive positions: alpha is the tilt of the line from edge to hips, psi
 * that of the trunk, l the length of that line. */
#include <math.h>
#include <string.h>

#include "model.h"

#define UPPER_MASS 58.894  /* kg, pelvis, torso, head, arms */
#define UPPER_LEVER 0.3529 /* m, its centre above the hips */
#define UPPER_INERTIA 5.25 /* kg m2, about its centre */
#define LEGS_MASS (TALOS_MASS - UPPER_MASS)
#define LEGS_INERTIA 2.464  /* kg m2, about their centre */
#define LEGS_CENTRE 0.6087 /* of the line from the ground to the hips, so that the CoM is at TALOS_COM_HEIGHT */
#define LINE_MASS (LEGS_MASS * LEGS_CENTRE + UPPER_MASS)
#define SHORTEST 0.45 /* of the first length: knees at their limit */

/* The CoM beyond the outer edge of both feet, and the capture point by more than hip moment over weight: xi' = w (xi - P - tau
 * / (m g)) then grows even if the hips gave all they can for ever. (Inwards there is no fall: the swing foot comes down.) */
int fall_begins(const Plant *self, const double *vars) {
    const double *x = self->x, y = com_of(x), xi = y + com_rate_of(x) / dcm_rate(), width = x[X_YL] - x[X_YR];
    const double low = x[X_YR] - vars[V_sole_half_width], high = x[X_YL] + vars[V_sole_half_width];
    const double lost = vars[V_hip_torque] * (1.0 + vars[V_lock_torque] * self->act[ACT_LOCK]) / WEIGHT;
    if (width > vars[V_split_max] || width < vars[V_split_min]) return 1;
    return (y > high && xi > high + lost) || (y < low && xi < low - lost);
}

static double half_breadth(const Plant *self, const double *vars) {
    return vars[V_contact_breadth] - 0.06 * self->act[ACT_MITIGATION];
}

void fall_start(Plant *self, const double *vars, double t) {
    const double *x = self->x;
    const double middle = 0.5 * (x[X_YL] + x[X_YR]), y = com_of(x), v = com_rate_of(x), side = y >= middle ? 1.0 : -1.0;
    const double outer = side > 0.0 ? x[X_YL] : x[X_YR];
    const double edge = outer + side * vars[V_sole_half_width];
    double c[C_SIZE] = {y, x[X_ROLL], x[X_YL], x[X_YR], 0.0, 0.0, x[X_AL], x[X_AR]}, rate, acceleration;
    c[C_LIFT_LEFT] = lift_height(&self->lift[0], t, &rate, &acceleration);
    c[C_LIFT_RIGHT] = lift_height(&self->lift[1], t, &rate, &acceleration);
    talos_standing(c, self->fall_q);
    double psi = -side * x[X_ROLL], psi_rate = -side * x[X_RATE], moment = UPPER_MASS * UPPER_LEVER;
    double line_y = TALOS_MASS * side * (y - edge) - moment * sin(psi);
    double line_z = TALOS_MASS * TALOS_COM_HEIGHT - moment * cos(psi);
    double alpha = atan2(line_y, line_z), length = sqrt(line_y * line_y + line_z * line_z) / LINE_MASS;
    double vy = TALOS_MASS * side * v - moment * psi_rate * cos(psi), vz = moment * psi_rate * sin(psi);
    double *f = self->fall;
    f[T_TURN] = alpha, f[T_ROLL] = psi, f[T_LENGTH] = length;
    f[T_TURN_RATE] = (vy * cos(alpha) - vz * sin(alpha)) / (LINE_MASS * length);
    f[T_LENGTH_RATE] = (vy * sin(alpha) + vz * cos(alpha)) / LINE_MASS;
    f[T_ROLL_RATE] = psi_rate;
    f[T_HUMAN] = side * vars[V_human_place_y]; /* negative: behind the fall */
    f[T_HUMAN_RATE] = 0.0;
    self->fall_edge = edge, self->fall_side = side, self->fall_start = alpha, self->fall_length = length;
    self->stage = STAGE_TIPPING;
    self->left_down = side > 0.0;
    self->right_down = !self->left_down;
}

void fall_rhs(const Plant *self, const double *vars, const double f[T_SIZE], double df[T_SIZE], Contact *contact) {
    const double alpha = f[T_TURN], psi = f[T_ROLL], l = f[T_LENGTH];
    const double wa = f[T_TURN_RATE], wp = f[T_ROLL_RATE], vl = f[T_LENGTH_RATE];
    const double sa = sin(alpha), ca = cos(alpha), sp = sin(psi), cp = cos(psi), sd = sin(alpha - psi), cd = cos(alpha - psi);
    const double give = self->act[ACT_MITIGATION], moment = UPPER_MASS * UPPER_LEVER;
    /* contact of the upper arm with the human's chest, horizontal */
    double zc = vars[V_contact_height], b = half_breadth(self, vars), force = 0.0;
    double point_y = l * sa + zc * sp + b * cp, point_z = l * ca + zc * cp - b * sp;
    double point_v = vl * sa + l * wa * ca + wp * (zc * cp - b * sp);
    double depth = self->fall_edge * self->fall_side + point_y - (f[T_HUMAN] - vars[V_human_depth]);
    if (depth > 0.0 && point_z > 0.2 && point_z < 1.6 && f[T_HUMAN] > 0.0) {
        force = vars[V_contact_stiffness] * depth + vars[V_contact_damping] * (point_v - f[T_HUMAN_RATE]);
        if (force < 0.0) force = 0.0;
    }
    const int near = f[T_HUMAN] > 0.0 && -depth < vars[V_turn_time] * (point_v - f[T_HUMAN_RATE]);
    /* hips: held stiffly, or turned away from the fall and slack once they touch */
    double bend = psi - alpha, bend_rate = wp - wa, limit = vars[V_hip_torque];
    double hold = -vars[V_fall_hip_stiffness] * bend - vars[V_fall_hip_damping] * bend_rate;
    hold = hold > limit ? limit : hold < -limit ? -limit : hold;
    double hip = near ? (1.0 - give) * hold - give * vars[V_turn_away] * limit : hold, over = fabs(bend) - 0.52;
    if (over > 0.0) hip -= (bend > 0.0 ? 1.0 : -1.0) * vars[V_stop_stiffness] * over + vars[V_stop_damping] * bend_rate;
    /* knees: stiff, or giving way against a damper */
    double shorter = self->fall_length - l, stiff = vars[V_leg_stiffness] * shorter - vars[V_leg_damping] * vl;
    const double knees = give * vars[V_knee_give];
    double leg = (1.0 - knees) * (stiff + LINE_MASS * GRAVITY * cos(self->fall_start)) - knees * vars[V_knee_damping] * vl;
    const double shortest = SHORTEST * self->fall_length;
    if (l < shortest) leg += vars[V_leg_stiffness] * (shortest - l) - vars[V_leg_damping] * vl;
    const double mm = LEGS_MASS * LEGS_CENTRE * LEGS_CENTRE + UPPER_MASS;
    double qa = LINE_MASS * GRAVITY * l * sa - hip - force * l * ca - 2.0 * mm * l * vl * wa - moment * l * wp * wp * sd;
    double qp = moment * GRAVITY * sp + hip - force * (zc * cp - b * sp) - moment * (2.0 * vl * wa * cd - l * wa * wa * sd);
    double ql = -LINE_MASS * GRAVITY * ca + leg - force * sa + mm * l * wa * wa + moment * wp * wp * cd;
    double A = mm * l * l + LEGS_INERTIA, B = moment * l * cd, C = UPPER_INERTIA + moment * UPPER_LEVER, D = moment * sd, E = mm;
    double ap = (qp - B * qa / A - D * ql / E) / (C - B * B / A - D * D / E);
    df[T_TURN] = wa, df[T_ROLL] = wp, df[T_LENGTH] = vl, df[T_HUMAN] = f[T_HUMAN_RATE];
    df[T_TURN_RATE] = (qa - B * ap) / A;
    df[T_ROLL_RATE] = ap;
    df[T_LENGTH_RATE] = (ql - D * ap) / E;
    df[T_HUMAN_RATE] = force / vars[V_human_mass];
    if (!contact) return;
    double ty = LINE_MASS * ((df[T_LENGTH_RATE] - l * wa * wa) * sa + (l * df[T_TURN_RATE] + 2.0 * vl * wa) * ca) +
                moment * (ap * cp - wp * wp * sp);
    double tz = LINE_MASS * ((df[T_LENGTH_RATE] - l * wa * wa) * ca - (l * df[T_TURN_RATE] + 2.0 * vl * wa) * sa) -
                moment * (ap * sp + wp * wp * cp);
    double load = TALOS_MASS * GRAVITY + tz, side = self->fall_side;
    *contact = (Contact){.cop = self->fall_edge, .low = self->fall_edge, .high = self->fall_edge, .load = load > 0.0 ? load : 0.0,
                         .hip = -side * hip, .com_acceleration = side * ty / TALOS_MASS, .human_force = force};
    *(side > 0.0 ? &contact->force_left : &contact->force_right) = side * (ty + force);
}

/* CoM of the falling robot, in the world. */
static void fall_com(const Plant *self, double *y, double *v) {
    const double *f = self->fall, moment = UPPER_MASS * UPPER_LEVER;
    double out = LINE_MASS * f[T_LENGTH] * sin(f[T_TURN]) + moment * sin(f[T_ROLL]);
    double rate = LINE_MASS * (f[T_LENGTH_RATE] * sin(f[T_TURN]) + f[T_LENGTH] * f[T_TURN_RATE] * cos(f[T_TURN])) +
                  moment * f[T_ROLL_RATE] * cos(f[T_ROLL]);
    *y = self->fall_edge + self->fall_side * out / TALOS_MASS;
    *v = self->fall_side * rate / TALOS_MASS;
}

/* Bring the standing state along, so that the truth outputs stay one set, and see whether the fall is over. */
void fall_after_step(Plant *self, const double *vars) {
    double *x = self->x, *f = self->fall, df[T_SIZE], y, v;
    Contact contact;
    if (self->stage != STAGE_TIPPING) return;
    fall_rhs(self, vars, f, df, &contact);
    if (contact.human_force > self->contact_peak) self->contact_peak = contact.human_force;
    else if (self->contact_peak > 0.0) self->fallen = 1; /* the peak is over */
    double hip_z = f[T_LENGTH] * cos(f[T_TURN]), top_z = hip_z + vars[V_contact_height] * cos(f[T_ROLL]);
    double shoulder_z = top_z - half_breadth(self, vars) * sin(f[T_ROLL]);
    if (shoulder_z < 0.05 || hip_z < 0.15) {
        self->stage = STAGE_DOWN;
        self->fallen = 1;
        f[T_TURN_RATE] = f[T_ROLL_RATE] = f[T_LENGTH_RATE] = f[T_HUMAN_RATE] = 0.0;
    }
    fall_com(self, &y, &v);
    x[X_VL] = x[X_VR] = 0.0;
    x[X_Y] = (TALOS_MASS * y - FOOT_MASS * (x[X_YL] + x[X_YR])) / BODY_MASS;
    x[X_V] = TALOS_MASS * v / BODY_MASS;
    x[X_ROLL] = -self->fall_side * f[T_ROLL], x[X_RATE] = -self->fall_side * f[T_ROLL_RATE];
    x[X_WL] = x[X_WR] = 0.0;
}
