/* FMI 3.0 co-simulation over the adapter. What a co-simulation FMU does not offer is exported, as importers look for
 * it, but refuses. */
#include <string.h>

#include "adapter.h"
#include "fmi3Functions.h"

#define UNSUPPORTED(instance) status(adapter_unsupported(instance, __func__))
#define REFS const fmi3ValueReference refs[], size_t n_refs
#define NO_REFS (void)refs, (void)n_refs

static fmi3Status status(Outcome outcome) {
    return outcome == OUTCOME_OK ? fmi3OK : outcome == OUTCOME_DISCARD ? fmi3Discard : fmi3Error;
}

static void log_message(const Instance *self, Outcome outcome, const char *text) {
    fmi3LogMessageCallback logger = (fmi3LogMessageCallback)self->callback;
    const char *category = outcome == OUTCOME_DISCARD ? "logStatusDiscard" : "logStatusError";
    logger(self->environment, status(outcome), category, text);
}

const char *fmi3GetVersion(void) { return fmi3Version; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    /* Only discards and errors are ever logged, and those always. */
    (void)on, (void)n, (void)categories;
    return c == NULL ? fmi3Error : fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[], size_t n_intermediate,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback update) {
    (void)resources, (void)visible, (void)logging, (void)early_return, (void)update;
    (void)intermediate, (void)n_intermediate;
    Instance *self = adapter_new(name, token, log_message, (AnyFunction *)logger, environment);
    if (self != NULL && event_mode) {
        adapter_say(self, OUTCOME_ERROR, "this FMU has no event mode (hasEventMode is false)");
        adapter_free(self);
        return NULL;
    }
    return self;
}
fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                          fmi3Boolean logging, fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)logger;
    return NULL;
}
fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback logger, fmi3ClockUpdateCallback clock,
                                               fmi3LockPreemptionCallback lock, fmi3UnlockPreemptionCallback unlock) {
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)environment, (void)logger;
    (void)clock, (void)lock, (void)unlock;
    return NULL;
}
void fmi3FreeInstance(fmi3Instance c) { adapter_free(c); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    return status(adapter_enter_initialization(c, start));
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return status(adapter_exit_initialization(c)); }
fmi3Status fmi3Terminate(fmi3Instance c) { return status(adapter_terminate(c)); }
fmi3Status fmi3Reset(fmi3Instance c) { return status(adapter_reset(c)); }

fmi3Status fmi3GetFloat64(fmi3Instance c, REFS, fmi3Float64 values[], size_t n_values) {
    if (n_values != n_refs)
        return status(adapter_say(c, OUTCOME_ERROR, "%zu values for %zu scalars", n_values, n_refs));
    return status(adapter_get(c, refs, n_refs, values));
}
fmi3Status fmi3SetFloat64(fmi3Instance c, REFS, const fmi3Float64 values[], size_t n_values) {
    if (n_values != n_refs)
        return status(adapter_say(c, OUTCOME_ERROR, "%zu values for %zu scalars", n_values, n_refs));
    return status(adapter_set(c, refs, n_refs, values));
}

/* A plant has Float64 variables alone; a call with none of another type is legal. */
#define NO_VARIABLES(name, type)                                                    \
    fmi3Status name(fmi3Instance c, REFS, type values[], size_t n_values) {         \
        (void)refs, (void)values, (void)n_values;                                   \
        return c != NULL && n_refs == 0 ? fmi3OK : UNSUPPORTED(c);                  \
    }
#define NO_TYPE(name)                                     \
    NO_VARIABLES(fmi3Get##name, fmi3##name)               \
    NO_VARIABLES(fmi3Set##name, const fmi3##name)
NO_TYPE(Float32)
NO_TYPE(Int8)
NO_TYPE(UInt8)
NO_TYPE(Int16)
NO_TYPE(UInt16)
NO_TYPE(Int32)
NO_TYPE(UInt32)
NO_TYPE(Int64)
NO_TYPE(UInt64)
NO_TYPE(Boolean)
NO_TYPE(String)

fmi3Status fmi3GetBinary(fmi3Instance c, REFS, size_t sizes[], fmi3Binary values[], size_t n_values) {
    (void)refs, (void)sizes, (void)values, (void)n_values;
    return c != NULL && n_refs == 0 ? fmi3OK : UNSUPPORTED(c);
}
fmi3Status fmi3SetBinary(fmi3Instance c, REFS, const size_t sizes[], const fmi3Binary values[], size_t n_values) {
    (void)refs, (void)sizes, (void)values, (void)n_values;
    return c != NULL && n_refs == 0 ? fmi3OK : UNSUPPORTED(c);
}
fmi3Status fmi3GetClock(fmi3Instance c, REFS, fmi3Clock values[]) {
    (void)refs, (void)values;
    return c != NULL && n_refs == 0 ? fmi3OK : UNSUPPORTED(c);
}
fmi3Status fmi3SetClock(fmi3Instance c, REFS, const fmi3Clock values[]) {
    (void)refs, (void)values;
    return c != NULL && n_refs == 0 ? fmi3OK : UNSUPPORTED(c);
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) { return status(adapter_state_get(c, state)); }
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) { return status(adapter_state_set(c, state)); }
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (c == NULL) return fmi3Error;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    if (c == NULL || state == NULL || size == NULL) return fmi3Error;
    *size = adapter_state_size();
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    return status(adapter_state_serialize(c, state, bytes, size));
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    return status(adapter_state_deserialize(c, bytes, size, state));
}

