/* Line of sight: rays from the camera across the human's breadth, cut off by one box. */
#include <math.h>

#include "model.h"

/* Whether the segment from (x0, y0) to (x1, y1) meets the box (Liang and Barsky, 1984). */
static int blocked(const double box[4], double x0, double y0, double x1, double y1) {
    const double p[4] = {x0 - x1, x1 - x0, y0 - y1, y1 - y0};
    const double q[4] = {x0 - box[0], box[1] - x0, y0 - box[2], box[3] - y0};
    double in = 0.0, out = 1.0;
    for (int i = 0; i < 4; i++) {
        if (fabs(p[i]) < 1e-12) {
            if (q[i] < 0.0) return 0;
            continue;
        }
        const double r = q[i] / p[i];
        if (p[i] < 0.0) in = fmax(in, r);
        else out = fmin(out, r);
    }
    return in <= out;
}

double sight_share(const double *vars, double cx, double cy, double hx, double hy) {
    const double dx = hx - cx, dy = hy - cy, range = fmax(sqrt(dx * dx + dy * dy), 1e-9);
    const double right = vars[V_robot_speed] * vars[V_meet_time] + vars[V_rack_x];
    const double box[4] = {right - vars[V_rack_width], right, vars[V_rack_y], vars[V_rack_y] + vars[V_rack_depth]};
    if (vars[V_rack_width] <= 0.0 || vars[V_rack_depth] <= 0.0) return 1.0;
    int seen = 0;
    for (int i = 0; i < RAYS; i++) {
        const double off = vars[V_shoulder_half] * (2.0 * i / (RAYS - 1) - 1.0);
        seen += !blocked(box, cx, cy, hx - off * dy / range, hy + off * dx / range);
    }
    return (double)seen / RAYS;
}
