/* What FMI 2.0 and FMI 3.0 have in common: one instance of a plant, its variables, its life cycle. */
#ifndef ADAPTER_H
#define ADAPTER_H

#include <stdbool.h>
#include <stddef.h>

#include "plant.h"

/* Generated from the description (plant_model.c). */
enum { CAUSALITY_PARAMETER, CAUSALITY_INPUT, CAUSALITY_OUTPUT };
extern const char *const plant_token;
extern const char *const plant_name[N_VARS];
extern const unsigned char plant_causality[N_VARS];
extern const double plant_start[N_VARS];
extern const double plant_min[N_VARS];
extern const double plant_max[N_VARS];

typedef enum { OUTCOME_OK, OUTCOME_DISCARD, OUTCOME_ERROR } Outcome;
typedef enum { MODE_INSTANTIATED, MODE_INITIALIZATION, MODE_STEP, MODE_TERMINATED, MODE_FAILED } Mode;

typedef struct Instance Instance;
typedef void LogSink(const Instance *self, Outcome outcome, const char *text);
typedef void AnyFunction(void);

struct Instance {
    Mode mode;
    bool stale; /* in initialization mode: vars changed since plant_init */
    double time;
    double vars[N_VARS];
    Plant *plant;
    char *name;
    LogSink *log;          /* of the FMI version */
    AnyFunction *callback; /* the importer's logger, of the type that the FMI version defines */
    void *environment;     /* the importer's own, passed back to its logger */
};

Instance *adapter_new(const char *name, const char *token, LogSink *log, AnyFunction *callback, void *environment);
void adapter_free(Instance *self);
Outcome adapter_enter_initialization(Instance *self, double start_time);
Outcome adapter_exit_initialization(Instance *self);
Outcome adapter_terminate(Instance *self);
Outcome adapter_reset(Instance *self);
Outcome adapter_step(Instance *self, double t, double h);
Outcome adapter_get(Instance *self, const unsigned int refs[], size_t n, double values[]);
Outcome adapter_set(Instance *self, const unsigned int refs[], size_t n, const double values[]);

/* The state as one block of memory, that of another build is refused by its token. */
size_t adapter_state_size(void);
Outcome adapter_state_get(Instance *self, void **state);
Outcome adapter_state_set(Instance *self, const void *state);
Outcome adapter_state_serialize(Instance *self, const void *state, void *bytes, size_t size);
Outcome adapter_state_deserialize(Instance *self, const void *bytes, size_t size, void **state);

/* Log printf-style and give the outcome back; self may be NULL. */
Outcome adapter_say(const Instance *self, Outcome outcome, const char *format, ...);
/* The answer of every function that this FMU exports but does not offer. */
Outcome adapter_unsupported(const Instance *self, const char *function);

#endif
