/* The contract between a plant and the adapter that makes an FMU of it.
 *
 * A plant is plain C11: a struct of its own state and three functions, in all *.c and *.h files of its folder. The
 * adapter owns the memory, speaks FMI 2.0 and FMI 3.0, and copies the state with memcpy. Hence the struct holds no
 * pointers and no handles, and nothing that changes lives outside it (no static variables, clocks or files): then
 * reset, get/set state and several instances work.
 *
 * vars is a flat array of N_VARS doubles; the index is the FMI value reference, named V_<name> in plant_vars.h, which
 * is generated from the plant's description. Parameters and inputs are read, outputs are written.
 */
#ifndef PLANT_H
#define PLANT_H

#include <stddef.h>

#include "plant_vars.h"

typedef struct Plant Plant;

enum { PLANT_OK = 0, PLANT_DISCARD = 1, PLANT_ERROR = 2 };

/* sizeof(struct Plant). */
extern const size_t plant_size;

/* Set the state and all outputs at the start time from parameters and inputs. self is zeroed before. It may be called
 * more than once before the first step. Returns PLANT_OK or PLANT_ERROR. */
int plant_init(Plant *self, double *vars);

/* Advance from t to t + h (s), h > 0, with the inputs held constant, and set all outputs at t + h.
 * PLANT_DISCARD: the step cannot be taken; self and vars are as before. PLANT_ERROR: unusable until reset. */
int plant_step(Plant *self, double *vars, double t, double h);

/* Why the last call was not PLANT_OK, for people; never NULL, at most 400 characters are used. */
const char *plant_message(const Plant *self);

#endif
