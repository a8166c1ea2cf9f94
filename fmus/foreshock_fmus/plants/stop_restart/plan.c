/* The task: a stroke that a stop ends, a pause in which the human reaches in, an announced return. */
#include <math.h>

#include "model.h"

#define PI 3.14159265358979323846

/* Distance of the stroke until time s: a start of half a cosine, then constant speed. */
static double stroke(const double *vars, double s, double *speed, double *acceleration) {
    const double v = vars[V_stroke_speed], rise = vars[V_stroke_rise];
    if (s >= rise) {
        *speed = v, *acceleration = 0.0;
        return v * (s - 0.5 * rise);
    }
    *speed = 0.5 * v * (1.0 - cos(PI * s / rise));
    *acceleration = 0.5 * v * PI / rise * sin(PI * s / rise);
    return 0.5 * v * (s - rise / PI * sin(PI * s / rise));
}

/* Where a fresh brake stops the tool: the stroke until the stop, delay and lag of the brake at full speed, then braking. */
double park_of(const double *vars) {
    double v, a, x = stroke(vars, vars[V_stop_at], &v, &a), force = vars[V_brake_force] + vars[V_friction];
    return x + v * (0.03 + vars[V_brake_lag]) + 0.5 * vars[V_mass] * v * v / force;
}

Plan plan_at(const Plant *self, const double *vars, double t) {
    const double span = vars[V_return_time], lead = vars[V_announce_lead];
    const double into = fmod(t + 1e-9, vars[V_cycle]), stop = vars[V_stop_at], restart = vars[V_restart_at];
    Plan plan = {0};
    plan.into = into;
    plan.stop = into >= stop && into < restart;
    plan.enabled = !plan.stop;
    plan.announced = (into >= restart - lead && into < restart + 0.5) || into >= vars[V_cycle] - lead || into < 0.5;
    if (into < stop) {
        plan.position = stroke(vars, into, &plan.speed, &plan.acceleration);
    } else if (into < restart) {
        plan.position = self->park;
    } else {
        double s = (into - restart) / span, way = -self->return_from;
        if (s >= 1.0) return plan.phase = 1.0, plan.due = vars[V_cycle] - into, plan;
        plan.position = self->return_from + way * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        plan.speed = way * 30.0 * s * s * (1.0 - 2.0 * s + s * s) / span;
        plan.acceleration = way * 60.0 * s * (1.0 - 3.0 * s + 2.0 * s * s) / (span * span);
    }
    plan.phase = plan.stop;
    plan.due = (into < stop ? stop : into < restart ? restart : restart + span) - into;
    return plan;
}
