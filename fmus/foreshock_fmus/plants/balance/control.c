/* What the robot does by itself: the gait machine, and DCM feedback on the CoP with the excess given to the hips. */
#include <math.h>

#include "model.h"

#define CLIP(x, a, b) ((x) < (a) ? (a) : (x) > (b) ? (b) : (x))

/* Half a gait: CoP rests at +p for single_s, then runs to -p in both_s; the other half is its mirror image. xi' = w (xi - cop)
 * and com' = w (xi - com) are solved for the antiperiodic orbit. u is the time since the half gait began. */
Reference gait_reference(double w, double p, double single_s, double both_s, double u) {
    double e1 = exp(w * single_s), e2 = exp(w * both_s), k = 2.0 * p / both_s;
    double c1 = k / w * (1.0 - e2) / (1.0 + e1 * e2), c2 = c1 * e1 + k / w, a = 0.5 * c1;
    double b = (-a - 0.5 * c2 * e2 - (a * e1 - 0.5 * c2) / e2) / (1.0 + 1.0 / (e1 * e2));
    if (u < single_s) {
        double e = exp(w * u);
        return (Reference){p, p + c1 * e, p + a * e + b / e};
    }
    double v = u - single_s, e = exp(w * v), cop = p - k * v, b2 = a * e1 + b / e1 - 0.5 * c2;
    return (Reference){cop, cop - k / w + c2 * e, cop + 0.5 * c2 * e + b2 / e};
}

double lift_height(const Lift *l, double t, double *rate, double *acceleration) {
    if (l->span <= 0.0 || t >= l->start + l->span) {
        *rate = *acceleration = 0.0;
        return l->z1;
    }
    double d = l->span, s = (t - l->start) / d, v = l->v0 * d, a = l->a0 * d * d, z = l->z1 - l->z0;
    double c3 = 10.0 * z - 6.0 * v - 1.5 * a, c4 = -15.0 * z + 8.0 * v + 1.5 * a, c5 = 6.0 * z - 3.0 * v - 0.5 * a;
    *rate = (v + s * (a + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)))) / d;
    *acceleration = (a + s * (6.0 * c3 + s * (12.0 * c4 + s * 20.0 * c5))) / (d * d);
    return l->z0 + s * (v + s * (0.5 * a + s * (c3 + s * (c4 + s * c5))));
}

void lift_plan(Lift *l, double t, double span, double target) {
    double rate, acceleration, z = lift_height(l, t, &rate, &acceleration);
    *l = (Lift){t, span, z, rate, acceleration, target};
}

static int touch_down(Plant *self, int right) {
    int *down = right ? &self->right_down : &self->left_down;
    if (*down) return 0;
    *down = 1;
    self->touchdown[right] = self->x[right ? X_YR : X_YL];
    self->x[right ? X_ZR : X_ZL] = 0.0;
    return 1;
}

/* Which feet are down. Every step draws its footfall push whether it is used or not, so that runs of one seed stay paired. */
void gait_tick(Plant *self, const double *vars, double t) {
    const double single = vars[V_single_support], period = single + vars[V_double_support], dt = vars[V_dt];
    const long long number = (long long)floor(t / period + 1e-6);
    const double u = t - (double)number * period;
    const int suppressed = vars[V_step_suppression] > 0.5 || vars[V_stepping] < 0.5;
    const int right_swings = (number % 2 == 0) == (vars[V_first_support] > 0.0);
    if (number != self->gait_step) {
        self->gait_step = number;
        double push = stream_normal(&self->process) * vars[V_footfall_push] * vars[V_first_support];
        if (self->mode == MODE_STEPPING || (self->mode == MODE_BOTH && self->gait_amplitude >= 1.0 && !suppressed)) {
            self->footfall = push / vars[V_footfall_time];
            self->footfall_end = t + vars[V_footfall_time];
            self->mode = MODE_STEPPING;
            *(right_swings ? &self->right_down : &self->left_down) = 0;
            lift_plan(&self->lift[right_swings], t, 0.4 * single, vars[V_step_height]);
        }
    }
    if (t >= self->footfall_end - 0.5 * dt) self->footfall = 0.0;
    const int swinging = !self->left_down || !self->right_down;
    if (self->mode == MODE_STEPPING && swinging) {
        Lift *lift = &self->lift[right_swings];
        if (u >= 0.45 * single - 0.5 * dt && lift->z1 > 0.0) lift_plan(lift, t, single - u, 0.0);
        if (suppressed) {
            double remaining = single - u, span = remaining < vars[V_landing_time] ? remaining : vars[V_landing_time];
            self->mode = MODE_LANDING;
            self->landing_at = t + span;
            lift_plan(lift, t, span, 0.0);
        } else if (u >= single - 0.5 * dt) {
            touch_down(self, right_swings);
        }
    } else if (self->mode == MODE_STEPPING && suppressed) {
        self->mode = MODE_BOTH;
    }
    if (self->mode == MODE_LANDING && t >= self->landing_at - 0.5 * dt) {
        if (!self->left_down) touch_down(self, 0);
        if (!self->right_down) touch_down(self, 1);
        self->mode = MODE_BOTH;
    }
    if (self->mode == MODE_BOTH) {
        double rate = suppressed ? -1.0 / vars[V_centre_time] : 1.0 / vars[V_resume_time];
        self->gait_amplitude = CLIP(self->gait_amplitude + rate * dt, 0.0, 1.0);
    }
}

