/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef BALANCE_MODEL_H
#define BALANCE_MODEL_H

#include "plant.h"
#include "random.h"
#include "talos.h"

#define GRAVITY 9.81

/* From Pinocchio's centroidal momentum of talos.c's motion, half_sitting (tests/fmus/test_balance_plant_talos.py):
 * L_x = I roll' + FOOT_MASS h TALOS_MASS / BODY_MASS (v_left + v_right - 2 v_com) + J(left) left' - J(right) right',
 * I = TRUNK_INERTIA + ARM_SPREAD (left + right - 2 start), J(arm) = ARM_MOMENT + ARM_MOMENT_SLOPE (arm - start). */
#define FOOT_MASS 5.411       /* kg, of a leg felt at its foot */
#define TRUNK_INERTIA 7.622   /* kg m2 */
#define ARM_SPREAD 2.226      /* kg m2/rad */
#define ARM_MOMENT 0.398      /* kg m2 */
#define ARM_MOMENT_SLOPE 1.25 /* kg m2/rad */
#define BODY_MASS (TALOS_MASS - 2.0 * FOOT_MASS)
#define WEIGHT (TALOS_MASS * GRAVITY)

enum { X_Y, X_V, X_ROLL, X_RATE, X_COP, X_TORQUE, X_YL, X_VL, X_ZL, X_YR, X_VR, X_ZR, X_AL, X_WL, X_AR, X_WR, X_SIZE };
enum { T_TURN, T_TURN_RATE, T_ROLL, T_ROLL_RATE, T_LENGTH, T_LENGTH_RATE, T_HUMAN, T_HUMAN_RATE, T_SIZE };
enum { STAGE_STANDING, STAGE_TIPPING, STAGE_DOWN };
enum { MODE_STEPPING, MODE_LANDING, MODE_BOTH };
enum { ACT_LOCK, ACT_ARMS, ACT_COMPLIANCE, ACT_MITIGATION, ACT_SIZE };
enum { DELAY_SIZE = 256, RING_SIZE = 64, IMU_SIZE = 10, WRENCH_SIZE = 12, HUMAN_SIZE = 3 };
enum { S_Q = 0, S_V = TALOS_NQ, S_IMU = S_V + TALOS_NV, S_WRENCH = S_IMU + IMU_SIZE, S_HUMAN = S_WRENCH + WRENCH_SIZE,
       S_TIME = S_HUMAN + HUMAN_SIZE, S_SIZE };

typedef struct { double start, span, z0, v0, a0, z1; } Lift; /* quintic from (z0, v0, a0) to (z1, 0, 0) */
typedef struct { double xi, y, roll, rate, foot_v; } Measurement;
typedef struct { double cop, dcm, com; } Reference;

/* What the contacts do at one instant. */
typedef struct {
    double cop, share, low, high, load, hip, force_left, force_right, com_acceleration, human_force;
} Contact;

struct Plant {
    double x[X_SIZE], dx[X_SIZE];
    double fall[T_SIZE], dfall[T_SIZE];
    double fall_q[TALOS_NQ], fall_edge, fall_side, fall_start, fall_length;
    int stage, mode;
    long long step;       /* number of internal steps since the start */
    long long gait_step;  /* number of the step under way */
    int left_down, right_down;
    double gait_amplitude, gait_sign, landing_at;
    Lift lift[2];
    double touchdown[2];  /* where the feet were set down, m */
    double slip[2];
    double act[ACT_SIZE];
    double cop_command, torque_command, estimate_v, dcm_noise, push, footfall, footfall_end;
    double mu[2];
    Measurement delay[DELAY_SIZE];
    int delay_at;
    double ring[RING_SIZE][S_SIZE];
    int ring_at, ring_fill;
    double contact_peak, human_v;
    int fallen;
    Stream process, sensor;
    char message[200];
};

/* Reference of stepping in place at time t within the gait, all relative to the middle of the feet. */
Reference gait_reference(double w, double inset_half_stance, double single_s, double both_s, double u);
double dcm_rate(void); /* w, 1/s */

double lift_height(const Lift *lift, double t, double *rate, double *acceleration);
void lift_plan(Lift *lift, double t, double span, double target);

/* control.c: one tick of the robot's own balance controller and its gait machine. */
void gait_tick(Plant *self, const double *vars, double t);
void control_tick(Plant *self, const double *vars, double t, double tick_s);

/* dynamics.c */
void standing_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE], Contact *contact);
double com_of(const double x[X_SIZE]);
double com_rate_of(const double x[X_SIZE]);

/* fall.c */
int fall_begins(const Plant *self, const double *vars);
void fall_start(Plant *self, const double *vars, double t);
void fall_rhs(const Plant *self, const double *vars, const double f[T_SIZE], double df[T_SIZE], Contact *contact);
void fall_after_step(Plant *self, const double *vars);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
