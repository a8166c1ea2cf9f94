#include <stdio.h>

#include "fmi3FunctionTypes.h"

#include "mixed.h"

#define STUB(name) \
    fmi3Status name(void) { return fmi3Error; }
#define REFS const fmi3ValueReference vr[], size_t n

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
                                         fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early,
                                         const fmi3ValueReference refs[], size_t n, fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger, fmi3IntermediateUpdateCallback update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)event_mode, (void)early;
    (void)refs, (void)n, (void)update;
    if (strcmp(token, "{mixed}") != 0) return NULL;
    Mixed *m = calloc(1, sizeof *m);
    m->environment = environment;
    m->logger = (void (*)(void))logger;
    forget(m);
    return m;
}
void fmi3FreeInstance(fmi3Instance c) {
    if (((Mixed *)c)->dead) abort();
    free(c);
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 b, fmi3Float64 d, fmi3Boolean e,
                                       fmi3Float64 f) {
    (void)a, (void)b, (void)d, (void)e, (void)f;
    return c ? fmi3OK : fmi3Error;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return start(c), fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { return forget(c), fmi3OK; }

#define GET(name, type, expression)                                                        \
    fmi3Status name(fmi3Instance c, REFS, type values[], size_t n_values) {                \
        const Mixed *m = c;                                                                \
        if (n != n_values) return fmi3Error;                                               \
        for (size_t i = 0; i < n; i++) values[i] = (expression);                           \
        return m ? fmi3OK : fmi3Error;                                                     \
    }
#define SET(name, type, target)                                                            \
    fmi3Status name(fmi3Instance c, REFS, const type values[], size_t n_values) {          \
        Mixed *m = c;                                                                      \
        if (n != n_values) return fmi3Error;                                               \
        for (size_t i = 0; i < n; i++) (target) = values[i];                               \
        return fmi3OK;                                                                     \
    }
GET(fmi3GetFloat64, fmi3Float64, vr[i] == 0 ? force(m) : 0.0)
GET(fmi3GetFloat32, fmi3Float32, vr[i] == 1 ? 0.1f : 0.0f)
GET(fmi3GetUInt16, fmi3UInt16, vr[i] == 2 ? (fmi3UInt16)m->count : 0)
GET(fmi3GetInt64, fmi3Int64, vr[i] == 3 ? level(m) : 0) /* enumerations */
GET(fmi3GetBoolean, fmi3Boolean, vr[i] == 4 ? closed(m) : vr[i] == 6 ? m->inverted : m->enable)
SET(fmi3SetInt32, fmi3Int32, m->offset)
SET(fmi3SetInt8, fmi3Int8, m->gain)
SET(fmi3SetBoolean, fmi3Boolean, *(vr[i] == 6 ? &m->inverted : &m->enable))

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set, fmi3Boolean *event,
                      fmi3Boolean *terminate, fmi3Boolean *early, fmi3Float64 *last) {
    (void)no_set;
    Mixed *m = c;
    *event = *terminate = *early = false;
    *last = t + h;
    if (m->offset == -100) {
        char text[40];
        m->dead = true;
        snprintf(text, sizeof text, "offset is %d", m->offset);
        ((fmi3LogMessageCallback)m->logger)(m->environment, fmi3Fatal, "logStatusFatal", text);
        return fmi3Fatal;
    }
    advance(m);
    return fmi3OK;
}

STUB(fmi3SetDebugLogging)
STUB(fmi3InstantiateModelExchange)
STUB(fmi3InstantiateScheduledExecution)
STUB(fmi3EnterEventMode)
STUB(fmi3Terminate)
STUB(fmi3GetInt8)
STUB(fmi3GetUInt8)
STUB(fmi3GetInt16)
STUB(fmi3GetInt32)
STUB(fmi3GetUInt32)
STUB(fmi3GetUInt64)
STUB(fmi3GetString)
STUB(fmi3GetBinary)
STUB(fmi3GetClock)
STUB(fmi3SetFloat32)
STUB(fmi3SetFloat64)
STUB(fmi3SetUInt8)
STUB(fmi3SetInt16)
STUB(fmi3SetUInt16)
STUB(fmi3SetUInt32)
STUB(fmi3SetInt64)
STUB(fmi3SetUInt64)
STUB(fmi3SetString)
STUB(fmi3SetBinary)
STUB(fmi3SetClock)
STUB(fmi3GetNumberOfVariableDependencies)
STUB(fmi3GetVariableDependencies)
STUB(fmi3GetFMUState)
STUB(fmi3SetFMUState)
STUB(fmi3FreeFMUState)
STUB(fmi3SerializedFMUStateSize)
STUB(fmi3SerializeFMUState)
STUB(fmi3DeserializeFMUState)
STUB(fmi3GetDirectionalDerivative)
STUB(fmi3GetAdjointDerivative)
STUB(fmi3EnterConfigurationMode)
STUB(fmi3ExitConfigurationMode)
STUB(fmi3GetIntervalDecimal)
STUB(fmi3GetIntervalFraction)
STUB(fmi3GetShiftDecimal)
STUB(fmi3GetShiftFraction)
STUB(fmi3SetIntervalDecimal)
STUB(fmi3SetIntervalFraction)
STUB(fmi3SetShiftDecimal)
STUB(fmi3SetShiftFraction)
STUB(fmi3EvaluateDiscreteStates)
STUB(fmi3UpdateDiscreteStates)
STUB(fmi3EnterContinuousTimeMode)
STUB(fmi3CompletedIntegratorStep)
STUB(fmi3SetTime)
STUB(fmi3SetContinuousStates)
STUB(fmi3GetContinuousStateDerivatives)
STUB(fmi3GetEventIndicators)
STUB(fmi3GetContinuousStates)
STUB(fmi3GetNominalsOfContinuousStates)
STUB(fmi3GetNumberOfEventIndicators)
STUB(fmi3GetNumberOfContinuousStates)
STUB(fmi3EnterStepMode)
STUB(fmi3GetOutputDerivatives)
STUB(fmi3ActivateModelPartition)
