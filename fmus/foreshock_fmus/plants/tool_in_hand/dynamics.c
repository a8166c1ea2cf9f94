/* Arm, tool, disc, spindle and forearm. */
#include <math.h>

#include "body.h"
#include "model.h"

#define RIM_SLIP 0.5         /* m/s, rim speed below which cutting force fades */
#define FOREARM_DAMPING 60.0 /* N s/m, of the contact, chosen small */
#define FOREARM_HOLD 300.0   /* N/m, the human's own arm holds its place */
#define FOREARM_HOLD_DAMPING 30.0

double wear_at(const double *vars, double t) {
    const double w = vars[V_wear_rate] * (t - vars[V_wear_time]);
    return w < 0.0 ? 0.0 : w > vars[V_wear_max] ? vars[V_wear_max] : w;
}

double rim_sign(const double *vars, double spindle) { return tanh(spindle * vars[V_disc_radius] / RIM_SLIP); }

static double clip(double x, double most) { return x > most ? most : x < -most ? -most : x; }

double forearm_gap(const Plant *self, const double *vars, const double *x) {
    return vars[V_human_distance] + self->sway + x[X_HUMAN] - vars[V_length] * sin(x[X_ANGLE]);
}

void rhs(const Plant *self, const double *vars, double t, const double *x, double *dx, Forces *f) {
    const double length = vars[V_length], s = sin(x[X_ANGLE]), c = cos(x[X_ANGLE]), lean = vars[V_coupling];
    const double side = length * s, side_rate = length * c * x[X_ANGLE_RATE];
    const double wear = wear_at(vars, t);
    const int knot = t >= vars[V_knot_time] && t < vars[V_knot_time] + vars[V_knot_duration];
    const double stiffness = vars[V_contact_stiffness] * (1.0 + wear + (knot ? vars[V_knot] : 0.0));

    /* the disc in the workpiece; beyond its edge there is none */
    const int off_edge = fabs(side) > vars[V_edge];
    const double depth = x[X_ADVANCE] - length * (1.0 - c) + lean * side + self->rough;
    const double lever = length * (lean * c - s); /* depth per angle */
    double normal = 0.0;
    if (depth > 0.0 && !off_edge) {
        normal = stiffness * depth + vars[V_contact_damping] * (x[X_ADVANCE_RATE] + lever * x[X_ANGLE_RATE]);
        if (normal < 0.0) normal = 0.0;
    }
    /* pressed too hard, the edge of the disc catches */
    double catch = (normal - vars[V_bite_force]) / vars[V_bite_span];
    catch = catch < 0.0 ? 0.0 : catch > 1.0 ? 1.0 : catch;
    catch *= catch * (3.0 - 2.0 * catch);
    const double sharp = vars[V_cutting_ratio] * (1.0 + vars[V_wear_friction] * wear);
    const double ratio = sharp + catch * (vars[V_bite_ratio] > sharp ? vars[V_bite_ratio] - sharp : 0.0);
    const double tangential = ratio * normal * rim_sign(vars, x[X_SPINDLE]);

    /* wrist: an impedance with a limit; a drive that has tripped gives friction only */
    const double lost = t > vars[V_softening_time] ? vars[V_softening] * fmin(1.0, t - vars[V_softening_time]) : 0.0;
    const double asked = vars[V_wrist_stiffness] * (1.0 - lost) * (self->angle_set - x[X_ANGLE]) +
                         vars[V_wrist_damping] * (self->angle_set_rate - x[X_ANGLE_RATE]) - self->forward;
    const double wrist = self->faulted ? -vars[V_limp_damping] * x[X_ANGLE_RATE] : clip(asked, vars[V_wrist_torque]);

    /* forearm beside the tool */
    const double gap = forearm_gap(self, vars, x);
    double human = 0.0;
    if (vars[V_human_near] > 0.5 && gap < 0.0) {
        human = -body_forearm.stiffness * gap - FOREARM_DAMPING * (x[X_HUMAN_RATE] - side_rate);
        if (human < 0.0) human = 0.0;
    }

    /* spindle: speed loop with limited torque; off, its brake */
    const double slip = vars[V_spindle_speed] - x[X_SPINDLE], power = 1.0 - self->act[ACT_OFF];
    const double wanted = vars[V_spindle_gain] * (slip + x[X_INTEGRAL] / vars[V_spindle_reset]);
    const double limit = vars[V_spindle_torque];
    const double drive = wanted > limit ? limit : wanted < 0.0 ? 0.0 : wanted; /* it drives, it does not brake */
    const double motor = power * drive - self->act[ACT_OFF] * vars[V_spindle_brake] * tanh(x[X_SPINDLE] / 5.0);

    dx[X_ADVANCE] = x[X_ADVANCE_RATE];
    dx[X_ADVANCE_RATE] =
        (vars[V_stiffness] * (self->set_point - x[X_ADVANCE]) - vars[V_damping] * x[X_ADVANCE_RATE] - normal) / vars[V_mass];
    dx[X_ANGLE] = x[X_ANGLE_RATE];
    dx[X_ANGLE_RATE] = (wrist + length * c * (tangential - human) - lever * normal) / vars[V_inertia];
    dx[X_SPINDLE] = (motor - vars[V_disc_radius] * tangential) / vars[V_spindle_inertia];
    const int wound = (wanted > limit && slip > 0.0) || (wanted < 0.0 && slip < 0.0) || power < 0.5; /* anti-windup */
    dx[X_INTEGRAL] = wound ? 0.0 : slip;
    dx[X_HUMAN] = x[X_HUMAN_RATE];
    dx[X_HUMAN_RATE] = (human - FOREARM_HOLD * x[X_HUMAN] - FOREARM_HOLD_DAMPING * x[X_HUMAN_RATE]) / body_forearm.mass;
    if (f) *f = (Forces){depth, normal, tangential, wrist, asked, motor, human, dx[X_ANGLE_RATE], off_edge};
}
