/* Object, pads and gripper while the object is held; the fall and the foot below when it is not. */
#include <math.h>

#include "body.h"
#include "model.h"

#define FOOT_DAMPING 40.0 /* N s/m, chosen small */

/* What has flowed in until t, kg. */
static double added_at(const double *vars, double t) {
    double m = vars[V_fill_rate] * (t - vars[V_fill_time]);
    return m < 0.0 ? 0.0 : m > vars[V_fill_mass] ? vars[V_fill_mass] : m;
}

double mass_at(const double *vars, double t) { return vars[V_mass] + added_at(vars, t); }

/* CoM ahead of the pads while level: what flows in lies elsewhere than what was there. */
static double ahead_at(const double *vars, double t) {
    const double added = added_at(vars, t);
    return (vars[V_mass] * vars[V_offset_x] + added * vars[V_fill_offset]) / (vars[V_mass] + added);
}

double com_rate(const double *vars, double t, const double *x) {
    const double ahead = cos(x[X_TILT]) * ahead_at(vars, t) + sin(x[X_TILT]) * vars[V_offset_z];
    return vars[V_wrist_lever] * x[X_WRIST_RATE] - x[X_LOWER_RATE] - x[X_SLIDE_RATE] + ahead * x[X_TILT_RATE];
}

/* Friction coefficient at a slip speed: Stribeck's fall from static to kinetic, then the strengthening of rubber. */
static double friction(const double *vars, double speed) {
    double mu = vars[V_mu], kinetic = vars[V_mu_ratio], u = speed / vars[V_stribeck_speed];
    return mu * (kinetic + (1.0 - kinetic) * exp(-u * u) + speed / vars[V_strengthening_speed]);
}

/* Limits of the pads in shear (N) and torsion (N m): both pads. */
static void limits(const Plant *self, const double *vars, double normal, double *shear, double *twist) {
    *shear = 2.0 * friction(vars, self->slip_speed) * (normal > 1e-3 ? normal : 1e-3);
    *twist = *shear * vars[V_pad_radius];
}

static double squared(double x) { return x * x; }

void held_rhs(const Plant *self, const double *vars, double t, const double *x, double *dx, Forces *f) {
    const double added = added_at(vars, t), m = vars[V_mass] + added, lever = vars[V_wrist_lever];
    const double cx = ahead_at(vars, t), cz = vars[V_offset_z];
    const double c = cos(x[X_TILT]), s = sin(x[X_TILT]), rate = x[X_TILT_RATE];
    const double lx = c * cx + s * cz, lz = c * cz - s * cx; /* CoM ahead of and below the pads */
    const double k = vars[V_pad_stiffness], d = vars[V_pad_damping], r2 = squared(vars[V_pad_radius]);
    const double slide = x[X_SLIDE_RATE], turn = rate - x[X_WRIST_RATE];
    double limit, twist_limit;
    limits(self, vars, x[X_NORMAL], &limit, &twist_limit);
    /* elastic plus viscous, cut off at the limit surface of a soft finger (an ellipse) */
    double shear = k * x[X_SHEAR] + d * slide, twist = r2 * (k * x[X_TWIST] + d * turn);
    const double use = sqrt(squared(shear / limit) + squared(twist / twist_limit));
    if (use > 1.0) shear /= use, twist /= use;
    /* the support touches the bottom of the object */
    const double gap = vars[V_support_below] - x[X_LOWERED] - x[X_SLIDE] + lever * x[X_WRIST];
    const double closing = x[X_LOWER_RATE] + slide - lever * x[X_WRIST_RATE];
    double support = gap < 0.0 ? -vars[V_support_stiffness] * gap + vars[V_support_damping] * closing : 0.0;
    if (support < 0.0) support = 0.0;
    const int filling = t >= vars[V_fill_time] && added < vars[V_fill_mass];
    const double inflow = filling ? vars[V_fill_rate] * vars[V_fill_speed] : 0.0;

    const double tilt_acc = (-twist - lx * shear + m * lz * lx * squared(rate)) / (vars[V_inertia] + m * squared(lz));
    const double com_acc = (shear + support - inflow) / m - GRAVITY;
    const double wrist_acc = (x[X_TORQUE] + self->tremor + twist - lever * shear) / vars[V_wrist_inertia];
    const double pad_acc = self->hand + lever * wrist_acc;

    dx[X_WRIST] = x[X_WRIST_RATE];
    dx[X_WRIST_RATE] = wrist_acc;
    dx[X_TILT] = rate;
    dx[X_TILT_RATE] = tilt_acc;
    dx[X_SLIDE] = slide;
    dx[X_SLIDE_RATE] = pad_acc + lx * tilt_acc + lz * squared(rate) - com_acc;
    dx[X_SHEAR] = slide;
    dx[X_TWIST] = turn;
    dx[X_TORQUE] = (self->torque_command - x[X_TORQUE]) / vars[V_wrist_lag];
    dx[X_NORMAL] = (self->force_command - x[X_NORMAL]) / vars[V_grip_lag];
    dx[X_HEAT] = (squared(x[X_NORMAL] / vars[V_force_continuous]) - x[X_HEAT]) / vars[V_thermal_time];
    dx[X_LOWERED] = x[X_LOWER_RATE];
    dx[X_LOWER_RATE] = 0.0; /* set by the arm's controller, motion.c */
    if (f) *f = (Forces){shear, twist, support, pad_acc, use, m};
}

/* The bristles hold no more than friction can; what they are set back by is slip. */
void return_mapping(Plant *self, const double *vars) {
    const double k = vars[V_pad_stiffness], r = vars[V_pad_radius], dt = vars[V_dt];
    double limit, twist_limit, *z = self->x;
    limits(self, vars, z[X_NORMAL], &limit, &twist_limit);
    const double use = sqrt(squared(k * z[X_SHEAR] / limit) + squared(k * r * r * z[X_TWIST] / twist_limit));
    double speed = 0.0;
    if (use > 1.0) {
        const double back = 1.0 - 1.0 / use;
        speed = back * sqrt(squared(z[X_SHEAR]) + squared(r * z[X_TWIST])) / dt;
        z[X_SHEAR] -= back * z[X_SHEAR];
        z[X_TWIST] -= back * z[X_TWIST];
    }
    self->slip_speed += dt / (dt + vars[V_friction_memory]) * (speed - self->slip_speed);
}

/* Force of the object on a foot that stands on the floor: the spring of ISO/TS 15066's lower leg. */
double falling_force(const Plant *self, const double *vars) {
    (void)vars;
    const double depth = -self->fall_height;
    if (self->stage == STAGE_HELD || depth <= 0.0) return 0.0;
    const double force = body_lower_leg.stiffness * depth - FOOT_DAMPING * self->fall_rate;
    return force > 0.0 ? force : 0.0;
}

/* Semi-implicit step of the fall; it ends when the object rebounds. */
void falling_step(Plant *self, const double *vars) {
    const double force = falling_force(self, vars);
    if (force > self->peak) self->peak = force;
    self->fall_rate += vars[V_dt] * (force / self->fall_mass - GRAVITY);
    self->fall_height += vars[V_dt] * self->fall_rate;
    if (self->fall_height < 0.0 && self->fall_rate > 0.0) self->stage = STAGE_DOWN;
}
