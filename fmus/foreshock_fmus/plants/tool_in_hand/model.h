/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef TOOL_IN_HAND_MODEL_H
#define TOOL_IN_HAND_MODEL_H

#include "plant.h"
#include "random.h"

#define TICK 0.001 /* s, period of the wrist's drive and of the process noise */
#define WRIST_X 0.35 /* m, wrist in odom while the arm is at the surface */
#define WRIST_Z 1.05 /* m */

/* Arm beyond the surface and its rate, tool axis and its rate, spindle speed, integral of its loop, forearm and its rate. */
enum { X_ADVANCE, X_ADVANCE_RATE, X_ANGLE, X_ANGLE_RATE, X_SPINDLE, X_INTEGRAL, X_HUMAN, X_HUMAN_RATE, X_SIZE };
enum { ACT_HOLD, ACT_OFF, ACT_REORIENT, ACT_SLOW, ACT_SIZE };
enum { RING_SIZE = 64 };
enum { S_TIME, S_TIP, S_YAW = S_TIP + 3, S_SPEED, S_RATE = S_SPEED + 3, S_FORCE = S_RATE + 3, S_MOMENT = S_FORCE + 3,
       S_EXPECTED_FORCE = S_MOMENT + 3, S_EXPECTED = S_EXPECTED_FORCE + 1, S_HUMAN, S_HAND = S_HUMAN + 2,
       S_SPINDLE = S_HAND + 3, S_SIZE };

/* What acts at one instant. */
typedef struct {
    double depth, normal, tangential; /* workpiece on the disc */
    double wrist, asked;              /* wrist on the tool, and what its impedance asks for, N m */
    double motor;                     /* motor less brake on the spindle, N m */
    double human;                     /* tool on the forearm, N */
    double angle_acceleration;
    int off_edge;
} Forces;

struct Plant {
    double x[X_SIZE];
    double set_point, feed, angle_set, angle_set_rate, forward, overload, rough, sway, peak, cut_speed;
    int faulted;
    long long step; /* internal steps since the start */
    double act[ACT_SIZE];
    double ring[RING_SIZE][S_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[160];
};

/* dynamics.c */
double wear_at(const double *vars, double t);
double rim_sign(const double *vars, double spindle);
void rhs(const Plant *self, const double *vars, double t, const double *x, double *dx, Forces *f);
double forearm_gap(const Plant *self, const double *vars, const double *x);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
