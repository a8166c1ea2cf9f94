/* State of the arm-strike plant and what its parts share. Equations and symbols: README.md. */
#ifndef ARM_STRIKE_MODEL_H
#define ARM_STRIKE_MODEL_H

#include "body.h"
#include "plant.h"
#include "random.h"

#define GRAVITY 9.81
#define TICK 0.002 /* s, period of the robot's own controller */
#define CLIP(x, a, b) ((x) < (a) ? (a) : (x) > (b) ? (b) : (x))

enum { LEGS, TRUNK, UPPER, FORE, LINKS };
enum { X_ANGLE = 0, X_RATE = LINKS, X_HUMAN = 2 * LINKS, X_HUMAN_RATE, X_SIZE };
enum { ANKLE, HIP, SHOULDER, ELBOW, JOINTS };
enum { RING_SIZE = 64, DELAY_SIZE = 64, S_TIME = 0, S_JOINT = 1, S_JOINT_RATE = 5, S_TILT = 9, S_GYRO = 12, S_SPECIFIC = 15,
       S_HAND = 18, S_HAND_RATE = 21, S_HUMAN = 24, S_HUMAN_RATE, S_SIZE };

typedef struct { double angle[LINKS], rate[LINKS]; } Posture; /* absolute, from the vertical, forwards positive */

typedef struct { double x, z, vx, vz; } Point;

struct Plant {
    double x[X_SIZE];
    double torque[JOINTS];    /* of the joint, on the link above it */
    double excess;            /* m, CoP command that the foot cannot give */
    double balance_noise, sway_force, push;
    double soften, withdraw;  /* strengths after their rise */
    double force_peak, use_peak, strike_speed, touch_height;
    int touching;
    int tipping, down;
    long long step;
    Posture delay[DELAY_SIZE];
    int delay_at;
    double ring[RING_SIZE][S_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[160];
};

/* chain.c: four links on the ankle, the hands at the tip of the last, and the human. */
void chain_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]);
Point chain_com(const double *vars, const double *angle, const double *rate);
Point chain_hand(const double *vars, const double *angle, const double *rate);
double chain_energy(const double *vars, const double *x);
double chain_mass(const double *vars);
double first_moment(const double *vars, int link); /* b_i, kg m: gravity's torque on link i is b_i g sin(angle) */
double contact_force(const Plant *self, const double *vars, const double *x);
double contact_limit(const Plant *self, const double *vars); /* N, transient, of the region that the hands are level with */
const BodyRegion *region_at(double height);

/* control.c */
void task(const Plant *self, const double *vars, double t, double *position, double *velocity); /* plan, per joint */
void control_tick(Plant *self, const double *vars, double t);
void disturb(Plant *self, const double *vars, double t);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
