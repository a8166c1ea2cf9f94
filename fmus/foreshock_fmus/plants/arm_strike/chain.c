/* The body as a planar chain on the ankle: legs, trunk, upper arms, forearms with a box; and the human's chest. */
#include <math.h>

#include "model.h"

static double length(const double *vars, int i) {
    const int of[LINKS] = {V_legs_length, V_trunk_length, V_upper_length, V_fore_length};
    return vars[of[i]];
}

static double mass(const double *vars, int k) {
    const int of[LINKS] = {V_legs_mass, V_trunk_mass, V_upper_mass, V_fore_mass};
    return vars[of[k]];
}

static double centre(const double *vars, int k) {
    const int of[LINKS] = {V_legs_centre, V_trunk_centre, V_upper_centre, V_fore_centre};
    return vars[of[k]];
}

/* Share of link i's direction in the position of link k's centre. */
static double lever(const double *vars, int k, int i) { return i < k ? length(vars, i) : i == k ? centre(vars, k) : 0.0; }

double chain_mass(const double *vars) {
    double sum = vars[V_box_mass];
    for (int k = 0; k < LINKS; k++) sum += mass(vars, k);
    return sum;
}

double first_moment(const double *vars, int i) {
    double b = vars[V_box_mass] * length(vars, i);
    for (int k = 0; k < LINKS; k++) b += mass(vars, k) * lever(vars, k, i);
    return b;
}

static void coupling(const double *vars, double a[LINKS][LINKS]) {
    const int inertia[LINKS] = {V_legs_inertia, V_trunk_inertia, V_upper_inertia, V_fore_inertia};
    for (int i = 0; i < LINKS; i++)
        for (int j = 0; j < LINKS; j++) {
            a[i][j] = vars[V_box_mass] * length(vars, i) * length(vars, j) + (i == j ? vars[inertia[i]] : 0.0);
            for (int k = 0; k < LINKS; k++) a[i][j] += mass(vars, k) * lever(vars, k, i) * lever(vars, k, j);
        }
}

static Point along(const double *angle, const double *rate, const double *reach) {
    Point p = {0};
    for (int i = 0; i < LINKS; i++) {
        const double s = sin(angle[i]), c = cos(angle[i]);
        p.x += reach[i] * s, p.z += reach[i] * c;
        p.vx += reach[i] * rate[i] * c, p.vz -= reach[i] * rate[i] * s;
    }
    return p;
}

Point chain_com(const double *vars, const double *angle, const double *rate) {
    double reach[LINKS];
    for (int i = 0; i < LINKS; i++) reach[i] = first_moment(vars, i) / chain_mass(vars);
    return along(angle, rate, reach);
}

Point chain_hand(const double *vars, const double *angle, const double *rate) {
    const double reach[LINKS] = {length(vars, LEGS), length(vars, TRUNK), length(vars, UPPER), length(vars, FORE)};
    return along(angle, rate, reach);
}

/* The region of a standing adult of 1.75 m at a height above the floor: its segment borders, as in the template of capsules. */
const BodyRegion *region_at(double height) {
    if (height < 0.35 || height > 1.75) return 0;
    return height < 0.85 ? &body_thigh : height < 1.0 ? &body_pelvis : height < 1.2 ? &body_abdomen : height < 1.43 ? &body_chest : &body_face;
}

/* One region from touch to release, so that the spring is one spring. */
static const BodyRegion *region_of(const Plant *self, const double *vars, const Point *hand) {
    return region_at((self->touching ? self->touch_height : hand->z) + vars[V_ankle_height]);
}

double contact_force(const Plant *self, const double *vars, const double *x) {
    const Point hand = chain_hand(vars, x + X_ANGLE, x + X_RATE);
    const BodyRegion *region = region_of(self, vars, &hand);
    const double depth = hand.x - (x[X_HUMAN] - vars[V_human_depth]);
    if (depth <= 0.0 || depth > 0.3 || !region) return 0.0;
    const double f = region->stiffness * depth + vars[V_contact_damping] * (hand.vx - x[X_HUMAN_RATE]);
    return f > 0.0 ? f : 0.0;
}

