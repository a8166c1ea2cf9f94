#include "adapter.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TOKEN_SIZE = 64, TEXT_SIZE = 640 };

/* Value reference of the independent variable, time. */
enum { TIME_REFERENCE = N_VARS };

static const char *const mode_name[] = {"instantiated", "initialization mode", "step mode", "terminated", "failed"};

/* Followed in memory by plant_size bytes of the plant. */
typedef struct {
    char token[TOKEN_SIZE];
    Mode mode;
    bool stale;
    double time;
    double vars[N_VARS];
} State;

Outcome adapter_say(const Instance *self, Outcome outcome, const char *format, ...) {
    if (self != NULL && self->callback != NULL) {
        char text[TEXT_SIZE];
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(text, sizeof text, format, arguments);
        va_end(arguments);
        self->log(self, outcome, text);
    }
    return outcome;
}

Outcome adapter_unsupported(const Instance *self, const char *function) {
    return adapter_say(self, OUTCOME_ERROR, "%s is not offered by this FMU", function);
}

static bool allowed(const Instance *self, Mode mode, const char *call) {
    if (self != NULL && self->mode == mode) return true;
    if (self != NULL) adapter_say(self, OUTCOME_ERROR, "%s is not allowed when %s", call, mode_name[self->mode]);
    return false;
}

static Outcome from_plant(Instance *self, int answer, const char *call) {
    if (answer == PLANT_OK) return OUTCOME_OK;
    const Outcome outcome = answer == PLANT_DISCARD ? OUTCOME_DISCARD : OUTCOME_ERROR;
    if (outcome == OUTCOME_ERROR) self->mode = MODE_FAILED;
    const char *message = plant_message(self->plant);
    return adapter_say(self, outcome, "%s at t = %.9g s: %.400s", call, self->time, message);
}

static void forget(Instance *self) {
    self->mode = MODE_INSTANTIATED;
    self->stale = true;
    self->time = 0.0;
    memcpy(self->vars, plant_start, sizeof self->vars);
    memset(self->plant, 0, plant_size);
}

static Outcome initialize(Instance *self) {
    if (!self->stale) return OUTCOME_OK;
    memset(self->plant, 0, plant_size);
    int answer = plant_init(self->plant, self->vars);
    self->stale = false;
    return from_plant(self, answer == PLANT_DISCARD ? PLANT_ERROR : answer, "initialization");
}

Instance *adapter_new(const char *name, const char *token, LogSink *log, AnyFunction *callback, void *environment) {
    Instance *self = calloc(1, sizeof *self);
    if (self == NULL) return NULL;
    if (name == NULL) name = "";
    self->log = log;
    self->callback = callback;
    self->environment = environment;
    self->plant = calloc(1, plant_size > 0 ? plant_size : 1);
    self->name = malloc(strlen(name) + 1);
    if (self->plant == NULL || self->name == NULL) {
        adapter_free(self);
        return NULL;
    }
    strcpy(self->name, name);
    if (token == NULL || strcmp(token, plant_token) != 0) {
        adapter_say(self, OUTCOME_ERROR, "the model description is not that of this binary: token %s, here %s",
                    token == NULL ? "missing" : token, plant_token);
        adapter_free(self);
        return NULL;
    }
    forget(self);
    return self;
}

void adapter_free(Instance *self) {
    if (self == NULL) return;
    free(self->plant);
    free(self->name);
    free(self);
}

Outcome adapter_enter_initialization(Instance *self, double start_time) {
    if (!allowed(self, MODE_INSTANTIATED, "entering initialization mode")) return OUTCOME_ERROR;
    if (!isfinite(start_time)) return adapter_say(self, OUTCOME_ERROR, "the start time is %g", start_time);
    self->time = start_time;
    self->mode = MODE_INITIALIZATION;
    return OUTCOME_OK;
}

Outcome adapter_exit_initialization(Instance *self) {
    if (!allowed(self, MODE_INITIALIZATION, "leaving initialization mode")) return OUTCOME_ERROR;
    Outcome outcome = initialize(self);
    if (outcome == OUTCOME_OK) self->mode = MODE_STEP;
    return outcome;
}

Outcome adapter_terminate(Instance *self) {
    if (!allowed(self, MODE_STEP, "terminating")) return OUTCOME_ERROR;
    self->mode = MODE_TERMINATED;
    return OUTCOME_OK;
}

Outcome adapter_reset(Instance *self) {
    if (self == NULL) return OUTCOME_ERROR;
    forget(self);
    return OUTCOME_OK;
}

Outcome adapter_step(Instance *self, double t, double h) {
    if (!allowed(self, MODE_STEP, "a step")) return OUTCOME_ERROR;
    if (!(h > 0.0) || !isfinite(h)) return adapter_say(self, OUTCOME_ERROR, "the step size is %g s; it must be > 0", h);
    /* A few ulp of rounding in the importer's own sum are no jump in time. */
    if (!(fabs(t - self->time) <= 1e-6 * h + 1e-12 * fabs(t)))
        return adapter_say(self, OUTCOME_ERROR, "a step from t = %.17g s, but the plant is at %.17g s", t, self->time);
    Outcome outcome = from_plant(self, plant_step(self->plant, self->vars, t, h), "step");
    if (outcome == OUTCOME_OK) self->time = t + h;
    return outcome;
}