static void ramp(double *value, double target, double rise, double fall, double tick) {
    double step = target > *value ? tick / rise : -tick / fall;
    *value = fabs(target - *value) <= fabs(step) ? target : *value + step;
}

void control_tick(Plant *self, const double *vars, double t, double tick) {
    static const int input[ACT_SIZE] = {V_balance_lock, V_arm_reconfiguration, V_compliance_tuning, V_impact_mitigation};
    for (int i = 0; i < ACT_SIZE; i++)
        ramp(&self->act[i], CLIP(vars[input[i]], 0.0, 1.0), vars[V_act_rise], vars[V_act_release], tick);
    const double lock = self->act[ACT_LOCK], compliance = self->act[ACT_COMPLIANCE];
    const double *x = self->x, a = TALOS_HALF_STANCE, w = dcm_rate(), sign = vars[V_first_support];
    const double single = vars[V_single_support], both = vars[V_double_support], period = single + both;
    const long long number = (long long)floor(t / period + 1e-6);
    double half_sign = (number % 2 == 0 ? 1.0 : -1.0) * sign * self->gait_amplitude;
    Reference r = gait_reference(w, a - vars[V_cop_inset], single, both, t - (double)number * period);
    r = (Reference){half_sign * r.cop, half_sign * r.dcm, half_sign * r.com};
    const int left = self->left_down, right = self->right_down;
    double shift_left = x[X_YL] - a, shift_right = x[X_YR] + a;
    double base = left && right ? 0.5 * (shift_left + shift_right) : left ? shift_left : shift_right;
    double foot_v = left && right ? 0.5 * (x[X_VL] + x[X_VR]) : left ? x[X_VL] : x[X_VR];
    /* DCM estimate: complementary filter; leg odometry believes a share of the foot's sliding to be the body's motion */
    double y = com_of(x), gain = tick / (tick + vars[V_estimator_time]), blind = vars[V_slip_blindness];
    self->estimate_v += gain * (com_rate_of(x) - blind * foot_v - self->estimate_v);
    self->estimate_v += (1.0 - gain) * tick * w * w * (y - base - x[X_COP]);
    self->dcm_noise = 0.9 * self->dcm_noise + 0.43589 * stream_normal(&self->process) * vars[V_dcm_noise] * sign;
    int behind = (int)lround(vars[V_delay] / tick);
    self->delay_at = (self->delay_at + 1) % DELAY_SIZE;
    self->delay[self->delay_at] = (Measurement){
        y - base + vars[V_com_bias] + self->estimate_v / w + self->dcm_noise, y - base, x[X_ROLL], x[X_RATE], foot_v};
    Measurement m = self->delay[(self->delay_at + DELAY_SIZE - CLIP(behind, 0, DELAY_SIZE - 1)) % DELAY_SIZE];
    double kd = vars[V_dcm_gain] * (1.0 + vars[V_lock_gain] * lock), wanted = r.cop + (1.0 + kd / w) * (m.xi - r.dcm);
    double usable = vars[V_sole_usable] + lock * (vars[V_lock_sole] - vars[V_sole_usable]);
    double low = (right ? -a : a) - usable, high = (left ? a : -a) + usable;
    self->cop_command = CLIP(wanted, low, high);
    /* compliance: while a foot slides, yield: the CoP goes under the CoM as far as the sole allows, and friction gets a rest */
    double full = vars[V_sole_half_width] - 0.003, sliding = CLIP(fabs(m.foot_v) / vars[V_yield_speed] - 0.5, 0.0, 1.0);
    double yielding = CLIP(m.y, (right ? -a : a) - full, (left ? a : -a) + full);
    self->cop_command += compliance * sliding * (yielding - self->cop_command);
    double torque = -vars[V_hip_gain] * WEIGHT * (wanted - CLIP(wanted, low, high));
    torque -= vars[V_posture_stiffness] * m.roll + vars[V_posture_damping] * (1.0 + vars[V_yield_damping] * compliance) * m.rate;
    double limit = vars[V_hip_torque] * (1.0 + vars[V_lock_torque] * lock);
    self->torque_command = CLIP(torque, -limit, limit);
}
