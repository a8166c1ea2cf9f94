/* What is measured: encoder, motor current, the command, the loop's own clock; with noise, late by a ring. */
#include <math.h>

#include "model.h"

static double noisy(Plant *self, double value, double sd) { return value + sd * stream_normal(&self->sensor); }

/* Measure at time t. The number of draws is fixed, so that the sensor stream does not depend on what happens. */
void sensors_sample(Plant *self, const double *vars, double t) {
    self->ring_at = (self->ring_at + 1) % RING_SIZE;
    if (self->ring_fill < RING_SIZE) self->ring_fill++;
    double *s = self->ring[self->ring_at];
    s[S_TIME] = t;
    s[S_ANGLE] = noisy(self, self->x[X_ARM], vars[V_encoder_noise]);
    s[S_RATE] = noisy(self, self->x[X_ARM_RATE], vars[V_rate_noise]);
    s[S_EFFORT] = noisy(self, joint_torque(vars, self->current), vars[V_effort_noise]);
    s[S_WANTED] = self->wanted;
    s[S_DUE] = self->due.angle;
    s[S_DUE_RATE] = self->due.rate;
    s[S_ROUND_TRIP] = self->round_trip;
    s[S_VOLTS] = noisy(self, self->x[X_VOLTS], vars[V_volts_noise]);
    s[S_HEAT] = noisy(self, self->x[X_HEAT], vars[V_heat_noise]);
}

void sensors_publish(Plant *self, double *vars, double t) {
    int at = self->ring_at;
    for (int age = 1; age < self->ring_fill && self->ring[at][S_TIME] > t - vars[V_latency] + 1e-9; age++)
        at = (at + RING_SIZE - 1) % RING_SIZE;
    const double *s = self->ring[at];
    vars[V_sensor_time] = s[S_TIME];
    vars[V_joint_position] = s[S_ANGLE];
    vars[V_joint_velocity] = s[S_RATE];
    vars[V_joint_effort] = s[S_EFFORT];
    vars[V_command_effort] = s[S_WANTED];
    vars[V_command_position] = s[S_DUE];
    vars[V_command_velocity] = s[S_DUE_RATE];
    vars[V_round_trip] = s[S_ROUND_TRIP];
    vars[V_bus_voltage] = s[S_VOLTS];
    vars[V_winding_temperature] = s[S_HEAT];
    vars[V_heartbeat] = floor(t / vars[V_heartbeat_period] + 1e-6);
}
