/* The load: heave and pitch of a box, content that slides on its floor, and what it falls on. */
#include <math.h>

#include "model.h"

#define BRISTLE_N_M 8000.0 /* N/m, content on its floor before it slides */
#define BRISTLE_S 0.01     /* s, its damping over stiffness */
#define WALL_N_M 20000.0   /* N/m, end wall of the box */
#define WALL_S 0.01        /* s */
#define GROUND_S 0.004     /* s, damping over stiffness of floor and foot */

static double rest(double deep, double rate, double stiffness) {
    return deep > 0.0 ? fmax(0.0, stiffness * (deep - GROUND_S * rate)) : 0.0;
}

/* Floor under the robot's end; under the partner's its foot, if the load comes from above it and is not held. */
static void ground(Plant *self, const double *vars) {
    for (int i = 0; i < 2; i++) {
        const double deep = vars[V_grip_height] - end_z(self, vars, i), v = end_v(self, vars, i);
        self->floor[i] = rest(deep, v, vars[V_floor_stiffness]);
        if (i == PARTNER && self->carrier[PARTNER].lost > 0.5) {
            self->leg = rest(deep + vars[V_foot_height], v, body_lower_leg.stiffness);
            self->leg_peak = fmax(self->leg_peak, self->leg);
        }
    }
}

/* Force of the floor of the box on the content, along it (N). */
static double content_force(Plant *self, const double *vars, double dt) {
    const double cap = vars[V_content_friction] * fmax(0.0, self->normal), most = cap / BRISTLE_N_M;
    self->bristle = clip(self->bristle + dt * self->content_v, -most, most);
    double force = -clip(BRISTLE_N_M * (self->bristle + BRISTLE_S * self->content_v), -cap, cap);
    const double past = fabs(self->content) - vars[V_content_way], side = copysign(1.0, self->content);
    if (past > 0.0) force -= side * fmax(0.0, WALL_N_M * (past + WALL_S * side * self->content_v));
    return force;
}

void load_tick(Plant *self, const double *vars, double dt) {
    ground(self, vars);
    const double mb = vars[V_box_mass], mc = vars[V_content_mass], half = 0.5 * vars[V_length], s = self->content;
    const double inertia = mb * vars[V_length] * vars[V_length] / 12.0, tilt = self->tilt;
    const double low = self->carrier[ROBOT].force + self->floor[ROBOT];
    const double high = self->carrier[PARTNER].force + self->floor[PARTNER] + self->leg;
    const double along = mc > 0.0 ? content_force(self, vars, dt) / mc : 0.0;
    /* Lagrange for z, tilt and s, with the content at height z + s tilt; its own equation is put into the others. */
    const double d = 1.0 + tilt * tilt, bias = 2.0 * self->content_v * self->rate - GRAVITY * tilt * tilt + along * tilt;
    const double a = mb + mc / d, b = mc * s / d, c = inertia + mc * s * s / d;
    const double f = low + high - (mb + mc) * GRAVITY - mc * bias / d;
    const double g = (high - low) * half - mc * GRAVITY * s - mc * s * bias / d;
    const double det = a * c - b * b, az = (f * c - g * b) / det, at = (g * a - f * b) / det;
    const double up = (az + s * at + bias) / d; /* of the content */
    self->normal = mc * (GRAVITY + up);
    self->content_v += dt * (-tilt * (GRAVITY + up) + along);
    self->content += dt * self->content_v;
    self->vz += dt * az;
    self->z += dt * self->vz;
    self->rate += dt * at;
    self->tilt += dt * self->rate;
}

double load_energy(const Plant *self, const double *vars) {
    const double mb = vars[V_box_mass], mc = vars[V_content_mass], l = vars[V_length];
    const double w = self->vz + self->content_v * self->tilt + self->content * self->rate;
    const double kinetic = 0.5 * mb * self->vz * self->vz + mb * l * l / 24.0 * self->rate * self->rate +
                           0.5 * mc * (self->content_v * self->content_v + w * w);
    double energy = kinetic + GRAVITY * (mb * self->z + mc * (self->z + self->content * self->tilt));
    const double stiffness[2] = {vars[V_robot_stiffness], vars[V_partner_stiffness]};
    for (int i = 0; i < 2; i++) {
        if (self->carrier[i].lost > 0.5) continue;
        const double stretch = self->carrier[i].wanted - (i == ROBOT ? self->slip : 0.0) - end_z(self, vars, i);
        const double offset = 0.5 * (mb + mc) * GRAVITY;
        energy += 0.5 * stiffness[i] * stretch * stretch + offset * stretch;
    }
    return energy;
}
