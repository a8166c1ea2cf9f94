/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef CO_CARRY_MODEL_H
#define CO_CARRY_MODEL_H

#include "body.h"
#include "plant.h"
#include "random.h"

#define GRAVITY 9.81
#define TURN 6.283185307179586

enum { ROBOT, PARTNER };
enum { SLOW, HOLD, LOWER, REGRASP, ACTS };
enum { FRAMES = 16, FRAME = V_leg_force - V_sensor_time, PAST = 1024 };

/* What one carrier's hands do: where they want to be, and the force that follows. */
typedef struct { double phase, walk, height, speed, wanted, rate, force, lost; } Carrier;

struct Plant {
    long long step;
    Stream process, sensor;
    Carrier carrier[2];
    double x, z, vz, tilt, rate, content, content_v, bristle, normal; /* load; normal: of the content on its floor, N */
    double plan_phase, cadence_noise, bounce_noise;
    double slip, mean, spread, command, grip, share, overloaded_for;
    double floor[2], leg, leg_peak;
    double act[ACTS], past[ACTS][PAST]; /* what the partner reacts to lies in the past */
    double frame[FRAMES][FRAME];
    long long frames;
    char message[160];
};

static inline double clip(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

/* Height of an end, and its rate; cos(tilt) is taken for 1. */
static inline double end_z(const Plant *self, const double *vars, int who) {
    return self->z + (who == PARTNER ? 0.5 : -0.5) * vars[V_length] * self->tilt;
}
static inline double end_v(const Plant *self, const double *vars, int who) {
    return self->vz + (who == PARTNER ? 0.5 : -0.5) * vars[V_length] * self->rate;
}

void carriers_init(Plant *self, const double *vars);
void carriers_tick(Plant *self, const double *vars, double t, double dt);
void grip_tick(Plant *self, const double *vars, double dt);
void load_tick(Plant *self, const double *vars, double dt);
double load_energy(const Plant *self, const double *vars);
void sensors_sample(Plant *self, const double *vars);

#endif
