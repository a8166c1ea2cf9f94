/* State of the perception plant and what its parts offer each other. */
#ifndef MODEL_H
#define MODEL_H

#include <math.h>

#include "body.h"
#include "random.h"
#include "plant.h"

#define FRAME 0.02  /* s, camera, network and planner */
#define TICK 0.002  /* s, reference of the arm */
#define RING_SIZE 16
#define TABLE_STIFFNESS 50000.0 /* N/m, under the gripper's rubber */

enum { FOREARM, TOOL, THINGS };
enum { PHASE_READY, PHASE_REACH, PHASE_DESCEND, PHASE_GRASP, PHASE_RETURN };
enum { X_PLACE = 0, X_SPEED = 3, X_WORK = 6, X_HEAT, X_SIZE };

/* A function and no macro: the argument may be a draw, and is to be evaluated once. */
static inline double clip(double x, double low, double high) { return x < low ? low : x > high ? high : x; }

/* What the network says of one thing in one frame. share is the evidence for a tool against that for a limb. */
typedef struct {
    double centre[3], confidence, share;
    int seen, as_tool;
} Found;

typedef struct {
    double time, luminance, contrast, sharpness, saturated;
    Found found[THINGS];
} Picture;

typedef struct {
    double contrast, sharpness, luminance, saturated, visibility;
} Image;

struct Plant {
    Stream process, sensor;
    long long step;
    double x[X_SIZE];
    /* light and camera */
    double depth, illumination, exposure;
    int spoilt; /* this frame */
    Image image;
    /* network */
    double noise[THINGS][3];
    Picture ring[RING_SIZE];
    int ring_at;
    /* planner */
    double belief[THINGS], place[THINGS][2], phase_time, lost_time;
    int believed[THINGS], phase, target;
    double goal[3], speed_limit, reference[3], reference_speed[3];
    double slow, held, scaled, withdrawn;
    /* human */
    double sway[2], pulled, warned_time, quiet_time;
    /* contact */
    double contact_time, force_peak, load_peak;
    char message[200];
};

/* The depth of the cause, the lamp and the exposure over one frame; then the image. */
void optics_frame(Plant *self, const double *vars, double t);
Image optics_image(const Plant *self, const double *vars);
/* The network's answer to the present image, into the ring. */
void network_frame(Plant *self, const double *vars, double t);
const Picture *network_newest(const Plant *self, const double *vars);
/* Beliefs, phases and goals, once a frame; the reference, once a tick. */
void planner_frame(Plant *self, const double *vars);
void planner_tick(Plant *self, const double *vars);
/* The human's forearm: its sway, and how it is drawn back from a warning. */
void human_frame(Plant *self, const double *vars);
double forearm_x(const Plant *self, const double *vars);
double forearm_y(const Plant *self, const double *vars);
/* The arm. */
double contact_force(const Plant *self, const double *vars, const double *x);
double contact_energy(const Plant *self, const double *vars, const double *x);
void arm_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]);

#endif
