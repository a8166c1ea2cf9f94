/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef HANDOVER_MODEL_H
#define HANDOVER_MODEL_H

#include "body.h"
#include "plant.h"
#include "random.h"

#define GRAVITY 9.81
#define FAR (-0.3)       /* m, where the gripper is when it does not offer */
#define REST 0.55        /* m, where the partner's hand is when it does not reach */
#define CLEARANCE 0.05   /* m, between jaws and fingertips of an ordinary grasp */
#define FINGER 0.015     /* m, thickness of a finger */
#define WIDE 0.08        /* m, between open jaws */
#define EMPTY 0.004       /* m, jaws closer than this hold nothing */
#define CARRIES_N 5.0    /* N, grip force below which letting go is not taken back */

enum { PRESENT, TRANSFER, RETREAT, WITHDRAW };          /* the robot's plan */
enum { RESTING, REACHING, PULLING, TAKING };            /* the partner */
enum { RING = 256, FRAMES = 16, FRAME = V_pinch_force - V_sensor_time };

typedef struct { double value[RING]; int at; } Delay;

struct Plant {
    long long step, cycle;
    double t, tau; /* s since the cycle began: of the world, and of the plan, which waits while held */
    Stream process, sensor;
    /* the robot */
    int phase, releasing, open, lost;
    double since, pulled; /* s: when the phase began; how long pulled */
    double x_s, x_a, v_a, x_r, v_r;
    double gap, gap_v, motor, closing; /* m between the jaws, m/s; the motor's place as a gap, its closing speed */
    double command, felt, load_filtered, pull_filtered, reflex, confirmed, withdraw_from;
    Delay wrench, grip;
    /* object and partner */
    int in_jaws, slips, dropped, stage, came;
    double x_o, v_o, object_seen, z_r, z_h, z_f;
    double x_h, v_h, x_eq, hold, effort, advance, tremor, arrival, pull_from;
    /* what the contacts do now */
    double normal, pull, hand_pull, finger_pull, arm, weight, pinch, pinch_for, pinch_ratio;
    long long handed_over;
    double act[3];
    double frame[FRAMES][FRAME];
    long long frames;
    char message[160];
};

/* Minimum-jerk way from 0 to 1 (Flash and Hogan, 1985). */
static inline double min_jerk(double s) {
    s = s < 0.0 ? 0.0 : s > 1.0 ? 1.0 : s;
    return s * s * s * (10.0 + s * (6.0 * s - 15.0));
}

static inline double clip(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

static inline double finger_depth(const Plant *self) { return self->x_r - (self->x_h - self->advance); }

void contact_tick(Plant *self, const double *vars, double dt);
void partner_cycle(Plant *self, const double *vars);
void partner_tick(Plant *self, const double *vars, double dt);
void robot_cycle(Plant *self);
void robot_tick(Plant *self, const double *vars, double dt);
void sensors_sample(Plant *self, const double *vars);

#endif
