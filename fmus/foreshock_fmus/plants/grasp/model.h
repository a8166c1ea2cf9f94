/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef GRASP_MODEL_H
#define GRASP_MODEL_H

#include "plant.h"
#include "random.h"

#define GRAVITY 9.80665
#define TICK 0.001 /* s, period of the wrist controller and of the process noise */

/* Wrist angle and rate, object's tilt and rate, slide of the object and rate, bristles of the pads in shear (m) and torsion
 * (rad), wrist torque, normal force of a pad, heat of the gripper's motor, arm lowered by and its speed. */
enum {
    X_WRIST, X_WRIST_RATE, X_TILT, X_TILT_RATE, X_SLIDE, X_SLIDE_RATE, X_SHEAR, X_TWIST, X_TORQUE, X_NORMAL, X_HEAT,
    X_LOWERED, X_LOWER_RATE, X_SIZE
};
enum { STAGE_HELD, STAGE_FALLING, STAGE_DOWN };
enum { ACT_REGRASP, ACT_LOWER, ACT_SLOW, ACT_SIZE };
enum { DELAY_SIZE = 64, RING_SIZE = 64 };
enum { S_TIME, S_NORMAL, S_TANGENTIAL, S_ACCELERATION, S_GYRO, S_SPECIFIC = S_GYRO + 3, S_PITCH = S_SPECIFIC + 3, S_FORCE,
       S_MOMENT, S_PLACE, S_TILT = S_PLACE + 3, S_SIZE = S_TILT + 3 };

/* What acts at one instant. */
typedef struct {
    double tangential, twist; /* pads on the object: N upwards, N m */
    double support;           /* support on the object, N */
    double gripper;           /* acceleration of the gripper at the pads, m/s2 upwards */
    double use;               /* load of the pads over their limit surface */
    double mass;
} Forces;

typedef struct { double angle, rate, acceleration; } Measurement;

struct Plant {
    double x[X_SIZE];
    double fall_height, fall_rate, fall_start, fall_mass, peak;
    int stage, landed, hot;
    long long step;         /* internal steps since the start */
    long long footfall;     /* number of the footfall under way */
    double footfall_peak;   /* of that one, relative to the mean */
    double slip_speed;      /* of the pads, lagged by their memory */
    double torque_command, force_command, tremor, hand;
    double act[ACT_SIZE];
    Measurement delay[DELAY_SIZE];
    int delay_at;
    double ring[RING_SIZE][S_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[160];
};

/* dynamics.c */
double mass_at(const double *vars, double t);
double com_rate(const double *vars, double t, const double *x); /* upwards, less the hand's by walking */
void held_rhs(const Plant *self, const double *vars, double t, const double *x, double *dx, Forces *f);
void return_mapping(Plant *self, const double *vars);
double falling_force(const Plant *self, const double *vars);
void falling_step(Plant *self, const double *vars);

/* motion.c */
double hand_acceleration(const Plant *self, const double *vars, double t);
void control_tick(Plant *self, const double *vars, double t);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
