/* The robot: planned motions, a drive with position and velocity loop, a brake, and the stale set-point of a restart. */
#include <math.h>

#include "model.h"

static double limit(double x, double most) { return x > most ? most : x < -most ? -most : x; }

/* Minimum-jerk motion (Flash, Hogan 1985): position share, speed and acceleration at time share s. */
static void minimum_jerk(double s, double *p, double *v, double *a) {
    if (s <= 0.0) { *p = *v = *a = 0.0; return; }
    if (s >= 1.0) { *p = 1.0, *v = *a = 0.0; return; }
    *p = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
    *v = 30.0 * s * s * (1.0 - 2.0 * s + s * s);
    *a = 60.0 * s * (1.0 - 3.0 * s + 2.0 * s * s);
}

/* Motions begin at move_period, 2 move_period, ...; each is announced before. After the stop nothing is planned. */
Plan plan_at(const Plant *self, const double *vars, double t) {
    const double period = vars[V_move_period], span = vars[V_move_time], eps = 1e-9;
    Plan plan = {0};
    double into = fmod(t + eps, period), next = period - into;
    if (t + eps < period) into = 1e9; /* none before the first */
    plan.position = self->move_to;
    if (t + eps >= vars[V_stop_time]) {
        plan.stop = 1.0, plan.phase = 1.0, plan.due = 3600.0, plan.position = self->x;
        return plan;
    }
    plan.phase = into >= span, plan.due = into < span ? span - into : next;
    plan.announced = next <= vars[V_announce_lead] + eps || into < span;
    plan.enabled = plan.announced;
    if (into < span) {
        double p, v, a, way = self->move_to - self->move_from;
        minimum_jerk(into / span, &p, &v, &a);
        plan.position = self->move_from + way * p;
        plan.speed = way * v / span;
        plan.acceleration = way * a / (span * span);
    }
    return plan;
}

static void begin_moves(Plant *self, const double *vars, double t) {
    int number = (int)floor((t + 1e-9) / vars[V_move_period]);
    if (number > self->move && t + 1e-9 < vars[V_stop_time]) {
        self->move = number;
        self->move_from = self->x;
        self->move_to = number % 2 ? vars[V_move_distance] : 0.0;
    }
}

/* Monitored standstill: brake and drives hold the robot where it is; the set-point follows, so that nothing is queued. */
void robot_step(Plant *self, const double *vars, double t) {
    const double h = vars[V_dt], m = vars[V_mass];
    begin_moves(self, vars, t);
    Plan plan = plan_at(self, vars, t);
    self->act_hold += (vars[V_hold] - self->act_hold) * h / (vars[V_hold] > self->act_hold ? 0.005 : 0.3);
    self->act_slow += (vars[V_slow_approach] - self->act_slow) * h / (vars[V_slow_approach] > self->act_slow ? 0.02 : 0.3);
    if (!self->restarted && t + 1e-9 >= vars[V_restart_time] && vars[V_queue] > 0.0) {
        self->restarted = 1;
        self->target = self->x + vars[V_queue];
        self->integral = vars[V_windup];
    }
    self->held_for = self->act_hold > 0.3 ? self->held_for + h : 0.0;
    const int holding = self->held_for > vars[V_brake_delay];
    const int idle = plan.stop > 0.5 && !self->restarted; /* stopped: drive off, brake on */
    double wanted = 0.0, most = vars[V_drive_force] * (1.0 - vars[V_slow_share] * self->act_slow);
    if (holding) {
        self->target = self->x, self->integral = 0.0;
        self->move_from = self->move_to = self->x; /* a planned motion ends here too */
    } else if (!idle) {
        double goal = self->restarted ? self->target : plan.position;
        double top = vars[V_speed_max] * (1.0 - vars[V_slow_share] * self->act_slow);
        double speed = limit(vars[V_position_gain] * (goal - self->x) + (self->restarted ? 0.0 : plan.speed), top);
        double error = speed - self->v, feed = self->restarted ? 0.0 : m * plan.acceleration + vars[V_viscous] * plan.speed;
        wanted = feed + vars[V_velocity_gain] * error + self->integral;
        if (fabs(wanted) < most) self->integral += vars[V_integral_gain] * error * h; /* no wind-up in operation */
    } else {
        self->target = self->x;
    }
    self->drive += (limit(wanted, most) - self->drive) * h / (vars[V_drive_lag] + h);
    if (holding || idle) self->drive = 0.0;
    /* Coulomb brake, implicit: it stops within the step if it can. */
    double v = self->v + h * (self->drive - vars[V_viscous] * self->v - self->robot_force) / m;
    double grip = holding || idle ? vars[V_brake_force] * h / m : 0.0;
    double braked = fabs(v) <= grip ? 0.0 : v - copysign(grip, v);
    self->brake = (braked - v) * m / h;
    self->acceleration = (braked - self->v) / h;
    self->v = braked;
    self->x += h * self->v;
}
