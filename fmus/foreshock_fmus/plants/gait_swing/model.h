/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef GAIT_SWING_MODEL_H
#define GAIT_SWING_MODEL_H

#include "plant.h"
#include "random.h"

#define GRAVITY 9.81

/* A leg of talos_reduced.urdf in its own plane: thigh (leg_*_3), shank (leg_*_4), ankle and foot (leg_*_5, leg_*_6) as a
 * point at the ankle. Centres and inertias about the axes across the plane. */
#define THIGH_LENGTH 0.38
#define THIGH_MASS 6.827
#define THIGH_CENTRE 0.1728
#define THIGH_INERTIA 0.1084
#define SHANK_LENGTH 0.325
#define SHANK_MASS 3.637
#define SHANK_CENTRE 0.1206
#define SHANK_INERTIA 0.0293
#define FOOT_MASS 2.849
#define HIP_BREADTH 0.085   /* m, hip-roll axis from the middle */
#define SOLE_HEEL 0.06      /* m, straight sides of the sole behind the ankle */
#define SOLE_TOE 0.08       /* m, and before it */
#define SOLE_HALF 0.06      /* m, half breadth, and radius of its round ends */
#define CAPTURE_RATE 3.14   /* 1/s, of TALOS: sqrt(g m_b / (m h)), plants/balance/README.md */

enum { L_PITCH, L_SHANK, L_ROLL, L_PITCH_RATE, L_SHANK_RATE, L_ROLL_RATE, L_SIZE }; /* rad; shank is its angle to the vertical */
enum { X_LEG = 0, X_PELVIS = L_SIZE, X_PELVIS_V, X_SIZE };
enum { PHASE_SWING, PHASE_BOTH, PHASE_STAND, PHASE_FREE };
enum { LEFT, RIGHT };
enum { AXIS_X, AXIS_OUT, AXIS_LIFT, AXES, TERMS = 7 };
enum { RING_SIZE = 64, FEET_SIZE = 12, BASE_SIZE = 2, PERSON_SIZE = 4, SENSOR_DRAWS = FEET_SIZE + BASE_SIZE + PERSON_SIZE };
enum { TICK_DRAWS = 6, PATH_SIZE = 16 };
#define PATH_STEP 0.2       /* s between points of the planned path */

typedef struct { double time, feet[FEET_SIZE], base[BASE_SIZE], person[PERSON_SIZE]; } Record;

/* The swing foot's plan: polynomials in the time since start; outward is measured from the hip. */
typedef struct { double start, end, goal, c[AXES][TERMS]; } Plan;

/* Where a foot is: ankle in the world, x, y and lift (m), and its velocity. */
typedef struct { double p[3], v[3]; } Foot;

struct Plant {
    double x[X_SIZE];
    double torque[3];         /* N m, hip pitch, knee, hip roll; held for a tick */
    double pelvis_a;          /* m/s2, held for a tick */
    long long step;
    int phase, swing;         /* the leg that swings, or swung last */
    double phase_end;         /* s, of double support */
    double placed[2][2];      /* where each foot stands: x, and outward of its hip's line */
    double scale;             /* of the step under way */
    int suppressed;
    Plan plan;
    double human_y, human_v, human_target, sway;
    double reaction, hearing, announced_at;
    double noise[3];          /* N m, process */
    double peak, held, held_longest, drift;
    Stream process, sensor;
    Record ring[RING_SIZE];
    int ring_at, ring_fill;
    char message[200];
};

/* leg.c: the double pendulum under a hip that rolls, in the frame of the pelvis. */
typedef struct { double m11, m12, m22, roll, bias[3]; } LegTerms; /* M q'' + bias = generalised force */
void leg_terms(const double q[L_SIZE], double slope, double pelvis_a, LegTerms *terms);
void leg_forces(const double torque[3], double force_x, double force_out, const double q[L_SIZE], double out[3]);
double leg_energy(const double q[L_SIZE], double slope);
void leg_foot(const double q[L_SIZE], double hip_height, double p[3], double v[3]); /* x, outward, lift, from the hip */
void leg_solve(double x, double outward, double down, double q[3]);

/* gait.c */
double gait_speed(const double *vars);
void gait_start(Plant *self, const double *vars);
void gait_tick(Plant *self, const double *vars, double t, const double draw[TICK_DRAWS]);
void gait_torques(Plant *self, const double *vars, double t);
void plan_at(const Plan *plan, double t, double p[AXES], double v[AXES]);
Foot foot_now(const Plant *self, const double *vars, int side);
Foot foot_planned(const Plant *self, int side, double t);

/* contact.c: force of the human's lower legs on the swing foot, world x and y (N); returns its magnitude. */
double contact_force(const Plant *self, const double *vars, const double x[X_SIZE], double force[2], double *clearance);
double pull_force(const Plant *self, const double *vars, double t);
double meet_time(const double *vars);

/* human.c */
void human_start(Plant *self, const double *vars);
void human_tick(Plant *self, const double *vars, double t, double tick_s, double draw);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
