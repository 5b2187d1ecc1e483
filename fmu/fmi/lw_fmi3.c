/* Functional Mock-up Interface 3.0. */
#include "fmi3.h"

#include <math.h>

#include "lw_part.h"

#define ENTER(call)                                                                                          \
    lw_instance *instance = lw_enter(c, __func__, LW_FMI3_##call);                                           \
    if (!instance) return fmi3Error

static void deliver(const lw_instance *instance, int status, const char *category, const char *text) {
    ((fmi3LogMessageCallback)instance->logger)(instance->environment, (fmi3Status)status, category, text);
}

static fmi3Status unsupported(const lw_instance *instance, const char *expected) {
    return (fmi3Status)lw_report(instance, LW_FMI_ERROR, "Expected %s but was a call of it.", expected);
}

/* ---- life ---- */

const char *fmi3GetVersion(void) { return "3.0"; }

fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String categories[]) {
    ENTER(LOGGING);
    return (fmi3Status)lw_set_categories(instance, on, n, categories);
}

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger) {
    lw_instance with = {.function = __func__,
                        .deliver = deliver,
                        .logger = (lw_callback)logger,
                        .environment = environment,
                        .logged = logging ? ~0u : 0u,
                        .kind = LW_MODEL_EXCHANGE};
    (void)resources, (void)visible;
    return lw_create(&with, name, token);
}

/* The callback after each piece of a step. */
static int intermediate(lw_instance *instance, int last, double *until) {
    fmi3Boolean requested = false;
    ((fmi3IntermediateUpdateCallback)instance->update)(instance->environment, instance->time, !last, true,
                                                       true, instance->early_return_allowed && !last,
                                                       &requested, until);
    return instance->early_return_allowed && requested;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean event_mode_used, fmi3Boolean early_return_allowed,
                                         const fmi3ValueReference intermediate_references[], size_t n,
                                         fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback update) {
    lw_instance with = {.function = __func__,
                        .deliver = deliver,
                        .logger = (lw_callback)logger,
                        .environment = environment,
                        .logged = ~0u,
                        .kind = LW_CO_SIMULATION,
                        .update = (lw_callback)update,
                        .intermediate = update ? intermediate : NULL,
                        .early_return_allowed = early_return_allowed};
    (void)resources, (void)visible;
    if (event_mode_used) return unsupported(&with, "eventModeUsed = false (there is no Event Mode)"), NULL;
    if (n && !intermediate_references) return lw_missing(&with, "requiredIntermediateVariables"), NULL;
    for (size_t i = 0; i < n; ++i)
        if (!lw_variable(&with, intermediate_references[i])) return NULL;
    with.logged = logging ? ~0u : 0u;
    return lw_create(&with, name, token);
}

fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                               fmi3Boolean visible, fmi3Boolean logging,
                                               fmi3InstanceEnvironment environment,
                                               fmi3LogMessageCallback logger, fmi3ClockUpdateCallback update,
                                               fmi3LockPreemptionCallback lock,
                                               fmi3UnlockPreemptionCallback unlock) {
    lw_instance with = {.function = __func__,
                        .deliver = deliver,
                        .logger = (lw_callback)logger,
                        .environment = environment,
                        .logged = ~0u};
    (void)name, (void)token, (void)resources, (void)visible, (void)logging, (void)update, (void)lock,
        (void)unlock;
    return unsupported(&with, "Co-Simulation or Model Exchange (there is no Scheduled Execution)"), NULL;
}

void fmi3FreeInstance(fmi3Instance c) { lw_free(c, __func__); }

fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                       fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
    ENTER(ENTER_INITIALIZATION);
    (void)tolerance_defined, (void)tolerance; /* rtol and atol are parameters */
    int status = lw_set_experiment(instance, start, stop_defined, stop);
    if (!status) instance->mode = LW_INITIALIZATION;
    return (fmi3Status)status;
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    ENTER(EXIT_INITIALIZATION);
    return (fmi3Status)lw_exit_initialization(instance);
}

fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    ENTER(ENTER_EVENT);
    instance->mode = LW_EVENT;
    return fmi3OK;
}

fmi3Status fmi3Terminate(fmi3Instance c) {
    ENTER(TERMINATE);
    instance->mode = LW_TERMINATED;
    return fmi3OK;
}

fmi3Status fmi3Reset(fmi3Instance c) {
    ENTER(RESET);
    lw_reset(instance);
    return fmi3OK;
}

/* ---- values ---- */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3Float64 values[],
                          size_t n) {
    ENTER(GET);
    return (fmi3Status)lw_get_float64(instance, vr, nvr, values, n);
}

fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                          const fmi3Float64 values[], size_t n) {
    ENTER(SET);
    return (fmi3Status)lw_set_float64(instance, vr, nvr, values, n);
}

fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3Int32 values[],
                        size_t n) {
    ENTER(GET);
    return (fmi3Status)lw_get_int32(instance, vr, nvr, values, n);
}

fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, const fmi3Int32 values[],
                        size_t n) {
    ENTER(SET);
    return (fmi3Status)lw_set_int32(instance, vr, nvr, values, n);
}

fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3Boolean values[],
                          size_t n) {
    ENTER(GET);
    int status = lw_check_booleans(instance, vr, nvr, values, n, 0);
    for (size_t i = 0; !status && i < nvr; ++i) values[i] = lw_get_boolean(instance, vr[i]);
    return (fmi3Status)status;
}

fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, const fmi3Boolean values[],
                          size_t n) {
    ENTER(SET);
    int status = lw_check_booleans(instance, vr, nvr, values, n, 1);
    for (size_t i = 0; !status && i < nvr; ++i) lw_set_boolean(instance, vr[i], values[i]);
    return (fmi3Status)status;
}

/* There are no variables of the other types; a list without any is fine. */
#define NO_VARIABLES(function, unused, ...)                                                                  \
    fmi3Status function(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, __VA_ARGS__) {            \
        ENTER(GET);                                                                                          \
        (void)vr, unused;                                                                                    \
        return nvr ? unsupported(instance, "a model without variables of that type") : fmi3OK;               \
    }
#define NO_ACCESS(type)                                                                                      \
    NO_VARIABLES(fmi3Get##type, ((void)values, (void)n), fmi3##type values[], size_t n)                      \
    NO_VARIABLES(fmi3Set##type, ((void)values, (void)n), const fmi3##type values[], size_t n)
NO_ACCESS(Float32)
NO_ACCESS(Int8)
NO_ACCESS(UInt8)
NO_ACCESS(Int16)
NO_ACCESS(UInt16)
NO_ACCESS(UInt32)
NO_ACCESS(Int64)
NO_ACCESS(UInt64)
NO_ACCESS(String)
NO_VARIABLES(fmi3GetBinary, ((void)sizes, (void)values, (void)n), size_t sizes[], fmi3Binary values[],
             size_t n)
NO_VARIABLES(fmi3SetBinary, ((void)sizes, (void)values, (void)n), const size_t sizes[],
             const fmi3Binary values[], size_t n)
NO_VARIABLES(fmi3GetClock, ((void)values), fmi3Clock values[])
NO_VARIABLES(fmi3SetClock, ((void)values), const fmi3Clock values[])
NO_VARIABLES(fmi3GetIntervalDecimal, ((void)intervals, (void)kinds), fmi3Float64 intervals[],
             fmi3IntervalQualifier kinds[])
NO_VARIABLES(fmi3GetIntervalFraction, ((void)counts, (void)units, (void)kinds), fmi3UInt64 counts[],
             fmi3UInt64 units[], fmi3IntervalQualifier kinds[])
NO_VARIABLES(fmi3GetShiftDecimal, ((void)shifts), fmi3Float64 shifts[])
NO_VARIABLES(fmi3GetShiftFraction, ((void)counts, (void)units), fmi3UInt64 counts[], fmi3UInt64 units[])
NO_VARIABLES(fmi3SetIntervalDecimal, ((void)intervals), const fmi3Float64 intervals[])
NO_VARIABLES(fmi3SetIntervalFraction, ((void)counts, (void)units), const fmi3UInt64 counts[],
             const fmi3UInt64 units[])
NO_VARIABLES(fmi3SetShiftDecimal, ((void)shifts), const fmi3Float64 shifts[])
NO_VARIABLES(fmi3SetShiftFraction, ((void)counts, (void)units), const fmi3UInt64 counts[],
             const fmi3UInt64 units[])

/* Dependencies are those of the model description, for whole variables. */
fmi3Status fmi3GetNumberOfVariableDependencies(fmi3Instance c, fmi3ValueReference vr, size_t *n) {
    ENTER(UNSUPPORTED);
    (void)vr, (void)n;
    return unsupported(instance, "dependencies from the model description (none per element)");
}

fmi3Status fmi3GetVariableDependencies(fmi3Instance c, fmi3ValueReference dependent,
                                       size_t dependent_elements[], fmi3ValueReference independents[],
                                       size_t independent_elements[], fmi3DependencyKind kinds[], size_t n) {
    ENTER(UNSUPPORTED);
    (void)dependent, (void)dependent_elements, (void)independents, (void)independent_elements, (void)kinds,
        (void)n;
    return unsupported(instance, "dependencies from the model description (none per element)");
}

/* ---- state ---- */

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    ENTER(STATE);
    return (fmi3Status)lw_get_snapshot(instance, state);
}

fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    ENTER(STATE);
    return (fmi3Status)lw_set_snapshot(instance, state);
}

fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    ENTER(STATE);
    return (fmi3Status)lw_free_snapshot(instance, state);
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size) {
    ENTER(STATE);
    return (fmi3Status)lw_serialized_size(instance, state, size);
}

fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size) {
    ENTER(STATE);
    return (fmi3Status)lw_serialize(instance, state, bytes, size);
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size, fmi3FMUState *state) {
    ENTER(STATE);
    return (fmi3Status)lw_deserialize(instance, bytes, size, state);
}

fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,
                                        const fmi3ValueReference known[], size_t n_known,
                                        const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
                                        size_t n_sensitivity) {
    ENTER(DERIVATIVE);
    lw_variables unknowns = {unknown, n_unknown, n_sensitivity}, knowns = {known, n_known, n_seed};
    return (fmi3Status)lw_directional_derivative(instance, unknowns, knowns, seed, sensitivity);
}

fmi3Status fmi3GetAdjointDerivative(fmi3Instance c, const fmi3ValueReference unknown[], size_t n_unknown,
                                    const fmi3ValueReference known[], size_t n_known,
                                    const fmi3Float64 seed[], size_t n_seed, fmi3Float64 sensitivity[],
                                    size_t n_sensitivity) {
    ENTER(DERIVATIVE);
    lw_variables unknowns = {unknown, n_unknown, n_seed}, knowns = {known, n_known, n_sensitivity};
    return (fmi3Status)lw_adjoint_derivative(instance, unknowns, knowns, seed, sensitivity);
}

/* ---- configuration and events: nothing to configure, nothing discrete ---- */

fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    ENTER(UNSUPPORTED);
    return unsupported(instance, "a model without structural parameters");
}

fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    ENTER(UNSUPPORTED);
    return unsupported(instance, "a model without structural parameters");
}

fmi3Status fmi3EvaluateDiscreteStates(fmi3Instance c) {
    ENTER(UNSUPPORTED);
    return unsupported(instance, "a model without discrete states");
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *need_update, fmi3Boolean *terminate,
                                    fmi3Boolean *nominals_changed, fmi3Boolean *values_changed,
                                    fmi3Boolean *next_event_defined, fmi3Float64 *next_event) {
    ENTER(DISCRETE_STATES);
    if (!need_update || !terminate || !nominals_changed || !values_changed || !next_event_defined ||
        !next_event)
        return (fmi3Status)lw_missing(instance, "one of the results");
    int changed;
    double next;
    *need_update = *terminate = *nominals_changed = *values_changed = *next_event_defined = false;
    *next_event = 0.0;
    int status = lw_part_event(instance, &changed, &next);
    if (status) return (fmi3Status)status;
    *values_changed = changed;
    *next_event_defined = isfinite(next);
    if (isfinite(next)) *next_event = next;
    return fmi3OK;
}

