/* Random calls of FMI 2 with random arguments: `fuzz2 SEED CALLS`; see fuzz3.c. */
#include "fmi2.h"
#include "fuzz.h"

enum { SLOTS = 3, STATES = 6 };

typedef struct {
    fmi2Component c;
    fmi2FMUstate states[STATES];
} slot;

static slot slots[SLOTS];

static void logger(fmi2ComponentEnvironment environment, fmi2String name, fmi2Status status, fmi2String category,
                   fmi2String message, ...) {
    char text[2048];
    (void)environment, (void)status;
    if (snprintf(text, sizeof text, "%s %s %s", name, category, message) < 0) abort();
}

static fmi2Status instantiate(slot *s) {
    fmi2CallbackFunctions functions = {pick(3) ? logger : NULL, NULL, NULL, NULL, NULL};
    if (s->c) return fmi2OK;
    memset(s->states, 0, sizeof s->states);
    s->c = fmi2Instantiate(pick(10) ? "fuzz" : NULL, (fmi2Type)pick(3), pick(10) ? lw_fmu_token : "other", NULL,
                           pick(10) ? &functions : NULL, 0, (int)pick(2));
    return s->c ? fmi2OK : fmi2Error;
}

static fmi2Status release(slot *s) {
    if (pick(20)) return fmi2OK;
    fmi2FreeInstance(s->c);
    s->c = NULL;
    return fmi2OK;
}

static fmi2Status setup(slot *s) {
    return fmi2SetupExperiment(s->c, (int)pick(2), number(), pick(5) ? 0.0 : number(), (int)pick(2), number());
}
static fmi2Status initialize(slot *s) { return fmi2EnterInitializationMode(s->c); }
static fmi2Status initialized(slot *s) { return fmi2ExitInitializationMode(s->c); }
static fmi2Status terminate(slot *s) { return pick(10) ? fmi2OK : fmi2Terminate(s->c); }
static fmi2Status reset(slot *s) { return pick(3) ? fmi2OK : fmi2Reset(s->c); }

static fmi2Status get(slot *s) {
    list l = references(LW_TYPE_FLOAT64);
    double *values = numbers(l.n);
    fmi2Status status = fmi2GetReal(s->c, l.vr, l.n, values);
    for (size_t i = 0; status == fmi2OK && i < l.n; ++i)
        if (!isfinite(values[i])) abort();
    free(values), free(l.vr);
    return status;
}

static fmi2Status set(slot *s) {
    list l = references(LW_TYPE_FLOAT64);
    double *values = numbers(LONGEST);
    soothe(l, values);
    fmi2Status status = fmi2SetReal(s->c, pick(50) ? l.vr : NULL, l.n, values);
    free(values), free(l.vr);
    return status;
}

static fmi2Status integers(slot *s) {
    list l = references(LW_TYPE_INT32);
    int *values = malloc(l.n * sizeof *values + 1);
    for (size_t i = 0; i < l.n; ++i) values[i] = pick(50) ? 1 + (int)pick(2) : 9 - (int)pick(2) * 11;
    fmi2Status status = fmi2SetInteger(s->c, l.vr, l.n, values);
    if (pick(2)) status = fmi2GetInteger(s->c, l.vr, l.n, values);
    free(values), free(l.vr);
    return status;
}

static fmi2Status booleans(slot *s) {
    list l = references(LW_TYPE_BOOLEAN);
    int *values = malloc(l.n * sizeof *values + 1);
    for (size_t i = 0; i < l.n; ++i) values[i] = pick(2);
    fmi2Status status = fmi2SetBoolean(s->c, l.vr, l.n, pick(50) ? values : NULL);
    if (pick(2)) status = fmi2GetBoolean(s->c, l.vr, l.n, values);
    free(values), free(l.vr);
    return status;
}

static fmi2Status step(slot *s) {
    double now = 0.0, size = pick(10) ? 1e-3 * (1 + pick(5)) : number();
    fmi2ValueReference time = 0;
    fmi2GetReal(s->c, &time, 1, &now);
    return fmi2DoStep(s->c, pick(10) ? now : number(), size, (int)pick(2));
}

static fmi2Status state_get(slot *s) { return fmi2GetFMUstate(s->c, &s->states[pick(STATES)]); }
static fmi2Status state_set(slot *s) {
    slot *from = pick(10) ? s : &slots[pick(SLOTS)];
    return fmi2SetFMUstate(s->c, from->states[pick(STATES)]);
}
static fmi2Status state_free(slot *s) {
    fmi2FMUstate *of = &s->states[pick(STATES)], copy = *of;
    return fmi2FreeFMUstate(s->c, pick(4) ? of : &copy);
}

static fmi2Status bytes(slot *s) {
    size_t size;
    fmi2FMUstate made = NULL;
    fmi2Status status = fmi2SerializedFMUstateSize(s->c, s->states[pick(STATES)], &size);
    if (status) return status;
    char *data = malloc(size);
    status = fmi2SerializeFMUstate(s->c, s->states[0], data, size);
    if (!status && pick(2)) data[pick((unsigned)size)] = (char)(data[0] ^ (char)(1 + pick(100)));
    if (!status) status = fmi2DeSerializeFMUstate(s->c, data, size, &made);
    if (!status) status = fmi2FreeFMUstate(s->c, &made);
    free(data);
    return status;
}