fmi3Status fmi3EnterStepMode(fmi3Instance c) { return UNSUPPORTED(c); /* belongs to event mode */ }

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state_prior,
                      fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_time) {
    (void)no_set_state_prior;
    if (c == NULL || event_needed == NULL || terminate == NULL) return fmi3Error;
    if (early_return == NULL || last_time == NULL) return fmi3Error;
    Outcome outcome = adapter_step(c, t, h);
    *event_needed = *terminate = *early_return = fmi3False;
    *last_time = ((Instance *)c)->time;
    return status(outcome);
}

#define NO_CALL(name) \
    fmi3Status name(fmi3Instance c) { return UNSUPPORTED(c); }
NO_CALL(fmi3EnterEventMode)
NO_CALL(fmi3EnterConfigurationMode)
NO_CALL(fmi3ExitConfigurationMode)
NO_CALL(fmi3EvaluateDiscreteStates)
NO_CALL(fmi3EnterContinuousTimeMode)

fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference ref, size_t *n) {
    (void)ref, (void)n;
    return UNSUPPORTED(c);
}
fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference ref, size_t dependent[],
                                       fmi3ValueReference independents[], size_t independent[],
                                       fmi3DependencyKind kinds[], size_t n) {
    (void)ref, (void)dependent, (void)independents, (void)independent, (void)kinds, (void)n;
    return UNSUPPORTED(c);
}

#define NO_DERIVATIVE(name)                                                                            \
    fmi3Status name(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n_unknowns,            \
                    const fmi3ValueReference knowns[], size_t n_knowns, const fmi3Float64 seed[],      \
                    size_t n_seed, fmi3Float64 sensitivity[], size_t n_sensitivity) {                  \
        (void)unknowns, (void)n_unknowns, (void)knowns, (void)n_knowns, (void)seed, (void)n_seed;      \
        (void)sensitivity, (void)n_sensitivity;                                                        \
        return UNSUPPORTED(c);                                                                         \
    }
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)

fmi3Status fmi3GetIntervalDecimal(fmi3Instance c, REFS, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[]) {
    NO_REFS, (void)intervals, (void)qualifiers;
    return UNSUPPORTED(c);
}
fmi3Status fmi3GetIntervalFraction(fmi3Instance c, REFS, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
                                   fmi3IntervalQualifier qualifiers[]) {
    NO_REFS, (void)counters, (void)resolutions, (void)qualifiers;
    return UNSUPPORTED(c);
}
fmi3Status fmi3GetShiftDecimal(fmi3Instance c, REFS, fmi3Float64 shifts[]) {
    NO_REFS, (void)shifts;
    return UNSUPPORTED(c);
}
fmi3Status fmi3GetShiftFraction(fmi3Instance c, REFS, fmi3UInt64 counters[], fmi3UInt64 resolutions[]) {
    NO_REFS, (void)counters, (void)resolutions;
    return UNSUPPORTED(c);
}
fmi3Status fmi3SetIntervalDecimal(fmi3Instance c, REFS, const fmi3Float64 intervals[]) {
    NO_REFS, (void)intervals;
    return UNSUPPORTED(c);
}
fmi3Status fmi3SetIntervalFraction(fmi3Instance c, REFS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    NO_REFS, (void)counters, (void)resolutions;
    return UNSUPPORTED(c);
}
fmi3Status fmi3SetShiftDecimal(fmi3Instance c, REFS, const fmi3Float64 shifts[]) {
    NO_REFS, (void)shifts;
    return UNSUPPORTED(c);
}
fmi3Status fmi3SetShiftFraction(fmi3Instance c, REFS, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[]) {
    NO_REFS, (void)counters, (void)resolutions;
    return UNSUPPORTED(c);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *needed, fmi3Boolean *terminate, fmi3Boolean *nominals,
                                    fmi3Boolean *values, fmi3Boolean *next_defined, fmi3Float64 *next) {
    (void)needed, (void)terminate, (void)nominals, (void)values, (void)next_defined, (void)next;
    return UNSUPPORTED(c);
}
fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set, fmi3Boolean *enter_event,
                                       fmi3Boolean *terminate) {
    (void)no_set, (void)enter_event, (void)terminate;
    return UNSUPPORTED(c);
}
fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 t) {
    (void)t;
    return UNSUPPORTED(c);
}
fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    (void)x, (void)n;
    return UNSUPPORTED(c);
}

#define NO_STATES(name)                                                  \
    fmi3Status name(fmi3Instance c, fmi3Float64 values[], size_t n) {    \
        (void)values, (void)n;                                           \
        return UNSUPPORTED(c);                                           \
    }
NO_STATES(fmi3GetContinuousStateDerivatives)
NO_STATES(fmi3GetEventIndicators)
NO_STATES(fmi3GetContinuousStates)
NO_STATES(fmi3GetNominalsOfContinuousStates)

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    if (c == NULL || n == NULL) return fmi3Error;
    *n = 0;
    return fmi3OK;
}
fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    if (c == NULL || n == NULL) return fmi3Error;
    *n = 0;
    return fmi3OK;
}
fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, REFS, const fmi3Int32 orders[], fmi3Float64 values[],
                                    size_t n_values) {
    NO_REFS, (void)orders, (void)values, (void)n_values;
    return UNSUPPORTED(c);
}
fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 t) {
    (void)clock, (void)t;
    return UNSUPPORTED(c);
}