Outcome adapter_get(Instance *self, const unsigned int refs[], size_t n, double values[]) {
    if (self == NULL) return OUTCOME_ERROR;
    if (self->mode == MODE_FAILED) return adapter_say(self, OUTCOME_ERROR, "reading is not allowed when failed");
    if (self->mode == MODE_INITIALIZATION) {
        Outcome outcome = initialize(self);
        if (outcome != OUTCOME_OK) return outcome;
    }
    for (size_t i = 0; i < n; i++) {
        const unsigned int ref = refs[i];
        if (ref > TIME_REFERENCE)
            return adapter_say(self, OUTCOME_ERROR, "there is no variable with value reference %u", ref);
        if (self->mode == MODE_INSTANTIATED && ref < N_VARS && plant_causality[ref] == CAUSALITY_OUTPUT)
            return adapter_say(self, OUTCOME_ERROR, "output %s has no value before initialization", plant_name[ref]);
        values[i] = ref == TIME_REFERENCE ? self->time : self->vars[ref];
    }
    return OUTCOME_OK;
}

Outcome adapter_set(Instance *self, const unsigned int refs[], size_t n, const double values[]) {
    if (self == NULL) return OUTCOME_ERROR;
    if (self->mode > MODE_STEP)
        return adapter_say(self, OUTCOME_ERROR, "setting variables is not allowed when %s", mode_name[self->mode]);
    for (size_t i = 0; i < n; i++) { /* all are checked before the first is set */
        const unsigned int ref = refs[i];
        if (ref >= N_VARS)
            return adapter_say(self, OUTCOME_ERROR, "there is no settable variable with value reference %u", ref);
        if (plant_causality[ref] == CAUSALITY_OUTPUT)
            return adapter_say(self, OUTCOME_ERROR, "output %s cannot be set", plant_name[ref]);
        if (plant_causality[ref] == CAUSALITY_PARAMETER && self->mode == MODE_STEP)
            return adapter_say(self, OUTCOME_ERROR, "parameter %s is fixed after initialization", plant_name[ref]);
        if (!isfinite(values[i]) || !(values[i] >= plant_min[ref] && values[i] <= plant_max[ref]))
            return adapter_say(self, OUTCOME_ERROR, "%s = %g is outside [%g, %g]", plant_name[ref], values[i],
                               plant_min[ref], plant_max[ref]);
    }
    for (size_t i = 0; i < n; i++) self->vars[refs[i]] = values[i];
    self->stale = self->stale || self->mode != MODE_STEP;
    return OUTCOME_OK;
}

size_t adapter_state_size(void) { return sizeof(State) + plant_size; }

Outcome adapter_state_get(Instance *self, void **state) {
    if (self == NULL || state == NULL) return OUTCOME_ERROR;
    if (*state == NULL) *state = calloc(1, adapter_state_size());
    if (*state == NULL) return adapter_say(self, OUTCOME_ERROR, "no memory for the state");
    State *head = *state;
    strncpy(head->token, plant_token, TOKEN_SIZE - 1);
    head->mode = self->mode;
    head->stale = self->stale;
    head->time = self->time;
    memcpy(head->vars, self->vars, sizeof head->vars);
    memcpy(head + 1, self->plant, plant_size);
    return OUTCOME_OK;
}

Outcome adapter_state_set(Instance *self, const void *state) {
    if (self == NULL || state == NULL) return OUTCOME_ERROR;
    const State *head = state;
    self->mode = head->mode;
    self->stale = head->stale;
    self->time = head->time;
    memcpy(self->vars, head->vars, sizeof self->vars);
    memcpy(self->plant, head + 1, plant_size);
    return OUTCOME_OK;
}

Outcome adapter_state_serialize(Instance *self, const void *state, void *bytes, size_t size) {
    if (self == NULL || state == NULL || bytes == NULL) return OUTCOME_ERROR;
    if (size < adapter_state_size())
        return adapter_say(self, OUTCOME_ERROR, "the state needs %zu bytes, not %zu", adapter_state_size(), size);
    memcpy(bytes, state, adapter_state_size());
    return OUTCOME_OK;
}

Outcome adapter_state_deserialize(Instance *self, const void *bytes, size_t size, void **state) {
    if (self == NULL || bytes == NULL || state == NULL) return OUTCOME_ERROR;
    const State *head = bytes;
    if (size != adapter_state_size() || strncmp(head->token, plant_token, TOKEN_SIZE) != 0) /* chars: any alignment */
        return adapter_say(self, OUTCOME_ERROR, "the serialized state is not of this build of the plant");
    if (*state == NULL) *state = calloc(1, size);
    if (*state == NULL) return adapter_say(self, OUTCOME_ERROR, "no memory for the state");
    memcpy(*state, bytes, size);
    return OUTCOME_OK;
}
