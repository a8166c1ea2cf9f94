/* State of the actuator-chain plant and what its parts share. Equations and symbols: README.md. */
#ifndef ACTUATOR_CHAIN_MODEL_H
#define ACTUATOR_CHAIN_MODEL_H

#include "body.h"
#include "plant.h"
#include "random.h"

#define GRAVITY 9.81
#define CYCLE 0.005 /* s, period of the robot's whole-body control */
#define CLIP(x, a, b) ((x) < (a) ? (a) : (x) > (b) ? (b) : (x))

enum { X_MOTOR, X_MOTOR_RATE, X_ARM, X_ARM_RATE, X_VOLTS, X_HEAT, X_SIZE };
enum { RING_SIZE = 64, DELAY_SIZE = 64, S_TIME = 0, S_ANGLE, S_RATE, S_EFFORT, S_WANTED, S_DUE, S_DUE_RATE, S_ROUND_TRIP,
       S_VOLTS, S_HEAT, S_SIZE };

typedef struct { double angle, rate, acceleration; } Due;

struct Plant {
    double x[X_SIZE];
    double phase, pace;            /* of the task, s and 1 */
    Due due;                       /* what the plan asks for now */
    double wanted, current;        /* torque command, N m at the joint; motor current, A */
    double backlog, round_trip;    /* s: control work that waits; from measurement to command */
    double bound;                  /* share of the last cycles in which the limit bound */
    double hand_off;               /* m, the human's hand off its place */
    double derate, stop;           /* strengths after their rise */
    double braking, brake_at;      /* s since the brakes were asked for; where they hold */
    int braked;
    double force_peak;
    long long step;
    double measured[DELAY_SIZE][2];
    int measured_at;
    double ring[RING_SIZE][S_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[160];
};

/* chain.c: supply, motor, gear, arm, and the hand under it. */
void chain_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]);
double current_limit(const double *vars, const double *x); /* A, what supply and winding allow */
double joint_torque(const double *vars, double current);   /* N m at the joint, before friction */
double weight_torque(const double *vars, double angle);    /* N m that holds arm and payload */
double arm_inertia(const double *vars);
double contact_force(const Plant *self, const double *vars, const double *x);
double chain_energy(const Plant *self, const double *vars, const double *x);
double supply_volts(const double *vars, double t);         /* open circuit */
void brake_slip(Plant *self, const double *vars);

/* control.c */
void plan(Plant *self, const double *vars, double h);
void control_cycle(Plant *self, const double *vars);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
