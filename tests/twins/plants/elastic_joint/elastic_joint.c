/* The equations of drive.c and link.c, without a coupling, by RK4 with 20 steps a communication step. */
#include <math.h>

#include "plant.h"

struct Plant {
    double x[4]; /* motor angle, link angle, motor rate, link rate */
};

const size_t plant_size = sizeof(struct Plant);

static double torque(const double *x) { return 600.0 * (x[0] - x[1]) + 3.0 * (x[2] - x[3]); }

static void rhs(const double *vars, double t, const double *x, double *dx) {
    const double wanted = vars[V_amplitude] * sin(6.283185307179586 * t / 2.0);
    dx[0] = x[2], dx[1] = x[3];
    dx[2] = (400.0 * (wanted - x[0]) - 15.0 * x[2] - torque(x)) / 0.2;
    dx[3] = (torque(x) - 12.0 * sin(x[1]) - 0.4 * x[3]) / 0.5;
}

static void publish(const Plant *self, double *vars) {
    vars[V_angle] = self->x[1];
    vars[V_torque] = torque(self->x);
}

int plant_init(Plant *self, double *vars) {
    publish(self, vars);
    return PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    static const double at[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    const double d = h / 20.0;
    for (int n = 0; n < 20; n++) {
        double k[4] = {0}, probe[4], sum[4] = {0};
        for (int stage = 0; stage < 4; stage++) {
            for (int i = 0; i < 4; i++) probe[i] = self->x[i] + at[stage] * d * k[i];
            rhs(vars, t + n * d + at[stage] * d, probe, k);
            for (int i = 0; i < 4; i++) sum[i] += weight[stage] * k[i];
        }
        for (int i = 0; i < 4; i++) self->x[i] += d * sum[i];
    }
    publish(self, vars);
    return PLANT_OK;
}

const char *plant_message(const Plant *self) {
    (void)self;
    return "";
}