/* ---- Model Exchange ---- */

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance c) {
    ENTER(ENTER_CONTINUOUS);
    instance->mode = LW_CONTINUOUS;
    return fmi3OK;
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance c, fmi3Boolean no_set_state_before,
                                       fmi3Boolean *enter_event_mode, fmi3Boolean *terminate) {
    ENTER(COMPLETED_STEP);
    (void)no_set_state_before;
    if (!enter_event_mode || !terminate)
        return (fmi3Status)lw_missing(instance, "enterEventMode or terminateSimulation");
    int event;
    lw_part_accept(instance, &event);
    *terminate = false;
    *enter_event_mode = event;
    return fmi3OK;
}

fmi3Status fmi3SetTime(fmi3Instance c, fmi3Float64 time) {
    ENTER(SET_TIME);
    return (fmi3Status)lw_set_time(instance, time);
}

fmi3Status fmi3SetContinuousStates(fmi3Instance c, const fmi3Float64 x[], size_t n) {
    ENTER(SET_STATES);
    return (fmi3Status)lw_set_states(instance, x, n);
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance c, fmi3Float64 derivatives[], size_t n) {
    ENTER(GET_STATES);
    return (fmi3Status)lw_get_state_derivatives(instance, derivatives, n);
}

fmi3Status fmi3GetEventIndicators(fmi3Instance c, fmi3Float64 indicators[], size_t n) {
    ENTER(GET_STATES);
    return (fmi3Status)lw_get_indicators(instance, indicators, n);
}

fmi3Status fmi3GetContinuousStates(fmi3Instance c, fmi3Float64 x[], size_t n) {
    ENTER(GET_STATES);
    return (fmi3Status)lw_get_states(instance, x, n);
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance c, fmi3Float64 nominals[], size_t n) {
    ENTER(GET_NOMINALS);
    return (fmi3Status)lw_get_nominals(instance, nominals, n);
}

static fmi3Status count(const lw_instance *instance, size_t *n, size_t value) {
    if (!n) return (fmi3Status)lw_missing(instance, "the result");
    *n = value;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
    ENTER(COUNT_STATES);
    return count(instance, n, lw_indicator_count(instance));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
    ENTER(COUNT_STATES);
    return count(instance, n, lw_state_size());
}

/* ---- Co-Simulation ---- */

fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    ENTER(UNSUPPORTED);
    return unsupported(instance, "Step Mode after initialization (there is no Event Mode)");
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                                    const fmi3Int32 orders[], fmi3Float64 values[], size_t n) {
    ENTER(OUTPUT_DERIVATIVES);
    return (fmi3Status)lw_get_output_derivatives(instance, vr, nvr, orders, values, n);
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 point, fmi3Float64 size, fmi3Boolean no_set_state_before,
                      fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                      fmi3Float64 *last_successful_time) {
    ENTER(DO_STEP);
    int early;
    (void)no_set_state_before;
    if (!event_needed || !terminate || !early_return || !last_successful_time)
        return (fmi3Status)lw_missing(instance, "one of the results");
    int status = lw_do_step(instance, point, size, &early);
    *event_needed = *terminate = false;
    *early_return = early;
    *last_successful_time = instance->time;
    return (fmi3Status)status;
}

/* ---- Scheduled Execution ---- */

fmi3Status fmi3ActivateModelPartition(fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time) {
    ENTER(UNSUPPORTED);
    (void)clock, (void)time;
    return unsupported(instance, "a model without clocks");
}
