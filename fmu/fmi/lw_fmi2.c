/* Functional Mock-up Interface 2.0. */
#include "fmi2.h"

#include <math.h>
#include <string.h>

#include "lw_part.h"

#define ENTER(call)                                                                                          \
    lw_instance *instance = lw_enter(c, __func__, LW_FMI2_##call);                                           \
    if (!instance) return fmi2Error

/* ---- messages: a logger takes a format, so that a percent sign has to be doubled ---- */

typedef void (*logger_type)(fmi2ComponentEnvironment, fmi2String, fmi2Status, fmi2String, fmi2String, ...);

static void deliver(const lw_instance *instance, int status, const char *category, const char *text) {
    char format[1024];
    size_t used = 0;
    for (; *text && used < sizeof format - 2; ++text) {
        if (*text == '%') format[used++] = '%';
        format[used++] = *text;
    }
    format[used] = 0;
    ((logger_type)instance->logger)(instance->environment, instance->name, (fmi2Status)status, category,
                                    format);
}

static fmi2Status unsupported(const lw_instance *instance, const char *was) {
    return (fmi2Status)lw_report(instance, LW_FMI_ERROR, "Expected %s but was a call of it.", was);
}

/* ---- life ---- */

const char *fmi2GetTypesPlatform(void) { return "default"; }

const char *fmi2GetVersion(void) { return "2.0"; }

fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
    ENTER(LOGGING);
    return (fmi2Status)lw_set_categories(instance, on, n, categories);
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging) {
    lw_instance with = {.function = __func__, .deliver = deliver, .logged = logging ? ~0u : 0u};
    (void)resources, (void)visible;
    if (functions) {
        with.logger = (lw_callback)functions->logger;
        with.environment = functions->componentEnvironment;
    }
    if (type != fmi2ModelExchange && type != fmi2CoSimulation) return NULL;
    with.kind = type == fmi2ModelExchange ? LW_MODEL_EXCHANGE : LW_CO_SIMULATION;
    return lw_create(&with, name, guid);
}

void fmi2FreeInstance(fmi2Component c) { lw_free(c, __func__); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean stop_defined, fmi2Real stop) {
    ENTER(SETUP);
    (void)tolerance_defined, (void)tolerance; /* rtol and atol are parameters */
    return (fmi2Status)lw_set_experiment(instance, start, stop_defined, stop);
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    ENTER(ENTER_INITIALIZATION);
    instance->mode = LW_INITIALIZATION;
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    ENTER(EXIT_INITIALIZATION);
    return (fmi2Status)lw_exit_initialization(instance);
}

fmi2Status fmi2Terminate(fmi2Component c) {
    ENTER(TERMINATE);
    instance->mode = LW_TERMINATED;
    return fmi2OK;
}

fmi2Status fmi2Reset(fmi2Component c) {
    ENTER(RESET);
    lw_reset(instance);
    return fmi2OK;
}

/* ---- values ---- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Real value[]) {
    ENTER(GET);
    return (fmi2Status)lw_get_float64(instance, vr, nvr, value, nvr);
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Real value[]) {
    ENTER(SET);
    return (fmi2Status)lw_set_float64(instance, vr, nvr, value, nvr);
}

fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Integer value[]) {
    ENTER(GET);
    return (fmi2Status)lw_get_int32(instance, vr, nvr, value, nvr);
}

fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                          const fmi2Integer value[]) {
    ENTER(SET);
    return (fmi2Status)lw_set_int32(instance, vr, nvr, value, nvr);
}

fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, fmi2Boolean value[]) {
    ENTER(GET);
    int status = lw_check_booleans(instance, vr, nvr, value, nvr, 0);
    for (size_t i = 0; !status && i < nvr; ++i) value[i] = lw_get_boolean(instance, vr[i]);
    return (fmi2Status)status;
}

fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t nvr, const fmi2Boolean value[]) {
    ENTER(SET);
    int status = lw_check_booleans(instance, vr, nvr, value, nvr, 1);
    for (size_t i = 0; !status && i < nvr; ++i) lw_set_boolean(instance, vr[i], value[i]);
    return (fmi2Status)status;
}

/* There are no variables of the other types; a list without any is fine. */
#define NO_VARIABLES(type)                                                                                   \
    fmi2Status fmi2Get##type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,                     \
                             fmi2##type value[]) {                                                           \
        ENTER(GET);                                                                                          \
        (void)vr, (void)value;                                                                               \
        return nvr ? unsupported(instance, "a model without " #type " variables") : fmi2OK;                  \
    }                                                                                                        \
    fmi2Status fmi2Set##type(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,                     \
                             const fmi2##type value[]) {                                                     \
        ENTER(SET);                                                                                          \
        (void)vr, (void)value;                                                                               \
        return nvr ? unsupported(instance, "a model without " #type " variables") : fmi2OK;                  \
    }
NO_VARIABLES(String)

