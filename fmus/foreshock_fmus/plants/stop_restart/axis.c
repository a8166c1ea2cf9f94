/* The axis: position loop with integrator, brake that fades, second brake of the protective stop, Coulomb friction. */
#include <math.h>

#include "model.h"

static double limit(double x, double most) { return x > most ? most : x < -most ? -most : x; }

/* Drive off while it stops (category 1), then monitored by its position loop against the brake (category 2). */
static double drive_of(Plant *self, const double *vars, const Plan *plan, double h) {
    const double most = vars[V_drive_force] * (1.0 - vars[V_slow_share] * self->act_slow);
    const double off_at = vars[V_stop_at] + vars[V_stop_delay];
    const int stopping = plan->stop > 0.5 && plan->into >= off_at;
    if (stopping && plan->into < vars[V_stop_at] + vars[V_regain_delay]) {
        self->integral = 0.0;
        self->regained = 0;
        return 0.0;
    }
    if (stopping && !self->regained) self->regained = 1, self->stopped = self->x;
    double goal = plan->position, speed = plan->speed, feed = vars[V_mass] * plan->acceleration;
    if (plan->stop > 0.5 && !stopping) { /* the stop has not reached the drive yet: the stroke goes on */
        goal = self->set_point + vars[V_stroke_speed] * h, speed = vars[V_stroke_speed], feed = 0.0;
    }
    if (fabs(speed) > 0.01) feed += copysign(vars[V_friction], speed);
    self->set_point = goal;
    double error = goal - self->x, top = 1.5 * (1.0 - vars[V_slow_share] * self->act_slow);
    /* The integrator works at standstill only, as in many servo drives; what it holds at a start bleeds away. */
    if (stopping) self->integral = limit(self->integral + vars[V_integral_gain] * error * h, most);
    else self->integral -= self->integral * h / vars[V_bleed_time];
    double wanted = feed + vars[V_position_gain] * error + vars[V_velocity_gain] * (speed - self->v) + self->integral;
    if (fabs(self->v) > top) wanted -= 200.0 * (self->v - copysign(top, self->v));
    return limit(wanted, most);
}

void axis_step(Plant *self, const double *vars, double t) {
    const double h = vars[V_dt], m = vars[V_mass];
    int cycle = (int)floor((t + 1e-9) / vars[V_cycle]);
    if (cycle > self->cycle) self->cycle = cycle;
    Plan plan = plan_at(self, vars, t);
    if (plan.into < vars[V_restart_at]) self->return_from = self->x; /* the return is planned from where the tool is */
    self->act_slow += (vars[V_slow_approach] - self->act_slow) * h / (vars[V_slow_approach] > self->act_slow ? 0.02 : 0.3);
    self->safe_for = vars[V_protective_stop] > 0.5 ? self->safe_for + h : 0.0;
    self->hold_for = vars[V_hold] > 0.5 ? self->hold_for + h : 0.0;
    const int safe = self->safe_for > vars[V_safe_delay], held = self->hold_for > vars[V_hold_delay];
    if ((safe || held) && !self->frozen) self->frozen = 1, self->park = self->x, self->integral = 0.0;
    if (!(safe || held) && self->frozen && plan.into < h) self->frozen = 0; /* released, it goes on with the next cycle */
    if (self->frozen) {
        self->set_point = self->return_from = self->x;
        double most = vars[V_drive_force];
        self->drive = safe ? 0.0 : limit(1500.0 * (self->park - self->x) - 220.0 * self->v, most);
    } else {
        self->park = park_of(vars);
        self->drive = drive_of(self, vars, &plan, h);
    }
    const int braked = plan.stop > 0.5 && plan.into >= vars[V_stop_at] + vars[V_stop_delay];
    self->brake_on += ((braked ? 1.0 : 0.0) - self->brake_on) * h / (vars[V_brake_lag] + h);
    double left = t + 1e-9 >= vars[V_fade_time] ? 1.0 - vars[V_fade] : 1.0;
    double slide = vars[V_friction] + left * vars[V_brake_force] * self->brake_on + (safe ? vars[V_safe_brake] : 0.0);
    double stick = vars[V_friction] + left * vars[V_brake_static] * vars[V_brake_force] * self->brake_on +
                   (safe ? vars[V_brake_static] * vars[V_safe_brake] : 0.0);
    /* Coulomb, implicit: it holds at standstill up to its static force, and stops the tool within a step if it can. */
    double push = self->drive + self->force_noise + self->hand_force;
    double v = self->v + h * push / m;
    double most = self->v == 0.0 ? stick : slide;
    double after = fabs(v) <= h * most / m ? 0.0 : v - copysign(h * slide / m, v);
    self->brake = (after - v) * m / h;
    self->v = after;
    self->x += h * after;
}
