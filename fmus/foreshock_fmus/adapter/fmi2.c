/* FMI 2.0.4 co-simulation over the adapter. Model exchange functions are exported, as importers look for them, but
 * refuse. */
#include <string.h>

#include "adapter.h"
#include "fmi2Functions.h"

#define UNSUPPORTED(instance) status(adapter_unsupported(instance, __func__))

static fmi2Status status(Outcome outcome) {
    return outcome == OUTCOME_OK ? fmi2OK : outcome == OUTCOME_DISCARD ? fmi2Discard : fmi2Error;
}

static void log_message(const Instance *self, Outcome outcome, const char *text) {
    fmi2CallbackLogger logger = (fmi2CallbackLogger)self->callback;
    const char *category = outcome == OUTCOME_DISCARD ? "logStatusDiscard" : "logStatusError";
    logger(self->environment, self->name, status(outcome), category, "%s", text);
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    /* Only discards and errors are ever logged, and those always. */
    (void)on, (void)n, (void)categories;
    return c == NULL ? fmi2Error : fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    if (type != fmi2CoSimulation || functions == NULL) return NULL;
    return adapter_new(name, guid, log_message, (AnyFunction *)functions->logger, functions->componentEnvironment);
}

void fmi2FreeInstance(fmi2Component c) { adapter_free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                               fmi2Boolean stop_defined, fmi2Real stop) {
    (void)tolerance_defined, (void)tolerance, (void)stop_defined, (void)stop;
    Instance *self = c;
    if (self == NULL || self->mode != MODE_INSTANTIATED) return fmi2Error;
    self->time = start; /* checked when initialization mode is entered */
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    return c == NULL ? fmi2Error : status(adapter_enter_initialization(c, ((Instance *)c)->time));
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return status(adapter_exit_initialization(c)); }
fmi2Status fmi2Terminate(fmi2Component c) { return status(adapter_terminate(c)); }
fmi2Status fmi2Reset(fmi2Component c) { return status(adapter_reset(c)); }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    return status(adapter_get(c, vr, n, value));
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
    return status(adapter_set(c, vr, n, value));
}

/* A plant has real variables alone; a call with none of another type is legal. */
#define NO_VARIABLES(name, type)                                                                             \
    fmi2Status name(fmi2Component c, const fmi2ValueReference vr[], size_t n, type value[]) {                \
        (void)vr, (void)value;                                                                               \
        return c != NULL && n == 0 ? fmi2OK : UNSUPPORTED(c);                                                \
    }
NO_VARIABLES(fmi2GetInteger, fmi2Integer)
NO_VARIABLES(fmi2GetBoolean, fmi2Boolean)
NO_VARIABLES(fmi2GetString, fmi2String)
NO_VARIABLES(fmi2SetInteger, const fmi2Integer)
NO_VARIABLES(fmi2SetBoolean, const fmi2Boolean)
NO_VARIABLES(fmi2SetString, const fmi2String)

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) { return status(adapter_state_get(c, state)); }
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) { return status(adapter_state_set(c, state)); }

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (c == NULL) return fmi2Error;
    if (state != NULL) {
        free(*state);
        *state = NULL;
    }
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    if (c == NULL || state == NULL || size == NULL) return fmi2Error;
    *size = adapter_state_size();
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    return status(adapter_state_serialize(c, state, bytes, size));
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
    return status(adapter_state_deserialize(c, bytes, size, state));
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known, const fmi2Real seed[],
                                        fmi2Real sensitivity[]) {
    (void)unknown, (void)n_unknown, (void)known, (void)n_known, (void)seed, (void)sensitivity;
    return UNSUPPORTED(c);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state_prior) {
    (void)no_set_state_prior;
    return status(adapter_step(c, t, h));
}
fmi2Status fmi2CancelStep(fmi2Component c) { return UNSUPPORTED(c); }

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    if (c == NULL || value == NULL) return fmi2Error;
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Instance *)c)->time;
    return fmi2OK;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    if (c == NULL || value == NULL) return fmi2Error;
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = fmi2False; /* a plant never asks for the end of the simulation */
    return fmi2OK;
}
/* Steps are synchronous: there is no pending status to ask for (FMI 2.0.4, 4.2.3: discard). */
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    (void)kind, (void)value;
    return c == NULL ? fmi2Error : fmi2Discard;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    (void)kind, (void)value;
    return c == NULL ? fmi2Error : fmi2Discard;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    (void)kind, (void)value;
    return c == NULL ? fmi2Error : fmi2Discard;
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    (void)vr, (void)n, (void)order, (void)value;
    return UNSUPPORTED(c);
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real value[]) {
    (void)vr, (void)n, (void)order, (void)value;
    return UNSUPPORTED(c);
}

fmi2Status fmi2EnterEventMode(fmi2Component c) { return UNSUPPORTED(c); }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    (void)info;
    return UNSUPPORTED(c);
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return UNSUPPORTED(c); }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *enter_event,
                                       fmi2Boolean *terminate) {
    (void)no_set, (void)enter_event, (void)terminate;
    return UNSUPPORTED(c);
}
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real t) {
    (void)t;
    return UNSUPPORTED(c);
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    (void)x, (void)n;
    return UNSUPPORTED(c);
}

#define NO_STATES(name)                                              \
    fmi2Status name(fmi2Component c, fmi2Real values[], size_t n) {  \
        (void)values, (void)n;                                       \
        return UNSUPPORTED(c);                                       \
    }
NO_STATES(fmi2GetDerivatives)
NO_STATES(fmi2GetEventIndicators)
NO_STATES(fmi2GetContinuousStates)
NO_STATES(fmi2GetNominalsOfContinuousStates)
