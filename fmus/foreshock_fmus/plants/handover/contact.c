/* Who pushes on whom: jaws on object or fingers, hand on object, and what becomes of the fingers. */
#include <math.h>

#include "model.h"

#define PAD_S 0.002   /* s, damping over stiffness of the jaws' pads */
#define SKIN_S 0.02   /* s, of a hand's soft tissue */

/* Force of a bristle that is stretched at a rate and holds at most cap (return mapping: it never holds more). */
static double bristle(double *z, double rate, double stiffness, double damping, double cap, double dt) {
    const double most = cap / stiffness;
    *z = clip(*z + rate * dt, -most, most);
    return clip(stiffness * (*z + damping * rate), -cap, cap);
}

/* Normal force of the jaws, on the object while it is between them, otherwise on a finger that is. */
static void squeeze(Plant *self, const double *vars) {
    const int between = self->in_jaws, caught = !between && finger_depth(self) > 0.0;
    const double pads = vars[V_pad_stiffness], series = pads * body_hand.stiffness / (pads + body_hand.stiffness);
    const double width = between ? vars[V_object_width] : caught ? FINGER : 0.0, stiffness = caught ? series : pads;
    const double deep = width - self->gap;
    self->normal = width > 0.0 && deep > 0.0 ? fmax(0.0, stiffness * (deep - PAD_S * self->gap_v)) : 0.0;
    self->pinch = caught ? self->normal : 0.0;
}

/* Largest part of the limits of ISO/TS 15066 so far: a contact is transient for 0.5 s, quasi-static from then on. */
static void judge(Plant *self, double dt) {
    self->pinch_for = self->pinch > 0.0 ? self->pinch_for + dt : 0.0;
    const double transient = self->pinch / (body_hand.transient * body_hand.limit);
    self->pinch_ratio = fmax(self->pinch_ratio, transient);
    if (self->pinch_for >= 0.5) self->pinch_ratio = fmax(self->pinch_ratio, self->pinch / body_hand.limit);
}

void contact_tick(Plant *self, const double *vars, double dt) {
    const double weight = vars[V_object_mass] * GRAVITY;
    squeeze(self, vars);
    judge(self, dt);
    const double cone = 2.0 * vars[V_friction] * self->normal, hand_cap = 2.0 * vars[V_hand_friction] * vars[V_hand_grip] * self->hold;
    const int robot_holds = self->in_jaws && self->normal > 0.0;
    /* The partner's hand takes part of the weight as it grips, and all of it when the jaws give it up. */
    const double share = robot_holds ? 0.6 * self->hold : self->hold;
    self->weight += (weight * (1.0 - share) * robot_holds - self->weight) * fmin(1.0, dt / 0.1);
    if (!self->dropped && self->stage != TAKING && self->weight > cone && hand_cap < weight && self->in_jaws) self->dropped = 1, self->in_jaws = 0;
    const double left = sqrt(fmax(0.0, cone * cone - self->weight * self->weight));
    self->pull = robot_holds ? bristle(&self->z_r, self->v_o - self->v_r, vars[V_pad_shear], PAD_S, left, dt) : (self->z_r = 0.0);
    self->slips = robot_holds && fabs(self->pull) >= left;
    self->finger_pull = self->pinch > 0.0 ? bristle(&self->z_f, self->v_h - self->v_r, vars[V_pad_shear], SKIN_S, 2.0 * vars[V_finger_friction] * self->pinch, dt)
                                          : (self->z_f = 0.0);
    self->hand_pull = self->hold > 0.0 && !self->dropped ? bristle(&self->z_h, self->v_h - self->v_o, vars[V_hand_shear], SKIN_S, hand_cap, dt) : (self->z_h = 0.0);
    if (!self->dropped) {
        /* Between jaws that let go and a hand that does not yet hold, the object stays with the gripper. */
        self->v_o += dt * (self->hand_pull - self->pull) / vars[V_object_mass];
        self->x_o += dt * self->v_o;
    }
    if (self->in_jaws && self->x_o - self->x_r > vars[V_overlap]) self->in_jaws = 0;
}
