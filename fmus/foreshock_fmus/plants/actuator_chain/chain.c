/* Supply, motor, gear and arm as two inertias, a spring with backlash between; the human's hand on the bench below. */
#include <math.h>

#include "model.h"

double supply_volts(const double *vars, double t) {
    const double share = CLIP((t - vars[V_sag_time]) / vars[V_sag_ramp], 0.0, 1.0);
    return vars[V_supply] - share * vars[V_sag];
}

/* Drives fold their current back below a voltage, so that the bus does not collapse, and above a winding temperature. */
double current_limit(const double *vars, const double *x) {
    const double low = (x[X_VOLTS] - vars[V_volts_least]) / (vars[V_volts_fold] - vars[V_volts_least]);
    const double hot = (vars[V_heat_most] - x[X_HEAT]) / (vars[V_heat_most] - vars[V_heat_fold]);
    return vars[V_current_peak] * CLIP(low, 0.0, 1.0) * CLIP(hot, 0.0, 1.0);
}

double joint_torque(const double *vars, double current) { return vars[V_torque_per_ampere] * current; }

double arm_inertia(const double *vars) {
    const double l = vars[V_arm_length], c = vars[V_arm_centre];
    return vars[V_arm_inertia] + vars[V_arm_mass] * c * c + vars[V_payload] * l * l;
}

static double first_moment(const double *vars) {
    return vars[V_arm_mass] * vars[V_arm_centre] + vars[V_payload] * vars[V_arm_length];
}

double weight_torque(const double *vars, double angle) { return GRAVITY * first_moment(vars) * cos(angle); }

static double beyond(double x, double half) { return x > half ? x - half : x < -half ? x + half : 0.0; }

double contact_force(const Plant *self, const double *vars, const double *x) {
    const double l = vars[V_arm_length], depth = vars[V_hand_height] + self->hand_off - l * sin(x[X_ARM]);
    if (depth <= 0.0) return 0.0;
    const double f = body_hand.stiffness * depth - vars[V_contact_damping] * l * cos(x[X_ARM]) * x[X_ARM_RATE];
    return f > 0.0 ? f : 0.0;
}

double chain_energy(const Plant *self, const double *vars, const double *x) {
    const double wind = beyond(x[X_MOTOR] - x[X_ARM], 0.5 * vars[V_backlash]);
    const double depth = vars[V_hand_height] + self->hand_off - vars[V_arm_length] * sin(x[X_ARM]);
    return 0.5 * vars[V_motor_inertia] * x[X_MOTOR_RATE] * x[X_MOTOR_RATE] +
           0.5 * arm_inertia(vars) * x[X_ARM_RATE] * x[X_ARM_RATE] + 0.5 * vars[V_gear_stiffness] * wind * wind +
           GRAVITY * first_moment(vars) * sin(x[X_ARM]) + (depth > 0.0 ? 0.5 * body_hand.stiffness * depth * depth : 0.0);
}

static double brake_torque(const Plant *self, const double *vars, double angle, double rate) {
    if (!self->braked) return 0.0;
    const double slack = beyond(angle - self->brake_at, 0.5 * vars[V_brake_play]);
    const double spring = CLIP(-vars[V_brake_stiffness] * slack, -vars[V_brake_torque], vars[V_brake_torque]);
    return slack == 0.0 ? 0.0 : spring - vars[V_brake_damping] * rate;
}

/* The brake slips where its spring would have to hold more than it can. */
void brake_slip(Plant *self, const double *vars) {
    const double most = vars[V_brake_torque] / vars[V_brake_stiffness] + 0.5 * vars[V_brake_play];
    const double off = self->x[X_MOTOR] - self->brake_at;
    if (off > most) self->brake_at += off - most;
    else if (off < -most) self->brake_at += off + most;
}

void chain_rhs(const Plant *self, const double *vars, const double x[X_SIZE], double dx[X_SIZE]) {
    const double wm = x[X_MOTOR_RATE], w = x[X_ARM_RATE], i = self->current, drive = joint_torque(vars, i);
    const double wind = beyond(x[X_MOTOR] - x[X_ARM], 0.5 * vars[V_backlash]);
    const double gear = vars[V_gear_stiffness] * wind + (wind != 0.0 ? vars[V_gear_damping] * (wm - w) : 0.0);
    const double rub = vars[V_friction] * tanh(wm / 0.01) + vars[V_viscosity] * wm;
    const double touch = contact_force(self, vars, x) * vars[V_arm_length] * cos(x[X_ARM]);
    dx[X_MOTOR] = wm, dx[X_ARM] = w;
    dx[X_MOTOR_RATE] = (drive - rub - gear + brake_torque(self, vars, x[X_MOTOR], wm)) / vars[V_motor_inertia];
    dx[X_ARM_RATE] = (gear - weight_torque(vars, x[X_ARM]) + touch) / arm_inertia(vars);
    /* bus: a capacitor behind the battery's resistance; copper loss and shaft power of this motor, the rest of the robot */
    const double resistance = vars[V_winding_resistance] * (1.0 + 0.0039 * (x[X_HEAT] - 298.15)), loss = i * i * resistance;
    const double volts = x[X_VOLTS] > 5.0 ? x[X_VOLTS] : 5.0, shaft = drive * wm;
    const double rest = vars[V_rest_current] * (1.0 - vars[V_derate_rest] * self->derate) * (1.0 - vars[V_stop_rest] * self->stop);
    const double open = supply_volts(vars, ((double)self->step + 0.5) * vars[V_dt]); /* held over a step: its middle */
    dx[X_VOLTS] = ((open - x[X_VOLTS]) / vars[V_supply_resistance] - rest - (loss + (shaft > 0.0 ? shaft : 0.0)) / volts) / vars[V_bus_capacity];
    dx[X_HEAT] = (loss - (x[X_HEAT] - vars[V_ambient]) / vars[V_thermal_resistance]) / vars[V_heat_capacity];
}
