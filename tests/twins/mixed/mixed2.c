#include "fmi2FunctionTypes.h"

#include "mixed.h"

#define STUB(name) \
    fmi2Status name(void) { return fmi2Error; }

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible, fmi2Boolean logging) {
    (void)name, (void)type, (void)resources, (void)visible, (void)logging;
    if (strcmp(guid, "{mixed}") != 0) return NULL;
    Mixed *m = calloc(1, sizeof *m);
    m->environment = functions->componentEnvironment;
    m->logger = (void (*)(void))functions->logger;
    forget(m);
    return m;
}
void fmi2FreeInstance(fmi2Component c) {
    if (((Mixed *)c)->dead) abort();
    free(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real b, fmi2Real d, fmi2Boolean e, fmi2Real f) {
    (void)c, (void)a, (void)b, (void)d, (void)e, (void)f;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return c ? fmi2OK : fmi2Error; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return start(c), fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return forget(c), fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
    for (size_t i = 0; i < n; i++) value[i] = vr[i] == 0 ? force(c) : (double)0.1f;
    return fmi2OK;
}
fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
    const Mixed *m = c;
    const int all[] = {m->count, level(m), m->offset, m->gain};
    for (size_t i = 0; i < n; i++) value[i] = all[vr[i]];
    return fmi2OK;
}
fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
    const Mixed *m = c;
    const bool all[] = {closed(m), m->inverted, m->enable};
    for (size_t i = 0; i < n; i++) value[i] = all[vr[i]];
    return fmi2OK;
}
fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
    Mixed *m = c;
    for (size_t i = 0; i < n; i++) *(vr[i] == 2 ? &m->offset : &m->gain) = value[i];
    return fmi2OK;
}
fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
    Mixed *m = c;
    for (size_t i = 0; i < n; i++) *(vr[i] == 1 ? &m->inverted : &m->enable) = value[i];
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set) {
    (void)t, (void)h, (void)no_set;
    Mixed *m = c;
    if (m->offset == -100) {
        m->dead = true;
        fmi2CallbackLogger say = (fmi2CallbackLogger)m->logger;
        say(m->environment, "mixed", fmi2Fatal, "logStatusFatal", "offset is %d", m->offset);
        return fmi2Fatal;
    }
    advance(m);
    return fmi2OK;
}

STUB(fmi2SetDebugLogging)
STUB(fmi2Terminate)
STUB(fmi2GetString)
STUB(fmi2SetReal)
STUB(fmi2SetString)
STUB(fmi2GetFMUstate)
STUB(fmi2SetFMUstate)
STUB(fmi2FreeFMUstate)
STUB(fmi2SerializedFMUstateSize)
STUB(fmi2SerializeFMUstate)
STUB(fmi2DeSerializeFMUstate)
STUB(fmi2GetDirectionalDerivative)
STUB(fmi2SetRealInputDerivatives)
STUB(fmi2GetRealOutputDerivatives)
STUB(fmi2CancelStep)
STUB(fmi2GetStatus)
STUB(fmi2GetRealStatus)
STUB(fmi2GetIntegerStatus)
STUB(fmi2GetBooleanStatus)
STUB(fmi2GetStringStatus)
