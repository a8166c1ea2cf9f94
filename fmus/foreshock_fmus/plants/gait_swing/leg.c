/* The leg: a double pendulum in a plane that turns about the hip-roll axis, exact for this arrangement (README.md). */
#include <math.h>

#include "model.h"

static const double pitch_inertia =
    THIGH_MASS * THIGH_CENTRE * THIGH_CENTRE + THIGH_INERTIA + (SHANK_MASS + FOOT_MASS) * THIGH_LENGTH * THIGH_LENGTH;
static const double shank_inertia =
    SHANK_MASS * SHANK_CENTRE * SHANK_CENTRE + SHANK_INERTIA + FOOT_MASS * SHANK_LENGTH * SHANK_LENGTH;
static const double coupling = (SHANK_MASS * SHANK_CENTRE + FOOT_MASS * SHANK_LENGTH) * THIGH_LENGTH;
static const double pitch_moment = THIGH_MASS * THIGH_CENTRE + (SHANK_MASS + FOOT_MASS) * THIGH_LENGTH;
static const double shank_moment = SHANK_MASS * SHANK_CENTRE + FOOT_MASS * SHANK_LENGTH;

/* Moment of inertia about the roll axis, sum of m d^2, and its slopes by both angles. */
static double roll_inertia(const double q[L_SIZE], double slope[2]) {
    const double mass[3] = {THIGH_MASS, SHANK_MASS, FOOT_MASS};
    const double upper[3] = {THIGH_CENTRE, THIGH_LENGTH, THIGH_LENGTH}, lower[3] = {0.0, SHANK_CENTRE, SHANK_LENGTH};
    double sum = 0.0;
    slope[0] = slope[1] = 0.0;
    for (int i = 0; i < 3; i++) {
        const double depth = upper[i] * cos(q[L_PITCH]) + lower[i] * cos(q[L_SHANK]);
        sum += mass[i] * depth * depth;
        slope[0] -= 2.0 * mass[i] * depth * upper[i] * sin(q[L_PITCH]);
        slope[1] -= 2.0 * mass[i] * depth * lower[i] * sin(q[L_SHANK]);
    }
    return sum;
}

void leg_terms(const double q[L_SIZE], double slope, double pelvis_a, LegTerms *terms) {
    const double apart = q[L_PITCH] - q[L_SHANK], c = cos(apart), s = sin(apart);
    const double wp = q[L_PITCH_RATE], ws = q[L_SHANK_RATE], wr = q[L_ROLL_RATE], lean = q[L_ROLL] - slope;
    double by[2];
    terms->m11 = pitch_inertia, terms->m12 = coupling * c, terms->m22 = shank_inertia;
    terms->roll = roll_inertia(q, by);
    const double depth = pitch_moment * cos(q[L_PITCH]) + shank_moment * cos(q[L_SHANK]);
    terms->bias[0] = coupling * s * ws * ws + GRAVITY * cos(lean) * pitch_moment * sin(q[L_PITCH]) - 0.5 * by[0] * wr * wr +
        pelvis_a * pitch_moment * cos(q[L_PITCH]);
    terms->bias[1] = -coupling * s * wp * wp + GRAVITY * cos(lean) * shank_moment * sin(q[L_SHANK]) - 0.5 * by[1] * wr * wr +
        pelvis_a * shank_moment * cos(q[L_SHANK]);
    terms->bias[2] = (by[0] * wp + by[1] * ws) * wr + GRAVITY * sin(lean) * depth;
}

void leg_forces(const double torque[3], double force_x, double force_out, const double q[L_SIZE], double out[3]) {
    const double sr = sin(q[L_ROLL]), depth = THIGH_LENGTH * cos(q[L_PITCH]) + SHANK_LENGTH * cos(q[L_SHANK]);
    out[0] = torque[0] + torque[1] + THIGH_LENGTH * (force_x * cos(q[L_PITCH]) - force_out * sin(q[L_PITCH]) * sr);
    out[1] = -torque[1] + SHANK_LENGTH * (force_x * cos(q[L_SHANK]) - force_out * sin(q[L_SHANK]) * sr);
    out[2] = torque[2] + force_out * depth * cos(q[L_ROLL]);
}

double leg_energy(const double q[L_SIZE], double slope) {
    double by[2];
    const double wp = q[L_PITCH_RATE], ws = q[L_SHANK_RATE], wr = q[L_ROLL_RATE];
    const double depth = pitch_moment * cos(q[L_PITCH]) + shank_moment * cos(q[L_SHANK]);
    return 0.5 * (pitch_inertia * wp * wp + shank_inertia * ws * ws + roll_inertia(q, by) * wr * wr) +
        coupling * cos(q[L_PITCH] - q[L_SHANK]) * wp * ws - GRAVITY * cos(q[L_ROLL] - slope) * depth;
}

void leg_foot(const double q[L_SIZE], double hip_height, double p[3], double v[3]) {
    const double sp = sin(q[L_PITCH]), cp = cos(q[L_PITCH]), ss = sin(q[L_SHANK]), cs = cos(q[L_SHANK]);
    const double sr = sin(q[L_ROLL]), cr = cos(q[L_ROLL]), wr = q[L_ROLL_RATE];
    const double depth = THIGH_LENGTH * cp + SHANK_LENGTH * cs;
    const double sink = -THIGH_LENGTH * sp * q[L_PITCH_RATE] - SHANK_LENGTH * ss * q[L_SHANK_RATE];
    p[0] = THIGH_LENGTH * sp + SHANK_LENGTH * ss;
    p[1] = depth * sr;
    p[2] = hip_height - depth * cr;
    v[0] = THIGH_LENGTH * cp * q[L_PITCH_RATE] + SHANK_LENGTH * cs * q[L_SHANK_RATE];
    v[1] = sink * sr + depth * cr * wr;
    v[2] = -sink * cr + depth * sr * wr;
}

/* Angles that put the ankle at (x, outward, down) from the hip, knee forward; out of reach, as near as the leg can. */
void leg_solve(double x, double outward, double down, double q[3]) {
    const double depth = sqrt(down * down + outward * outward), line = atan2(x, depth);
    const double longest = 0.9999 * (THIGH_LENGTH + SHANK_LENGTH), shortest = 1.0001 * (THIGH_LENGTH - SHANK_LENGTH);
    const double reach = fmin(longest, fmax(shortest, sqrt(x * x + depth * depth)));
    const double a = (THIGH_LENGTH * THIGH_LENGTH + reach * reach - SHANK_LENGTH * SHANK_LENGTH) / (2.0 * THIGH_LENGTH * reach);
    const double b = (SHANK_LENGTH * SHANK_LENGTH + reach * reach - THIGH_LENGTH * THIGH_LENGTH) / (2.0 * SHANK_LENGTH * reach);
    q[L_PITCH] = line + acos(a);
    q[L_SHANK] = line - acos(b);
    q[L_ROLL] = atan2(outward, down);
}
