/* State of the stop-restart plant and what its parts share. Equations and symbols: README.md. */
#ifndef STOP_RESTART_MODEL_H
#define STOP_RESTART_MODEL_H

#include "body.h"
#include "plant.h"
#include "random.h"

#define TICK 0.01 /* s: period of sensors, of random draws and of the ring of measurements */
#define PATH 0.75 /* share of the reach from which the hand is in the tool's way */

enum { RING = 64 };
enum { S_ANGLE, S_RATE, S_EFFORT, S_HAND_X, S_HAND_Y, S_HAND_Z, S_HUMAN_Y, S_YAW, S_PITCH, S_TIME, S_SIZE };

struct Plant {
    long long step;
    /* axis */
    double x, v, drive, integral, brake_on, brake, force_noise;
    double set_point, park, stopped, return_from, safe_for, hold_for;
    int cycle, regained, frozen;
    double act_slow;
    /* hand */
    double reaction, dwell, called_for, in, in_rate, hand, hand_v;
    double hand_force, hand_peak, fixture_force, clamped_for, clamped;
    double look_aside;
    double ring[RING][S_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[200];
};

/* What the planner and the operators ask for at time t. */
typedef struct {
    double enabled, stop, announced, position, speed, acceleration, phase, due, into;
} Plan;

Plan plan_at(const Plant *self, const double *vars, double t);
double park_of(const double *vars);
/* axis.c: one internal step of drive, brakes and tool. */
void axis_step(Plant *self, const double *vars, double t);
/* hand.c: draws once per tick; the reach and the contact once per internal step. */
void hand_tick(Plant *self, const double *vars, double t);
void hand_step(Plant *self, const double *vars, double t);

#endif
