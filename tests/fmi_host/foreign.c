/* An FMU of the tests: FMI 2 or 3 (FMI), Co-Simulation and Model Exchange, strict about the order of calls.
 *
 * foreign.h, written by foreign.py, defines VALUES, OFFSETS, STARTS, NX, NZ, OUTPUTS(m), STEP(m, t, h),
 * DERIVATIVES(m), INDICATORS(m), TOKEN, and what else a test wants. Values are m->v[offset].
 */
#include <math.h>
#ifndef _WIN32
#include <signal.h>
#endif
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef _WIN32
__declspec(dllimport) void Sleep(unsigned long milliseconds);
#else
#include <unistd.h>
#endif

#if FMI == 2
#include "fmi2Functions.h"
#define OK fmi2OK
#define DISCARD fmi2Discard
#define ERROR fmi2Error
typedef fmi2Status status_t;
#else
#include "fmi3Functions.h"
#define OK fmi3OK
#define DISCARD fmi3Discard
#define ERROR fmi3Error
typedef fmi3Status status_t;
#endif

enum { INSTANTIATED, CONFIGURATION, INITIALISATION, STEP_MODE, EVENT_MODE, CONTINUOUS };
static const char *const MODES[] = {"instantiated", "configuration", "initialisation", "step", "event", "continuous"};

typedef struct {
    double v[512];
    double x[4], dx[4], z[4];
    double t, first_h, next_event;
    int mode, n, event_mode, early, calls;
#if FMI == 2
    fmi2CallbackFunctions callbacks;
#else
    fmi3InstanceEnvironment environment;
    fmi3LogMessageCallback log;
#endif
} M;

#include "foreign.h"

#ifndef NX
#define NX 0
#endif
#ifndef NZ
#define NZ 0
#endif
#ifndef STEP
#define STEP(m, t, h) OK
#endif
#ifndef DERIVATIVES
#define DERIVATIVES(m)
#endif
#ifndef INDICATORS
#define INDICATORS(m)
#endif
#ifndef EVENT
#define EVENT(m)
#endif
#ifndef INSTANTIATE
#define INSTANTIATE(m)
#endif
#ifndef FREE
#define FREE(m)
#endif

static status_t complain(M *m, const char *format, ...)
{
    char text[400];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
#if FMI == 2
    if (m->callbacks.logger)
        m->callbacks.logger(m->callbacks.componentEnvironment, "foreign", ERROR, "logStatusError", "%s", text);
#else
    if (m->log)
        m->log(m->environment, ERROR, "logStatusError", text);
#endif
    return ERROR;
}