double contact_limit(const Plant *self, const double *vars) {
    const Point hand = chain_hand(vars, self->x + X_ANGLE, self->x + X_RATE);
    const BodyRegion *region = region_of(self, vars, &hand);
    return region ? region->transient * region->limit : INFINITY;
}

double chain_energy(const double *vars, const double *x) {
    double a[LINKS][LINKS], energy = 0.0;
    coupling(vars, a);
    for (int i = 0; i < LINKS; i++) {
        energy += GRAVITY * first_moment(vars, i) * cos(x[X_ANGLE + i]);
        for (int j = 0; j < LINKS; j++)
            energy += 0.5 * a[i][j] * cos(x[X_ANGLE + i] - x[X_ANGLE + j]) * x[X_RATE + i] * x[X_RATE + j];
    }
    return energy;
}

/* Solve m y = r for a symmetric positive definite m, by Cholesky in place; r becomes y. */
static void solve(double m[LINKS][LINKS], double *r) {
    for (int i = 0; i < LINKS; i++)
        for (int j = 0; j <= i; j++) {
            double sum = m[i][j];
            for (int k = 0; k < j; k++) sum -= m[i][k] * m[j][k];
            m[i][j] = i == j ? sqrt(sum) : sum / m[j][j];
        }
    for (int i = 0; i < LINKS; i++) {
        for (int k = 0; k < i; k++) r[i] -= m[i][k] * r[k];
        r[i] /= m[i][i];
    }
    for (int i = LINKS - 1; i >= 0; i--) {
        for (int k = i + 1; k < LINKS; k++) r[i] -= m[k][i] * r[k];
        r[i] /= m[i][i];
    }
}

void chain_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]) {
    const double *angle = x + X_ANGLE, *rate = x + X_RATE, *torque = self->torque;
    double m[LINKS][LINKS], r[LINKS];
    const double force = contact_force(self, vars, x);
    coupling(vars, m);
    for (int i = 0; i < LINKS; i++) {
        r[i] = torque[i] - (i + 1 < LINKS ? torque[i + 1] : 0.0); /* the joint below, less the reaction of that above */
        r[i] += GRAVITY * first_moment(vars, i) * sin(angle[i]) - force * length(vars, i) * cos(angle[i]);
        for (int j = 0; j < LINKS; j++) {
            r[i] -= m[i][j] * sin(angle[i] - angle[j]) * rate[j] * rate[j];
            m[i][j] *= cos(angle[i] - angle[j]);
        }
    }
    r[LEGS] += self->push * length(vars, LEGS) * cos(angle[LEGS]);
    r[TRUNK] += self->push * vars[V_push_height] * cos(angle[TRUNK]);
    /* ends of the joints' ranges */
    for (int i = HIP; i <= ELBOW; i++) {
        const int low[JOINTS] = {0, V_hip_low, V_shoulder_low, V_elbow_low}, high[JOINTS] = {0, V_hip_high, V_shoulder_high, V_elbow_high};
        const double joint = angle[i] - angle[i - 1], over = joint > vars[high[i]] ? joint - vars[high[i]] : joint < vars[low[i]] ? joint - vars[low[i]] : 0.0;
        if (over == 0.0) continue;
        const double stop = -vars[V_stop_stiffness] * over - vars[V_stop_damping] * (rate[i] - rate[i - 1]);
        r[i] += stop, r[i - 1] -= stop;
    }
    solve(m, r);
    for (int i = 0; i < LINKS; i++) dx[X_ANGLE + i] = rate[i], dx[X_RATE + i] = r[i];
    /* the human sways about the place where it stands, and yields when struck */
    dx[X_HUMAN] = x[X_HUMAN_RATE];
    dx[X_HUMAN_RATE] = (force + self->sway_force - vars[V_stance_stiffness] * (x[X_HUMAN] - vars[V_human_place_x]) -
                        vars[V_stance_damping] * x[X_HUMAN_RATE]) / vars[V_human_mass];
}