static fmi2Status derivative(slot *s) {
    list of = references(LW_TYPE_FLOAT64), by = references(LW_TYPE_FLOAT64);
    double *seed = numbers(by.n), *result = numbers(of.n);
    fmi2Status status = fmi2GetDirectionalDerivative(s->c, of.vr, of.n, by.vr, by.n, seed, result);
    free(seed), free(result), free(of.vr), free(by.vr);
    return status;
}

static fmi2Status time_derivative(slot *s) {
    list l = references(LW_TYPE_FLOAT64);
    double *values = numbers(l.n);
    int orders[5] = {1, 1, 1, 1, 1}, output = pick(2);
    orders[0] = (int)pick(5);
    fmi2Status status = output ? fmi2GetRealOutputDerivatives(s->c, l.vr, l.n, orders, values)
                               : fmi2SetRealInputDerivatives(s->c, l.vr, l.n, orders, values);
    free(values), free(l.vr);
    return status;
}

static fmi2Status status_of_step(slot *s) {
    fmi2Status status;
    double time;
    int flag;
    fmi2StatusKind kind = (fmi2StatusKind)pick(4);
    switch (pick(4)) {
    case 0: return fmi2GetStatus(s->c, kind, &status);
    case 1: return fmi2GetRealStatus(s->c, kind, &time);
    case 2: return fmi2GetIntegerStatus(s->c, kind, &flag);
    default: return fmi2GetBooleanStatus(s->c, kind, pick(5) ? &flag : NULL);
    }
}

static fmi2Status event(slot *s) {
    fmi2EventInfo info;
    fmi2Status status = pick(2) ? fmi2EnterEventMode(s->c) : fmi2OK;
    return status ? status : fmi2NewDiscreteStates(s->c, pick(10) ? &info : NULL);
}
static fmi2Status continuous(slot *s) { return fmi2EnterContinuousTimeMode(s->c); }
static fmi2Status completed(slot *s) {
    int enter, stop;
    return fmi2CompletedIntegratorStep(s->c, (int)pick(2), &enter, pick(10) ? &stop : NULL);
}
static fmi2Status set_time(slot *s) { return fmi2SetTime(s->c, number()); }
static fmi2Status states(slot *s) {
    size_t n = (size_t)(lw_fmu_nq + lw_fmu_nv) + !pick(20);
    double *x = numbers(n);
    fmi2Status status = fmi2OK;
    switch (pick(4)) {
    case 0: status = fmi2GetContinuousStates(s->c, x, n); break;
    case 1: status = fmi2SetContinuousStates(s->c, x, n); break;
    case 2: status = fmi2GetDerivatives(s->c, x, n); break;
    default: status = fmi2GetNominalsOfContinuousStates(s->c, x, n);
    }
    free(x);
    return status;
}
static fmi2Status nothing(slot *s) {
    fmi2ValueReference vr = 0;
    switch (pick(4)) {
    case 0: return fmi2CancelStep(s->c);
    case 1: return fmi2GetString(s->c, &vr, pick(2), NULL);
    case 2: return fmi2GetEventIndicators(s->c, NULL, pick(2));
    default: return fmi2SetDebugLogging(s->c, (int)pick(2), 0, NULL);
    }
}

#define CALLS(X)                                                                                          \
    X(instantiate) X(release) X(setup) X(initialize) X(initialized) X(terminate) X(reset) X(get) X(set)    \
    X(integers) X(booleans) X(step) X(state_get) X(state_set) X(state_free) X(bytes) X(derivative) X(time_derivative)  \
    X(status_of_step) X(event) X(continuous) X(completed) X(set_time) X(states) X(nothing)
#define ENTRY(name) {#name, name, {0}},
static struct {
    const char *name;
    fmi2Status (*call)(slot *);
    unsigned long outcomes[4];
} calls[] = {CALLS(ENTRY)};
enum { COUNT = sizeof calls / sizeof calls[0] };

int main(int count, char **arguments) {
    if (count != 3) return 2;
    random_state = strtoull(arguments[1], NULL, 10) * 0x9e3779b97f4a7c15u + 1;
    for (long k = strtol(arguments[2], NULL, 10); k > 0; --k) {
        slot *s = &slots[pick(SLOTS)];
        unsigned which = !s->c ? 0 : pick(3) ? 7 + pick(5) : pick(COUNT);
        fmi2Status status = calls[which].call(s);
        if (status > fmi2Error) abort();
        ++calls[which].outcomes[status];
    }
    for (int i = 0; i < SLOTS; ++i) fmi2FreeInstance(slots[i].c);
    for (int i = 0; i < COUNT; ++i)
        printf("%s %lu %lu %lu %lu\n", calls[i].name, calls[i].outcomes[0], calls[i].outcomes[1],
               calls[i].outcomes[2], calls[i].outcomes[3]);
    return 0;
}
