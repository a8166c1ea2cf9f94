#include <math.h>
#include <signal.h>

#include "plant.h"

enum { NONE, ERROR, DISCARD, NOT_A_NUMBER, HANG, SEGFAULT, ERROR_AT_INIT };

struct Plant {
    double count;
};

const size_t plant_size = sizeof(struct Plant);

int plant_init(Plant *self, double *vars) {
    vars[V_count] = self->count;
    return vars[V_behaviour] == ERROR_AT_INIT ? PLANT_ERROR : PLANT_OK;
}

int plant_step(Plant *self, double *vars, double t, double h) {
    const int behaviour = t + 0.5 * h < vars[V_from] ? NONE : (int)vars[V_behaviour];
    volatile double keep = 0.0;
    switch (behaviour) {
    case ERROR: return PLANT_ERROR;
    case DISCARD: return PLANT_DISCARD;
    case HANG:
        for (;;) keep = keep + 1.0;
    case SEGFAULT: raise(SIGSEGV);
    }
    self->count += 1.0;
    vars[V_count] = behaviour == NOT_A_NUMBER ? nan("") : self->count;
    return PLANT_OK;
}

const char *plant_message(const Plant *self) {
    return self->count < 1.0 ? "rogue: 100%% refused before the first step" : "rogue: refused, 100% on purpose";
}
