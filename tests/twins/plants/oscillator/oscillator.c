/* m x'' + d x' + k x = F by RK4. */
#include "plant.h"

struct Plant {
    double x, v;
};

const size_t plant_size = sizeof(struct Plant);

static double acceleration(const double *vars, double x, double v) {
    return (vars[V_force] - vars[V_damping] * vars[V_brake] * v - vars[V_stiffness] * x) / vars[V_mass];
}

static void publish(const Plant *self, double *vars, double t) {
    vars[V_position] = self->x;
    vars[V_velocity] = self->v;
    vars[V_spring] = -vars[V_stiffness] * self->x;
    vars[V_joint_angle] = self->x;
    vars[V_joint_angle + 1] = -self->x;
    vars[V_sampled] = t > 0.002 ? t - 0.002 : 0.0;
    vars[V_moving_left] = self->v < 0.0;
    vars[V_moving_right] = self->v > 0.0;
}

int plant_init(Plant *self, double *vars) {
    self->x = vars[V_x0];
    publish(self, vars, 0.0);
    return PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    const double x = self->x, v = self->v;
    const double k1 = acceleration(vars, x, v);
    const double v2 = v + 0.5 * h * k1, k2 = acceleration(vars, x + 0.5 * h * v, v2);
    const double v3 = v + 0.5 * h * k2, k3 = acceleration(vars, x + 0.5 * h * v2, v3);
    const double v4 = v + h * k3, k4 = acceleration(vars, x + h * v3, v4);
    self->x = x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    self->v = v + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    publish(self, vars, t + h);
    return PLANT_OK;
}

const char *plant_message(const Plant *self) {
    (void)self;
    return "";
}
