/* State of the plant and what its parts share. Equations and symbols: README.md. */
#ifndef CROSSING_MODEL_H
#define CROSSING_MODEL_H

#include "plant.h"
#include "random.h"

enum { X_RX, X_RY, X_RVX, X_RVY, X_HX, X_HY, X_HVX, X_HVY, X_SIZE };
enum { RING_SIZE = 64, RAYS = 21, PATH_SIZE = 14, ODOMETRY_SIZE = 4, PERSON_SIZE = 8 };
enum { SENSOR_DRAWS = 9 };

#define PATH_STEP 0.25   /* s between points of the planned path */
#define TRACK_GAIN 1.2   /* 1/s, lateral velocity per lateral error of the robot's path */
#define SEEN_LEAST 0.15  /* visible share below which the camera finds nobody */

typedef struct { double time, odometry[ODOMETRY_SIZE], seen, person[PERSON_SIZE]; } Record;

struct Plant {
    double x[X_SIZE];
    long long step;
    double command;              /* m/s, speed that the robot took up at its last footfall */
    double next_footfall;        /* s */
    double wander[2];            /* m/s2, the human's own unrest, Ornstein-Uhlenbeck */
    double sway[2];              /* m/s2, of the robot's walk */
    double reaction, hearing;    /* s and share, drawn once */
    double announced_at;         /* s, below 0: not yet */
    int aware;
    int yielding;
    double peak, contact_speed;
    Record ring[RING_SIZE];
    int ring_at, ring_fill;
    Stream process, sensor;
    char message[200];
};

/* sight.c: share of the human's outline that the camera sees, 0..1. */
double sight_share(const double *vars, double cx, double cy, double hx, double hy);

/* human.c */
void human_start(Plant *self, const double *vars);
void human_tick(Plant *self, const double *vars, double t, double tick_s);
void human_wish(const Plant *self, const double *vars, const double x[X_SIZE], double a[2]);

/* robot.c */
void robot_start(Plant *self, const double *vars);
void robot_tick(Plant *self, const double *vars, double t, double tick_s);
void robot_wish(const Plant *self, const double *vars, const double x[X_SIZE], double a[2]);
double robot_goal_speed(const double *vars);

/* contact.c: force on the human along the line from robot to human; overlap is negative when apart. */
double contact_force(const double *vars, const double x[X_SIZE], double n[2], double *closing);

/* sensors.c */
void sensors_sample(Plant *self, const double *vars, double t);
void sensors_publish(Plant *self, double *vars, double t);

#endif