/* ---- state ---- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    ENTER(STATE);
    return (fmi2Status)lw_get_snapshot(instance, state);
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    ENTER(STATE);
    return (fmi2Status)lw_set_snapshot(instance, state);
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    ENTER(STATE);
    return (fmi2Status)lw_free_snapshot(instance, state);
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
    ENTER(STATE);
    return (fmi2Status)lw_serialized_size(instance, state, size);
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
    ENTER(STATE);
    return (fmi2Status)lw_serialize(instance, state, (unsigned char *)bytes, size);
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state) {
    ENTER(STATE);
    return (fmi2Status)lw_deserialize(instance, (const unsigned char *)bytes, size, state);
}

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n_unknown,
                                        const fmi2ValueReference known[], size_t n_known,
                                        const fmi2Real seed[], fmi2Real sensitivity[]) {
    ENTER(DERIVATIVE);
    lw_variables unknowns = {unknown, n_unknown, n_unknown}, knowns = {known, n_known, n_known};
    return (fmi2Status)lw_directional_derivative(instance, unknowns, knowns, seed, sensitivity);
}

/* ---- Model Exchange ---- */

fmi2Status fmi2EnterEventMode(fmi2Component c) {
    ENTER(ENTER_EVENT);
    instance->mode = LW_EVENT;
    return fmi2OK;
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    ENTER(DISCRETE_STATES);
    if (!info) return (fmi2Status)lw_missing(instance, "fmi2eventInfo");
    int changed;
    double next;
    int status = lw_part_event(instance, &changed, &next);
    memset(info, 0, sizeof *info);
    if (status) return (fmi2Status)status;
    info->valuesOfContinuousStatesChanged = changed ? fmi2True : fmi2False;
    info->nextEventTimeDefined = isfinite(next) ? fmi2True : fmi2False;
    if (isfinite(next)) info->nextEventTime = next;
    return fmi2OK;
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
    ENTER(ENTER_CONTINUOUS);
    instance->mode = LW_CONTINUOUS;
    return fmi2OK;
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state_before,
                                       fmi2Boolean *enter_event_mode, fmi2Boolean *terminate) {
    ENTER(COMPLETED_STEP);
    (void)no_set_state_before;
    if (!enter_event_mode || !terminate)
        return (fmi2Status)lw_missing(instance, "enterEventMode or terminateSimulation");
    int event;
    lw_part_accept(instance, &event);
    *terminate = fmi2False;
    *enter_event_mode = event ? fmi2True : fmi2False;
    return fmi2OK;
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
    ENTER(SET_TIME);
    return (fmi2Status)lw_set_time(instance, time);
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t nx) {
    ENTER(SET_STATES);
    return (fmi2Status)lw_set_states(instance, x, nx);
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t nx) {
    ENTER(GET_STATES);
    return (fmi2Status)lw_get_state_derivatives(instance, derivatives, nx);
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t ni) {
    ENTER(GET_STATES);
    return (fmi2Status)lw_get_indicators(instance, indicators, ni);
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t nx) {
    ENTER(GET_STATES);
    return (fmi2Status)lw_get_states(instance, x, nx);
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t nx) {
    ENTER(GET_NOMINALS);
    return (fmi2Status)lw_get_nominals(instance, nominals, nx);
}

/* ---- Co-Simulation ---- */

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                       const fmi2Integer order[], const fmi2Real value[]) {
    ENTER(INPUT_DERIVATIVES);
    return (fmi2Status)lw_set_input_derivatives(instance, vr, nvr, order, value);
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t nvr,
                                        const fmi2Integer order[], fmi2Real value[]) {
    ENTER(OUTPUT_DERIVATIVES);
    return (fmi2Status)lw_get_output_derivatives(instance, vr, nvr, order, value, nvr);
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real point, fmi2Real size, fmi2Boolean no_set_state_before) {
    ENTER(DO_STEP);
    int early;
    (void)no_set_state_before;
    return (fmi2Status)lw_do_step(instance, point, size, &early);
}

fmi2Status fmi2CancelStep(fmi2Component c) {
    ENTER(UNSUPPORTED);
    return unsupported(instance, "steps that are done when fmi2DoStep returns (no cancelling)");
}

/* ---- status: steps are never pending ---- */

static fmi2Status no_status(const lw_instance *instance, fmi2StatusKind kind) {
    return (fmi2Status)lw_report(instance, LW_FMI_DISCARD,
                                 "Expected a kind of status of this type but was %d.", kind);
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value) {
    ENTER(STEP_STATUS);
    if (!value) return (fmi2Status)lw_missing(instance, "value");
    if (kind != fmi2DoStepStatus) return no_status(instance, kind);
    *value = (fmi2Status)instance->step_status;
    return fmi2OK;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value) {
    ENTER(STEP_STATUS);
    if (!value) return (fmi2Status)lw_missing(instance, "value");
    if (kind != fmi2LastSuccessfulTime) return no_status(instance, kind);
    *value = instance->time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value) {
    ENTER(STEP_STATUS);
    return value ? no_status(instance, kind) : (fmi2Status)lw_missing(instance, "value");
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value) {
    ENTER(STEP_STATUS);
    if (!value) return (fmi2Status)lw_missing(instance, "value");
    if (kind != fmi2Terminated) return no_status(instance, kind);
    *value = fmi2False;
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value) {
    ENTER(STEP_STATUS);
    return value ? no_status(instance, kind) : (fmi2Status)lw_missing(instance, "value");
}
