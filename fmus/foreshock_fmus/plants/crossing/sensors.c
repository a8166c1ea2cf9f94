/* What the robot measures: its own odometry, and the human by a camera that must see him. */
#include <math.h>
#include <string.h>

#include "model.h"

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    const double *x = self->x;
    double z[SENSOR_DRAWS];
    for (int i = 0; i < SENSOR_DRAWS; i++) z[i] = stream_normal(&self->sensor);
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    Record *r = &self->ring[self->ring_at];
    r->time = t;
    r->odometry[0] = x[X_RX] + vars[V_odometry_noise] * z[0], r->odometry[1] = x[X_RY] + vars[V_odometry_noise] * z[1];
    r->odometry[2] = x[X_RVX] + vars[V_speed_noise] * z[2], r->odometry[3] = x[X_RVY] + vars[V_speed_noise] * z[3];
    const double share = sight_share(vars, x[X_RX], x[X_RY], x[X_HX], x[X_HY]);
    const double dx = x[X_HX] - x[X_RX], dy = x[X_HY] - x[X_RY], range = sqrt(dx * dx + dy * dy);
    const double least = fmax(share, SEEN_LEAST), noise = vars[V_human_noise] / least; /* half a human is placed half as well */
    r->seen = share >= SEEN_LEAST && range < vars[V_camera_range] && fabs(atan2(dy, dx)) < vars[V_camera_half_view];
    r->person[0] = x[X_HX] + noise * z[4], r->person[1] = x[X_HY] + noise * z[5];
    r->person[2] = x[X_HVX] + vars[V_human_speed_noise] / least * z[6];
    r->person[3] = x[X_HVY] + vars[V_human_speed_noise] / least * z[7];
    r->person[4] = noise;
    r->person[5] = share;
    r->person[6] = fmin(1.0, fmax(0.0, vars[V_confidence] * sqrt(share) + 0.02 * z[8]));
    r->person[7] = atan2(x[X_HVY], x[X_HVX]);
}

static const Record *aged(const Plant *self, double newest) {
    int back = 0;
    for (; back < self->ring_fill - 1; back++)
        if (self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE].time <= newest + 1e-9) break;
    return &self->ring[(self->ring_at + RING_SIZE - back) % RING_SIZE];
}

void sensors_publish(Plant *self, double *vars, double t) {
    const Record *own = aged(self, t - vars[V_latency]), *camera = aged(self, t - vars[V_camera_latency]);
    vars[V_sensor_time] = own->time;
    vars[V_camera_time] = camera->time;
    memcpy(vars + V_robot_x, own->odometry, ODOMETRY_SIZE * sizeof *vars);
    vars[V_human_seen] = camera->seen;
    memcpy(vars + V_human_x, camera->person, PERSON_SIZE * sizeof *vars);
    const double goal = robot_goal_speed(vars);
    for (int i = 0; i < PATH_SIZE; i++) {
        const double ahead = i * PATH_STEP;
        vars[V_path_x + i] = self->x[X_RX] + goal * ahead; /* as planned: that a stop takes steps is the supervisor's to know */
        vars[V_path_y + i] = vars[V_replan] * vars[V_replan_offset];
        vars[V_path_time + i] = ahead;
    }
}
