/* State of the startle plant and what its parts share. Equations and symbols: README.md. */
#ifndef STARTLE_MODEL_H
#define STARTLE_MODEL_H

#include "body.h"
#include "plant.h"
#include "random.h"

#define TICK 0.01 /* s: period of sensors, of the human's random draws and of the ring of measurements */

enum { RING = 64, DELAY = 512 };
enum { S_BASE_X, S_BASE_V, S_HUMAN_X, S_HUMAN_V, S_LOWERED, S_YAW, S_PITCH, S_TIME, S_SIZE };

struct Plant {
    long long step;
    /* robot */
    double x, v, drive, integral, brake, target, held_for;
    int restarted, holding, move, away_from_home;
    double move_from, move_to;
    double act_slow, act_hold;
    /* gaze and attention */
    int looks, works;
    double dwell_end, yaw, attention, called_for, watch_until, wander, threshold_noise;
    /* startle */
    double stimulus, threshold, fired_at, peak, strength, startle_max, acceleration;
    /* balance */
    double u, vu, cop, sway, edge, capture[DELAY], lift_at, land_at;
    int capture_at, steps, stepping, fallen;
    double bench_force, bench_peak, robot_force, robot_peak;
    double ring[RING][S_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[200];
};

/* What the robot's planner and its operators ask for at time t. */
typedef struct {
    double enabled, stop, announced, speed, position, acceleration, phase, due;
} Plan;

Plan plan_at(const Plant *self, const double *vars, double t);
/* robot.c: one internal step of the drive. */
void robot_step(Plant *self, const double *vars, double t);
/* attention.c: gaze, once per tick, and attention, once per internal step. */
void gaze_tick(Plant *self, const double *vars, double t);
void attention_step(Plant *self, const double *vars, double t);
/* reflex.c: stimulus and startle; acceleration that the reflex gives the human now. */
double reflex_step(Plant *self, const double *vars, double t);
/* balance.c: the human as an inverted pendulum between robot and bench. */
void balance_step(Plant *self, const double *vars, double t, double jerk_back);

#endif
