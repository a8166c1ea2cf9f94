/* Forces on the swing foot: a hose that it drags along, and the human's lower legs as ISO/TS 15066 models them. */
#include <math.h>

#include "model.h"

/* A hooked hose drags with constant friction once it is taut (N). */
double pull_force(const Plant *self, const double *vars, double t) {
    const double since = t - (meet_time(vars) - vars[V_pull_before]);
    if (since < 0.0 || since >= vars[V_pull_duration] || self->phase != PHASE_SWING || self->swing != LEFT) return 0.0;
    return vars[V_pull] * fmin(1.0, fmax(0.0, (t - self->plan.start) / 0.1));
}

double contact_force(const Plant *self, const double *vars, const double x[X_SIZE], double force[2], double *clearance) {
    double p[3], v[3], most = 0.0;
    const double side = self->swing == LEFT ? 1.0 : -1.0;
    leg_foot(x, vars[V_hip_height], p, v);
    const double fx = x[X_PELVIS] + p[0], fy = side * (HIP_BREADTH + p[1]);
    const double vx = x[X_PELVIS_V] + v[0], vy = side * v[1] - self->human_v;
    force[0] = force[1] = 0.0;
    *clearance = 1e3;
    if (self->phase != PHASE_SWING) return 0.0;
    for (int leg = -1; leg <= 1; leg += 2) { /* nearest point of the sole's middle line to each lower leg */
        const double lx = vars[V_human_x], ly = self->human_y + self->sway + leg * vars[V_human_hip];
        const double nearest = fmin(fx + SOLE_TOE, fmax(fx - SOLE_HEEL, lx));
        const double dx = nearest - lx, dy = fy - ly, range = fmax(sqrt(dx * dx + dy * dy), 1e-9);
        const double gap = range - SOLE_HALF - vars[V_leg_radius], closing = -(vx * dx + vy * dy) / range;
        *clearance = fmin(*clearance, gap);
        if (gap >= 0.0) continue;
        const double f = fmax(0.0, -vars[V_contact_stiffness] * gap + vars[V_contact_damping] * closing); /* never pulls */
        force[0] += f * dx / range, force[1] += f * dy / range;
        most = fmax(most, f);
    }
    return most;
}
