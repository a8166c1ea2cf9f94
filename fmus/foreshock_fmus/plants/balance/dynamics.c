/* The standing robot: a body and two feet as point masses, a trunk and two arms as flywheels, feet that can slide. */
#include <math.h>

#include "model.h"

#define CLIP(x, a, b) ((x) < (a) ? (a) : (x) > (b) ? (b) : (x))

double com_of(const double x[X_SIZE]) { return (BODY_MASS * x[X_Y] + FOOT_MASS * (x[X_YL] + x[X_YR])) / TALOS_MASS; }

double com_rate_of(const double x[X_SIZE]) { return (BODY_MASS * x[X_V] + FOOT_MASS * (x[X_VL] + x[X_VR])) / TALOS_MASS; }

/* Feet fixed: com'' = w^2 (com - cop). */
double dcm_rate(void) { return sqrt(GRAVITY / TALOS_COM_HEIGHT * BODY_MASS / TALOS_MASS); }

/* Ground on foot, N: elastic-plastic Coulomb friction with bristle deflection z and rate v. */
static double friction(const double *vars, double compliance, double v, double z, double mu, double load) {
    double s0 = vars[V_friction_stiffness] * (1.0 + compliance), s1 = vars[V_friction_damping] * (1.0 + 2.0 * compliance);
    return -load * CLIP(s0 * z + s1 * v, -mu, mu);
}

/* Acceleration of one arm's abduction: servo to target, limited by the joint's torque, which also carries the arm. */
static double arm_servo(double angle, double rate, double target, double feed) {
    double wanted = 144.0 * (target - angle) - 24.0 * rate + feed;
    double weight = TALOS_ARM_MASS * GRAVITY * TALOS_ARM_LEVER * sin(angle);
    double high = (TALOS_ARM_TORQUE - weight) / TALOS_ARM_INERTIA, low = (-TALOS_ARM_TORQUE - weight) / TALOS_ARM_INERTIA;
    return CLIP(wanted, low, high);
}

void standing_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE], Contact *contact) {
    const double a = TALOS_HALF_STANCE, half = vars[V_sole_half_width], h = TALOS_COM_HEIGHT;
    const int left = self->left_down, right = self->right_down;
    const double lock = self->act[ACT_LOCK], compliance = self->act[ACT_COMPLIANCE], arms = self->act[ACT_ARMS];
    double y = com_of(x), shift_left = x[X_YL] - a, shift_right = x[X_YR] + a;
    double shift = left && right ? 0.5 * (shift_left + shift_right) : left ? shift_left : shift_right;
    double low = (right ? x[X_YR] : x[X_YL]) - half, high = (left ? x[X_YL] : x[X_YR]) + half;
    double cop = CLIP(x[X_COP] + shift, low, high);
    double share = left && right ? CLIP((cop - x[X_YR]) / (x[X_YL] - x[X_YR]), 0.0, 1.0) : left ? 1.0 : 0.0;
    double beyond = fabs(x[X_ROLL]) - vars[V_roll_max], stop = 0.0;
    if (beyond > 0.0) {
        /* the stop only pushes */
        double push = vars[V_stop_stiffness] * beyond + vars[V_stop_damping] * x[X_RATE] * (x[X_ROLL] > 0.0 ? 1.0 : -1.0);
        stop = (push > 0.0 ? push : 0.0) * (x[X_ROLL] > 0.0 ? -1.0 : 1.0);
    }
    double hip = x[X_TORQUE] + stop, push = self->push + self->footfall;
    /* moments about the ground point below the CoM, feet as masses at ground level */
    double body = (WEIGHT * (y - cop) + hip + self->push * vars[V_push_height] + self->footfall * h) / (TALOS_MASS * h);
    double leg_force = BODY_MASS * body - push; /* both feet on the body */
    double load_left = share * WEIGHT, load_right = (1.0 - share) * WEIGHT;
    double ground_left = left ? friction(vars, compliance, x[X_VL], x[X_ZL], self->mu[0], load_left) : 0.0;
    double ground_right = right ? friction(vars, compliance, x[X_VR], x[X_ZR], self->mu[1], load_right) : 0.0;
    double width = x[X_YL] - x[X_YR] - 2.0 * a, width_rate = x[X_VL] - x[X_VR], wn = vars[V_swing_bandwidth];
    double swing = wn * wn * width + 2.0 * wn * width_rate; /* the hips keep the swing foot beside the stance foot */
    dx[X_Y] = x[X_V];
    dx[X_V] = body;
    dx[X_YL] = x[X_VL];
    dx[X_YR] = x[X_VR];
    if (left && right) {
        double spring = vars[V_width_stiffness] * (1.0 + lock) * width;
        spring += vars[V_width_damping] * (1.0 + 4.0 * compliance) * width_rate;
        dx[X_VL] = (ground_left - share * leg_force - spring) / FOOT_MASS;
        dx[X_VR] = (ground_right - (1.0 - share) * leg_force + spring) / FOOT_MASS;
    } else if (left) {
        dx[X_VR] = swing;
        dx[X_VL] = (ground_left - leg_force - FOOT_MASS * swing) / FOOT_MASS;
    } else {
        dx[X_VL] = -swing;
        dx[X_VR] = (ground_right - leg_force + FOOT_MASS * swing) / FOOT_MASS;
    }
    dx[X_ZL] = left ? x[X_VL] : -x[X_ZL] / 0.01;
    dx[X_ZR] = right ? x[X_VR] : -x[X_ZR] / 0.01;
    double target = TALOS_ARM_START + vars[V_arm_reach] * arms, feed = vars[V_arm_gain] * arms * x[X_RATE];
    double al = arm_servo(x[X_AL], x[X_WL], target, feed), ar = arm_servo(x[X_AR], x[X_WR], target, -feed);
    double inertia = TRUNK_INERTIA + ARM_SPREAD * (x[X_AL] + x[X_AR] - 2.0 * TALOS_ARM_START);
    dx[X_AL] = x[X_WL], dx[X_WL] = al, dx[X_AR] = x[X_WR], dx[X_WR] = ar;
    dx[X_ROLL] = x[X_RATE];
    double jl = ARM_MOMENT + ARM_MOMENT_SLOPE * (x[X_AL] - TALOS_ARM_START), wl = x[X_WL];
    double jr = ARM_MOMENT + ARM_MOMENT_SLOPE * (x[X_AR] - TALOS_ARM_START), wr = x[X_WR];
    double arm_moment = jl * al - jr * ar + ARM_MOMENT_SLOPE * (wl * wl - wr * wr) + ARM_SPREAD * (wl + wr) * x[X_RATE];
    dx[X_RATE] = (hip - arm_moment) / inertia; /* d/dt (I roll' + J left' - J right') = hip */
    dx[X_COP] = (self->cop_command - x[X_COP]) / (vars[V_ankle_lag] * (1.0 - 0.5 * lock));
    dx[X_TORQUE] = (self->torque_command - x[X_TORQUE]) / (vars[V_hip_lag] * (1.0 - 0.4 * lock));
    if (!contact) return;
    *contact = (Contact){.cop = cop, .share = share, .low = low, .high = high, .hip = hip,
                         .force_left = ground_left, .force_right = ground_right,
                         .com_acceleration = (BODY_MASS * body + FOOT_MASS * (dx[X_VL] + dx[X_VR])) / TALOS_MASS};
}