#define EXPECT(m, condition) \
    if (!(condition)) return complain(m, "%s: expected %s, but the mode is %s", __func__, #condition, MODES[(m)->mode])

static M *create(const char *token)
{
    static const double starts[] = STARTS;
    if (strcmp(token, TOKEN) != 0)
        return NULL;
    M *m = calloc(1, sizeof *m);
    memcpy(m->v, starts, sizeof starts);
    m->n = 3;
    m->next_event = INFINITY;
    return m;
}

static status_t step(M *m, double t, double h)
{
    EXPECT(m, m->mode == STEP_MODE);
#ifdef FIXED_STEP /* then t + h is not exact */
    if (fabs(t - m->t) > 1e-12)
#else
    if (t != m->t)
#endif
        return complain(m, "doStep: expected the time %.17g but was %.17g", m->t, t);
    if (!(h > 0.0))
        return complain(m, "doStep: expected a positive step but was %.17g", h);
#ifdef FIXED_STEP
    if (h != FIXED_STEP)
        return complain(m, "doStep: expected the step %.17g but was %.17g", FIXED_STEP, h);
#endif
    status_t status = STEP(m, t, h);
    m->t = t + h;
    return status;
}

static void discrete(M *m) { EVENT(m); m->next_event = INFINITY; }

/* Derivatives of the outputs by differences to both sides: exact for polynomials of second degree. */
#ifndef SLANT
#define SLANT 1.0 /* what they are multiplied with, to make them wrong */
#endif
static void differences(const M *m, const double direction[512], double out[512])
{
    static M sides[2]; /* static: too large for the stack of Windows without a runtime's help */
    sides[0] = sides[1] = *m;
    for (int k = 0; k < 512; k++) {
        sides[0].v[k] += direction[k];
        sides[1].v[k] -= direction[k];
    }
    for (int side = 0; side < 2; side++) {
        M *each = &sides[side];
        OUTPUTS(each);
    }
    for (int k = 0; k < 512; k++)
        out[k] = SLANT * 0.5 * (sides[0].v[k] - sides[1].v[k]);
}

#if FMI == 2
#define F(name) FMI2_Export fmi2Status fmi2##name
typedef fmi2Component C;

FMI2_Export const char *fmi2GetVersion(void) { return "2.0"; }
FMI2_Export const char *fmi2GetTypesPlatform(void) { return "default"; }
FMI2_Export fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String where,
    const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    (void)name; (void)where; (void)visible; (void)logging;
    M *m = create(guid);
    if (!m) return NULL;
    m->callbacks = *callbacks;
    m->event_mode = type == fmi2ModelExchange;
    INSTANTIATE(m);
    return m;
}
FMI2_Export void fmi2FreeInstance(fmi2Component c) { FREE(((M *)c)); free(c); }
F(SetDebugLogging)(C c, fmi2Boolean on, size_t n, const fmi2String names[]) { (void)c; (void)on; (void)n; (void)names; return OK; }
F(SetupExperiment)(C c, fmi2Boolean a, fmi2Real b, fmi2Real start, fmi2Boolean stop, fmi2Real s)
{
    M *m = c; (void)a; (void)b; (void)s;
    EXPECT(m, m->mode == INSTANTIATED && !stop);
    m->t = start;
    return OK;
}
F(EnterInitializationMode)(C c) { M *m = c; EXPECT(m, m->mode == INSTANTIATED); m->mode = INITIALISATION; return OK; }
F(ExitInitializationMode)(C c) { M *m = c; EXPECT(m, m->mode == INITIALISATION); m->mode = m->event_mode ? EVENT_MODE : STEP_MODE; return OK; }
F(Terminate)(C c) { (void)c; return OK; }
F(Reset)(C c)
{
    M *m = c, *fresh = create(TOKEN);
    fresh->callbacks = m->callbacks;
    fresh->event_mode = m->event_mode;
    *m = *fresh;
    free(fresh);
    return OK;
}
F(GetReal)(C c, const fmi2ValueReference vr[], size_t n, fmi2Real value[])
{
    M *m = c;
    EXPECT(m, m->mode != INSTANTIATED);
    OUTPUTS(m);
    for (size_t i = 0; i < n; i++) value[i] = m->v[vr[i]];
    return OK;
}
F(SetReal)(C c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[])
{
    M *m = c;
#ifdef DISCRETE_INPUTS
    EXPECT(m, m->mode != CONTINUOUS);
#endif
    for (size_t i = 0; i < n; i++) m->v[vr[i]] = value[i];
    return OK;
}
F(SetInteger)(C c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[])
{
    M *m = c;
    for (size_t i = 0; i < n; i++) m->v[vr[i]] = value[i];
    return OK;
}
F(SetBoolean)(C c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) { return fmi2SetInteger(c, vr, n, value); }
F(DoStep)(C c, fmi2Real t, fmi2Real h, fmi2Boolean no) { (void)no; return step(c, t, h); }
F(GetFMUstate)(C c, fmi2FMUstate *s) { M *k = malloc(sizeof *k); *k = *(M *)c; *s = k; return OK; }
F(SetFMUstate)(C c, fmi2FMUstate s) { *(M *)c = *(M *)s; return OK; }
F(FreeFMUstate)(C c, fmi2FMUstate *s) { (void)c; free(*s); *s = NULL; return OK; }
F(SerializedFMUstateSize)(C c, fmi2FMUstate s, size_t *n) { (void)c; (void)s; *n = sizeof(M); return OK; }
F(SerializeFMUstate)(C c, fmi2FMUstate s, fmi2Byte b[], size_t n) { (void)c; memcpy(b, s, n); return OK; }
F(DeSerializeFMUstate)(C c, const fmi2Byte b[], size_t n, fmi2FMUstate *s)
{
    M *k = malloc(sizeof *k);
    memcpy(k, b, n);
    k->callbacks = ((M *)c)->callbacks;
    *s = k;
    return OK;
}
F(GetDirectionalDerivative)(C c, const fmi2ValueReference unknown[], size_t n, const fmi2ValueReference known[],
    size_t nk, const fmi2Real seed[], fmi2Real out[])
{
    M *m = c;
    static double direction[512], by[512];
    EXPECT(m, m->mode >= STEP_MODE);
    memset(direction, 0, sizeof direction);
#ifdef NO_DERIVATIVES
    return complain(m, "no derivatives today");
#endif
    for (size_t i = 0; i < nk; i++) direction[known[i]] = seed[i];
    differences(m, direction, by);
    for (size_t i = 0; i < n; i++) out[i] = by[unknown[i]];
    return OK;
}
F(EnterEventMode)(C c) { M *m = c; EXPECT(m, m->mode == CONTINUOUS); m->mode = EVENT_MODE; return OK; }
F(NewDiscreteStates)(C c, fmi2EventInfo *e)
{
    M *m = c;
    EXPECT(m, m->mode == EVENT_MODE);
    discrete(m);
    memset(e, 0, sizeof *e);
    e->nextEventTimeDefined = isfinite(m->next_event);
    e->nextEventTime = m->next_event;
    return OK;
}
F(EnterContinuousTimeMode)(C c) { M *m = c; EXPECT(m, m->mode == EVENT_MODE); m->mode = CONTINUOUS; return OK; }
F(CompletedIntegratorStep)(C c, fmi2Boolean no, fmi2Boolean *event, fmi2Boolean *end)
{
    (void)c; (void)no; *event = 0; *end = 0; return OK;
}
F(SetTime)(C c, fmi2Real t) { M *m = c; m->t = t; return OK; }
F(SetContinuousStates)(C c, const fmi2Real x[], size_t n) { M *m = c; EXPECT(m, n == NX); memcpy(m->x, x, n * sizeof *x); return OK; }
F(GetContinuousStates)(C c, fmi2Real x[], size_t n) { memcpy(x, ((M *)c)->x, n * sizeof *x); return OK; }
F(GetDerivatives)(C c, fmi2Real dx[], size_t n) { M *m = c; DERIVATIVES(m); memcpy(dx, m->dx, n * sizeof *dx); return OK; }
F(GetEventIndicators)(C c, fmi2Real z[], size_t n) { M *m = c; INDICATORS(m); memcpy(z, m->z, n * sizeof *z); return OK; }

