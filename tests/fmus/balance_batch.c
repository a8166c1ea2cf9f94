/* Test bench: one run of the balance plant, with events seen in the truth and interventions switched on by them. */
#include <math.h>
#include <string.h>

#include "plant.h"

#define EXPORT __attribute__((visibility("default")))

enum { E_SLIP, E_TORSO, E_COM, E_TIP, E_CONTACT, E_FALLEN, E_PEAK, E_MAX_SLIP, E_MAX_RATE, E_MAX_DEVIATION, E_ACTED, E_SIZE };

EXPORT size_t bench_size(void) { return plant_size; }
EXPORT int bench_init(Plant *self, double *vars) { memset(self, 0, plant_size); return plant_init(self, vars); }
EXPORT int bench_step(Plant *self, double *vars, double t, double h) { return plant_step(self, vars, t, h); }
EXPORT const char *bench_message(const Plant *self) { return plant_message(self); }

/* trigger: 0 never, 1 slip, 2 torso, 3 CoM, 4 at time delay; acts[5] in the order of the inputs; stop ends the run when down.
 * watch: indices of variables logged at every step. Returns the number of steps taken, or -1. */
EXPORT long bench_run(Plant *self, double *vars, double t_end, double h, int trigger, double delay, const double *acts,
                      int n_watch, const int *watch, double *log, double *events) {
    for (int i = 0; i < E_SIZE; i++) events[i] = i <= E_FALLEN || i == E_ACTED ? INFINITY : 0.0;
    if (bench_init(self, vars)) return -1;
    long n = (long)floor(t_end / h + 0.5), k = 0;
    for (; k < n; k++) {
        double t = (double)k * h, now = (double)(k + 1) * h;
        double since = trigger == 4 ? 0.0 : trigger ? events[E_SLIP + trigger - 1] : INFINITY;
        if (t >= since + delay - 1e-9 && isinf(events[E_ACTED])) {
            events[E_ACTED] = t;
            memcpy(vars + V_step_suppression, acts, 5 * sizeof *acts);
        }
        if (plant_step(self, vars, t, h)) return -1;
        double slip = fmax(vars[V_slip_left], vars[V_slip_right]);
        double seen[6] = {slip - 0.002, fabs(vars[V_torso_rate]) - 0.6, fabs(vars[V_com_deviation]) - 0.04,
                          vars[V_tipping] - 0.5, vars[V_contact_force] - 1.0, vars[V_fallen] - 0.5};
        for (int i = 0; i < 6; i++)
            if (seen[i] > 0.0 && isinf(events[i])) events[i] = now;
        if (vars[V_upright] > 0.5) {
            events[E_MAX_SLIP] = fmax(events[E_MAX_SLIP], slip);
            events[E_MAX_RATE] = fmax(events[E_MAX_RATE], fabs(vars[V_torso_rate]));
            events[E_MAX_DEVIATION] = fmax(events[E_MAX_DEVIATION], fabs(vars[V_com_deviation]));
        }
        events[E_PEAK] = vars[V_contact_force_peak];
        for (int i = 0; i < n_watch; i++) log[k * n_watch + i] = vars[watch[i]];
    }
    return k;
}
