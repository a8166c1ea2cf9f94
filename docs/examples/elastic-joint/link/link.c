/* J q'' = torque - weight sin q - friction q', by RK4. */
#include <math.h>

#include "plant.h"

struct Plant {
    double angle, rate;
};

const size_t plant_size = sizeof(struct Plant);

static double acceleration(const double *vars, double angle, double rate) {
    return (vars[V_torque] - vars[V_weight] * sin(angle) - vars[V_friction] * rate) / vars[V_inertia];
}

static void publish(const Plant *self, double *vars) {
    vars[V_angle] = self->angle;
    vars[V_rate] = self->rate;
}

int plant_init(Plant *self, double *vars) {
    publish(self, vars);
    return PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    (void)t;
    const double a = self->angle, v = self->rate;
    const double k1 = acceleration(vars, a, v);
    const double v2 = v + 0.5 * h * k1, k2 = acceleration(vars, a + 0.5 * h * v, v2);
    const double v3 = v + 0.5 * h * k2, k3 = acceleration(vars, a + 0.5 * h * v2, v3);
    const double v4 = v + h * k3, k4 = acceleration(vars, a + h * v3, v4);
    self->angle = a + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
    self->rate = v + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    publish(self, vars);
    return PLANT_OK;
}

const char *plant_message(const Plant *self) {
    (void)self;
    return "";
}