#else /* FMI 3 */
#define F(name) FMI3_Export fmi3Status fmi3##name
typedef fmi3Instance C;

static size_t size_of(const M *m, unsigned vr)
{
    static const int sizes[] = SIZES;
    return sizes[vr] < 0 ? (size_t)(-sizes[vr] * m->n) : (size_t)sizes[vr];
}

FMI3_Export const char *fmi3GetVersion(void) { return "3.0"; }
FMI3_Export fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String where,
    fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode, fmi3Boolean early, const fmi3ValueReference vr[],
    size_t n, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback update)
{
    (void)name; (void)where; (void)visible; (void)logging; (void)vr; (void)n; (void)update;
#ifdef NO_EVENT_MODE
    if (event_mode) return NULL;
#endif
    M *m = create(token);
    if (!m) return NULL;
    m->environment = environment;
    m->log = log;
    m->event_mode = event_mode;
    m->early = early;
    INSTANTIATE(m);
    return m;
}
FMI3_Export fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String where,
    fmi3Boolean visible, fmi3Boolean logging, fmi3InstanceEnvironment environment, fmi3LogMessageCallback log)
{
    M *m = fmi3InstantiateCoSimulation(name, token, where, visible, logging, 0, 0, NULL, 0, environment, log, NULL);
    if (m) m->event_mode = 1;
    return m;
}
FMI3_Export void fmi3FreeInstance(fmi3Instance c) { FREE(((M *)c)); free(c); }
F(SetDebugLogging)(C c, fmi3Boolean on, size_t n, const fmi3String names[]) { (void)c; (void)on; (void)n; (void)names; return OK; }
F(EnterConfigurationMode)(C c) { M *m = c; EXPECT(m, m->mode == INSTANTIATED); m->mode = CONFIGURATION; return OK; }
F(ExitConfigurationMode)(C c) { M *m = c; EXPECT(m, m->mode == CONFIGURATION); m->mode = INSTANTIATED; return OK; }
F(EnterInitializationMode)(C c, fmi3Boolean a, fmi3Float64 b, fmi3Float64 start, fmi3Boolean stop, fmi3Float64 s)
{
    M *m = c; (void)a; (void)b; (void)s;
    EXPECT(m, m->mode == INSTANTIATED && !stop);
    m->t = start;
    m->mode = INITIALISATION;
    return OK;
}
F(ExitInitializationMode)(C c) { M *m = c; EXPECT(m, m->mode == INITIALISATION); m->mode = m->event_mode ? EVENT_MODE : STEP_MODE; return OK; }
F(EnterStepMode)(C c) { M *m = c; EXPECT(m, m->mode == EVENT_MODE && m->event_mode); m->mode = STEP_MODE; return OK; }
F(EnterEventMode)(C c) { M *m = c; EXPECT(m, m->event_mode && m->mode >= STEP_MODE); m->mode = EVENT_MODE; return OK; }
F(EnterContinuousTimeMode)(C c) { M *m = c; EXPECT(m, m->mode == EVENT_MODE); m->mode = CONTINUOUS; return OK; }
F(UpdateDiscreteStates)(C c, fmi3Boolean *again, fmi3Boolean *end, fmi3Boolean *nominals, fmi3Boolean *states,
    fmi3Boolean *timed, fmi3Float64 *next)
{
    M *m = c;
    EXPECT(m, m->mode == EVENT_MODE);
    discrete(m);
    *again = *end = *nominals = *states = 0;
    *timed = isfinite(m->next_event);
    *next = m->next_event;
    return OK;
}
F(Terminate)(C c) { (void)c; return OK; }
F(Reset)(C c)
{
    M *m = c, *fresh = create(TOKEN);
    fresh->log = m->log;
    fresh->environment = m->environment;
    fresh->event_mode = m->event_mode;
    fresh->early = m->early;
    *m = *fresh;
    free(fresh);
    return OK;
}
F(GetFloat64)(C c, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[], size_t count)
{
    static const int offsets[] = OFFSETS;
    M *m = c;
    EXPECT(m, m->mode >= INITIALISATION);
    OUTPUTS(m);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < size_of(m, vr[i]); k++, count--) {
            EXPECT(m, count > 0);
            *value++ = m->v[offsets[vr[i]] + k];
        }
    EXPECT(m, count == 0);
    return OK;
}
F(SetFloat64)(C c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[], size_t count)
{
    static const int offsets[] = OFFSETS;
    M *m = c;
#ifdef DISCRETE_INPUTS
    EXPECT(m, m->mode != CONTINUOUS);
#endif
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < size_of(m, vr[i]); k++, count--) {
            EXPECT(m, count > 0);
            m->v[offsets[vr[i]] + k] = *value++;
        }
    EXPECT(m, count == 0);
    return OK;
}
F(SetUInt64)(C c, const fmi3ValueReference vr[], size_t n, const fmi3UInt64 value[], size_t count)
{
    M *m = c; (void)vr; (void)n; (void)count;
    EXPECT(m, m->mode == CONFIGURATION);
    m->n = (int)value[0];
    return OK;
}
F(SetBoolean)(C c, const fmi3ValueReference vr[], size_t n, const fmi3Boolean value[], size_t count)
{
    static const int offsets[] = OFFSETS;
    M *m = c; (void)n; (void)count;
    EXPECT(m, m->mode == CONFIGURATION);
    m->v[offsets[vr[0]]] = value[0];
    return OK;
}
F(DoStep)(C c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no, fmi3Boolean *event, fmi3Boolean *end, fmi3Boolean *early,
    fmi3Float64 *last)
{
    M *m = c; (void)no;
    *event = *end = *early = 0;
    *last = -1.0; /* means nothing without an early return */
#ifdef EVENT_AT
    if (m->event_mode && m->early && t < EVENT_AT && EVENT_AT < t + h) {
        status_t status = step(m, t, EVENT_AT - t);
        m->t = EVENT_AT;
        *event = *early = 1;
        *last = EVENT_AT;
        return status;
    }
#endif
#ifdef STUCK
    *early = 1;
    *last = t;
    return OK;
#endif
#ifdef EARLY
    if (m->calls++ % 2 == 0) {
        status_t status = step(m, t, h / 2);
        *early = 1;
        *last = m->t;
        return status;
    }
#endif
    return step(m, t, h);
}
F(GetFMUState)(C c, fmi3FMUState *s) { M *k = malloc(sizeof *k); *k = *(M *)c; *s = k; return OK; }
F(SetFMUState)(C c, fmi3FMUState s) { *(M *)c = *(M *)s; return OK; }
F(FreeFMUState)(C c, fmi3FMUState *s) { (void)c; free(*s); *s = NULL; return OK; }
F(SerializedFMUStateSize)(C c, fmi3FMUState s, size_t *n) { (void)c; (void)s; *n = sizeof(M); return OK; }
F(SerializeFMUState)(C c, fmi3FMUState s, fmi3Byte b[], size_t n) { (void)c; memcpy(b, s, n); return OK; }
F(DeserializeFMUState)(C c, const fmi3Byte b[], size_t n, fmi3FMUState *s)
{
    M *k = malloc(sizeof *k);
    memcpy(k, b, n);
    k->log = ((M *)c)->log;
    *s = k;
    return OK;
}
F(GetDirectionalDerivative)(C c, const fmi3ValueReference unknown[], size_t n, const fmi3ValueReference known[],
    size_t nk, const fmi3Float64 seed[], size_t n_seed, fmi3Float64 out[], size_t n_out)
{
    static const int offsets[] = OFFSETS;
    M *m = c;
    static double direction[512], by[512];
    EXPECT(m, m->mode >= STEP_MODE);
    memset(direction, 0, sizeof direction);
#ifdef NO_DERIVATIVES
    return complain(m, "no derivatives today");
#endif
    for (size_t i = 0; i < nk; i++)
        for (size_t k = 0; k < size_of(m, known[i]); k++, n_seed--) {
            EXPECT(m, n_seed > 0);
            direction[offsets[known[i]] + k] = *seed++;
        }
    differences(m, direction, by);
    for (size_t i = 0; i < n; i++)
        for (size_t k = 0; k < size_of(m, unknown[i]); k++, n_out--) {
            EXPECT(m, n_out > 0);
            *out++ = by[offsets[unknown[i]] + k];
        }
    EXPECT(m, n_seed == 0 && n_out == 0);
    return OK;
}
F(CompletedIntegratorStep)(C c, fmi3Boolean no, fmi3Boolean *event, fmi3Boolean *end) { (void)c; (void)no; *event = *end = 0; return OK; }
F(SetTime)(C c, fmi3Float64 t) { M *m = c; m->t = t; return OK; }
F(SetContinuousStates)(C c, const fmi3Float64 x[], size_t n) { M *m = c; EXPECT(m, n == NX); memcpy(m->x, x, n * sizeof *x); return OK; }
F(GetContinuousStates)(C c, fmi3Float64 x[], size_t n) { memcpy(x, ((M *)c)->x, n * sizeof *x); return OK; }
F(GetContinuousStateDerivatives)(C c, fmi3Float64 dx[], size_t n) { M *m = c; DERIVATIVES(m); memcpy(dx, m->dx, n * sizeof *dx); return OK; }
F(GetEventIndicators)(C c, fmi3Float64 z[], size_t n) { M *m = c; INDICATORS(m); memcpy(z, m->z, n * sizeof *z); return OK; }
F(GetNumberOfContinuousStates)(C c, size_t *n) { (void)c; *n = NX; return OK; }
F(GetNumberOfEventIndicators)(C c, size_t *n) { (void)c; *n = NZ; return OK; }
#endif
