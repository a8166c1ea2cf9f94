/* What the robot does by itself: walking, the wrist's servo, the gripper's command, the arm that puts the load down. */
#include <math.h>

#include "model.h"

#define PI 3.141592653589793
#define TREMOR_TIME 0.02 /* s */
#define ARM_TIME 0.04    /* s, of the arm's speed loop */
#define STOP_TIME 0.01   /* s, of the arm once the load stands */
#define BUMP_WIDTH 0.15  /* s */

static double half_sine(double t, double width) { return t >= 0.0 && t < width ? sin(PI * t / width) : 0.0; }

/* Vertical acceleration of the wrist axis by walking and by a stumble, upwards. */
double hand_acceleration(const Plant *self, const double *vars, double t) {
    const double speed = 1.0 - self->act[ACT_SLOW], period = 1.0 / vars[V_step_rate];
    const double since = t - (double)self->footfall * period, width = vars[V_footfall_width];
    /* at a fixed cadence the acceleration goes with the square of the step's length; the mean of a pulse train is taken out */
    const double mean = 2.0 / PI * width / period;
    const double pulse = vars[V_footfall] * self->footfall_peak * (half_sine(since, width) - mean);
    const double gait = vars[V_bounce] * cos(2.0 * PI * since / period) + pulse;
    return speed * speed * gait + vars[V_bump_acceleration] * half_sine(t - vars[V_bump_time], BUMP_WIDTH);
}

static double clip(double x, double most) { return x > most ? most : x < -most ? -most : x; }

/* Draws are made every tick and every footfall, whatever happens. */
void control_tick(Plant *self, const double *vars, double t) {
    double *x = self->x;
    const long long number = (long long)floor(t * vars[V_step_rate] + 1e-9);
    if (number != self->footfall) {
        self->footfall = number;
        const double peak = 1.0 + vars[V_footfall_spread] * stream_normal(&self->process);
        self->footfall_peak = peak > 0.0 ? peak : 0.0;
    }
    const double keep = exp(-TICK / TREMOR_TIME);
    self->tremor = keep * self->tremor + vars[V_tremor] * sqrt(1.0 - keep * keep) * stream_normal(&self->process);

    const double wanted[ACT_SIZE] = {vars[V_regrasp], vars[V_lower_load], vars[V_slow]};
    for (int i = 0; i < ACT_SIZE; i++)
        self->act[i] += clip(wanted[i] - self->act[i], TICK / vars[wanted[i] > self->act[i] ? V_act_rise : V_act_release]);

    /* the arm: speed loop towards a place just below the support's top, braking in time */
    const double left = vars[V_support_below] + 0.004 - x[X_LOWERED], most = vars[V_lower_acceleration];
    const double brake = left > 0.0 ? sqrt(2.0 * 0.7 * most * left) : 0.0;
    const double speed = fmin(vars[V_lower_speed] * self->act[ACT_LOWER], brake);
    const double lower_acc = self->landed ? -x[X_LOWER_RATE] / STOP_TIME : clip((speed - x[X_LOWER_RATE]) / ARM_TIME, most);
    x[X_LOWER_RATE] += TICK * lower_acc;
    self->hand = hand_acceleration(self, vars, t) - lower_acc;

    /* the wrist: rate and position feedback on late measurements, weight of the assumed mass fed forward */
    self->delay_at = (self->delay_at + 1) % DELAY_SIZE;
    self->delay[self->delay_at] = (Measurement){x[X_WRIST], x[X_WRIST_RATE], self->hand};
    const int back = (int)(vars[V_wrist_delay] / TICK + 0.5);
    const Measurement *m = &self->delay[(self->delay_at + DELAY_SIZE - back) % DELAY_SIZE];
    const double arm = vars[V_wrist_lever] + vars[V_offset_x];
    const double weight = self->stage == STAGE_HELD && !self->landed ? vars[V_mass_assumed] * (GRAVITY + m->acceleration) : 0.0;
    const double torque = weight * arm - vars[V_wrist_stiffness] * m->angle - vars[V_wrist_damping] * m->rate;
    self->torque_command = clip(torque, vars[V_wrist_torque]);

    /* the gripper: its motor holds more than the continuous force until it is hot, and again once it has cooled */
    if (x[X_HEAT] >= 1.0) self->hot = 1;
    if (x[X_HEAT] < 0.8) self->hot = 0;
    const double force = vars[V_grip_force] + self->act[ACT_REGRASP] * (vars[V_regrasp_force] - vars[V_grip_force]);
    self->force_command = self->hot && force > vars[V_force_continuous] ? vars[V_force_continuous] : force;
}
