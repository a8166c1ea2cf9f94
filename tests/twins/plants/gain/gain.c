#include "plant.h"

struct Plant {
    double last;
};

const size_t plant_size = sizeof(struct Plant);

static void publish(const Plant *self, double *vars) {
    vars[V_y] = vars[V_k] * vars[V_u] + vars[V_b];
    vars[V_kept] = self->last;
    vars[V_unsaid] = vars[V_length_mm] = 0.0;
    vars[V_seen_seed] = vars[V_seed];
}

int plant_init(Plant *self, double *vars) {
    publish(self, vars);
    return PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    (void)t, (void)h;
    publish(self, vars);
    self->last = vars[V_u];
    return PLANT_OK;
}

const char *plant_message(const Plant *self) {
    (void)self;
    return "";
}
