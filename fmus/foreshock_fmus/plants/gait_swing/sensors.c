/* What the robot measures: its feet by joint encoders, its pelvis, and the human by a camera. */
#include <string.h>

#include "model.h"

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    double z[SENSOR_DRAWS];
    for (int i = 0; i < SENSOR_DRAWS; i++) z[i] = stream_normal(&self->sensor);
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    Record *r = &self->ring[self->ring_at];
    r->time = t;
    for (int side = 0; side < 2; side++) {
        const Foot foot = foot_now(self, vars, side);
        for (int i = 0; i < 3; i++) {
            r->feet[6 * side + i] = foot.p[i] + vars[V_foot_noise] * z[6 * side + i];
            r->feet[6 * side + 3 + i] = foot.v[i] + vars[V_foot_rate_noise] * z[6 * side + 3 + i];
        }
    }
    const double *own = z + FEET_SIZE, *other = own + BASE_SIZE;
    r->base[0] = self->x[X_PELVIS] + vars[V_base_noise] * own[0];
    r->base[1] = self->x[X_PELVIS_V] + vars[V_base_rate_noise] * own[1];
    r->person[0] = vars[V_human_x] + vars[V_human_noise] * other[0];
    r->person[1] = self->human_y + self->sway + vars[V_human_noise] * other[1];
    r->person[2] = vars[V_human_rate_noise] * other[2];
    r->person[3] = self->human_v + vars[V_human_rate_noise] * other[3];
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
    memcpy(vars + V_left_foot, own->feet, FEET_SIZE * sizeof *vars);
    memcpy(vars + V_base_x, own->base, BASE_SIZE * sizeof *vars);
    memcpy(vars + V_human_px, camera->person, PERSON_SIZE * sizeof *vars);
    const Foot left = foot_planned(self, LEFT, t), right = foot_planned(self, RIGHT, t);
    memcpy(vars + V_left_plan, left.p, sizeof left.p), memcpy(vars + V_left_plan_rate, left.v, sizeof left.v);
    memcpy(vars + V_right_plan, right.p, sizeof right.p), memcpy(vars + V_right_plan_rate, right.v, sizeof right.v);
    vars[V_support_left] = !(self->phase == PHASE_SWING && self->swing == LEFT);
    vars[V_support_right] = !(self->phase == PHASE_SWING && self->swing == RIGHT);
    const int stands = self->suppressed || self->phase == PHASE_STAND || self->phase == PHASE_FREE;
    const double speed = stands ? 0.0 : self->scale * gait_speed(vars);
    vars[V_plan_speed] = speed;
    for (int i = 0; i < PATH_SIZE; i++) {
        vars[V_path_x + i] = self->x[X_PELVIS] + speed * PATH_STEP * i;
        vars[V_path_y + i] = 0.0;
        vars[V_path_time + i] = PATH_STEP * i;
    }
}
