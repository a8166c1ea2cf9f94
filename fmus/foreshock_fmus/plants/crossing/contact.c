/* Body contact: two discs, the human's chest as the mass behind a spring of ISO/TS 15066. */
#include <math.h>

#include "model.h"

double contact_force(const double *vars, const double x[X_SIZE], double n[2], double *closing) {
    const double dx = x[X_HX] - x[X_RX], dy = x[X_HY] - x[X_RY], range = fmax(sqrt(dx * dx + dy * dy), 1e-9);
    n[0] = dx / range, n[1] = dy / range;
    *closing = -((x[X_HVX] - x[X_RVX]) * n[0] + (x[X_HVY] - x[X_RVY]) * n[1]);
    const double overlap = vars[V_robot_radius] + vars[V_human_radius] - range;
    if (overlap <= 0.0) return 0.0;
    return fmax(0.0, vars[V_contact_stiffness] * overlap + vars[V_contact_damping] * *closing); /* it never pulls */
}
