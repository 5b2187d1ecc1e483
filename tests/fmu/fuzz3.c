/* Random calls of FMI 3 with random arguments: `fuzz3 SEED CALLS`.
 *
 * Every array that is passed is as long as is claimed, on the heap. A call that fails must have changed
 * nothing: the state before and after it has the same bytes. Prints, per call, how often it succeeded. */
#include "fmi3.h"
#include "fuzz.h"

enum { SLOTS = 3, STATES = 6 };

typedef struct {
    fmi3Instance c;
    fmi3FMUState states[STATES];
    int exchange;
} slot;

static slot slots[SLOTS];
static int inside; /* a callback of a step */
static slot *current;

static double now(void) {
    fmi3ValueReference time = 0;
    double t = 0.0;
    fmi3GetFloat64(current->c, &time, 1, &t, 1);
    return t;
}

/* ---- the environment's side ---- */

static size_t logged;

static void logger(fmi3InstanceEnvironment environment, fmi3Status status, fmi3String category, fmi3String message) {
    (void)environment, (void)status;
    logged += strlen(category) + strlen(message);
}

static void one_call(void);

static void update(fmi3InstanceEnvironment environment, double time, bool set, bool get, bool finished, bool can,
                   bool *wish, double *until) {
    (void)environment, (void)set, (void)get, (void)finished;
    ++inside;
    for (unsigned k = pick(4); k; --k) one_call();
    --inside;
    if (can && !pick(3)) *wish = true, *until = time;
}

/* ---- calls ---- */

static fmi3Status instantiate(slot *s) {
    if (s->c) return fmi3OK;
    const char *token = pick(10) ? lw_fmu_token : "other", *name = pick(10) ? "fuzz" : " ";
    fmi3LogMessageCallback log = pick(3) ? logger : NULL;
    bool callback = pick(2);
    memset(s->states, 0, sizeof s->states);
    s->exchange = pick(2);
    if (s->exchange)
        s->c = fmi3InstantiateModelExchange(name, token, NULL, false, pick(2), NULL, log);
    else
        s->c = fmi3InstantiateCoSimulation(name, token, NULL, false, pick(2), !pick(20), pick(2), NULL, 0, NULL, log,
                                           callback ? update : NULL);
    return s->c ? fmi3OK : fmi3Error;
}

/* Refused during a step. */
static fmi3Status release(slot *s) {
    if (pick(20)) return fmi3OK;
    fmi3FreeInstance(s->c);
    if (!inside) s->c = NULL;
    return fmi3OK;
}

static fmi3Status initialize(slot *s) {
    double start = pick(4) ? 0.0 : number(), stop = pick(2) ? start + 0.2 : number();
    return fmi3EnterInitializationMode(s->c, pick(2), number(), start, pick(2), stop);
}
static fmi3Status initialized(slot *s) { return fmi3ExitInitializationMode(s->c); }
static fmi3Status terminate(slot *s) { return pick(10) ? fmi3OK : fmi3Terminate(s->c); }
static fmi3Status reset(slot *s) { return pick(3) ? fmi3OK : fmi3Reset(s->c); }

static fmi3Status get(slot *s) {
    list l = references(LW_TYPE_FLOAT64);
    double *values = numbers(l.count);
    fmi3Status status = fmi3GetFloat64(s->c, l.vr, l.n, values, l.count);
    for (size_t i = 0; status == fmi3OK && i < l.count; ++i)
        if (!isfinite(values[i])) abort();
    free(values), free(l.vr);
    return status;
}

static fmi3Status set(slot *s) {
    list l = references(LW_TYPE_FLOAT64);
    double *values = numbers(l.count);
    soothe(l, values);
    fmi3Status status = fmi3SetFloat64(s->c, l.vr, l.n, pick(50) ? values : NULL, l.count);
    free(values), free(l.vr);
    return status;
}

static fmi3Status integers(slot *s) {
    list l = references(LW_TYPE_INT32);
    int32_t *values = malloc(l.count * sizeof *values + 1);
    /* Not 3: an adaptive integrator rightly takes for ever under forces of 1e10 N. */
    for (size_t i = 0; i < l.count; ++i) values[i] = pick(50) ? 1 + (int32_t)pick(2) : 9 - (int32_t)pick(2) * 11;
    fmi3Status status = fmi3SetInt32(s->c, l.vr, l.n, values, l.count);
    if (pick(2)) status = fmi3GetInt32(s->c, l.vr, l.n, values, l.count);
    free(values), free(l.vr);
    return status;
}

static fmi3Status booleans(slot *s) {
    list l = references(LW_TYPE_BOOLEAN);
    bool *values = malloc(l.count * sizeof *values + 1);
    for (size_t i = 0; i < l.count; ++i) values[i] = pick(2);
    fmi3Status status = fmi3SetBoolean(s->c, l.vr, l.n, pick(50) ? values : NULL, l.count);
    if (pick(2)) status = fmi3GetBoolean(s->c, l.vr, l.n, values, l.count);
    free(values), free(l.vr);
    return status;
}

static fmi3Status step(slot *s) {
    bool a, b, c;
    double last, point = pick(10) ? now() : number(), size = pick(10) ? 1e-3 * (1 + pick(5)) : number();
    return fmi3DoStep(s->c, point, size, pick(2), pick(50) ? &a : NULL, &b, &c, &last);
}

static fmi3Status state_get(slot *s) { return fmi3GetFMUState(s->c, &s->states[pick(STATES)]); }
/* Also another instance's, and with a little luck one that is freed. */
static fmi3Status state_set(slot *s) {
    slot *from = pick(10) ? s : &slots[pick(SLOTS)];
    return fmi3SetFMUState(s->c, from->states[pick(STATES)]);
}
static fmi3Status state_free(slot *s) {
    fmi3FMUState *of = &s->states[pick(STATES)], copy = *of;
    return fmi3FreeFMUState(s->c, pick(4) ? of : &copy);
}

static fmi3Status bytes(slot *s) {
    size_t size;
    fmi3FMUState made = NULL;
    fmi3Status status = fmi3SerializedFMUStateSize(s->c, s->states[pick(STATES)], &size);
    if (status) return status;
    unsigned char *data = malloc(size);
    status = fmi3SerializeFMUState(s->c, s->states[0], data, pick(10) ? size : size - 1);
    if (!status && pick(2)) data[pick((unsigned)size)] ^= (unsigned char)(1 + pick(255));
    if (!status) status = fmi3DeserializeFMUState(s->c, data, pick(10) ? size : size - 1, &made);
    if (!status) status = fmi3FreeFMUState(s->c, &made);
    free(data);
    return status;
}

static fmi3Status derivative(slot *s) {
    list of = references(LW_TYPE_FLOAT64), by = references(LW_TYPE_FLOAT64);
    int adjoint = pick(2);
    double *seed = numbers(adjoint ? of.count : by.count), *result = numbers(adjoint ? by.count : of.count);
    fmi3Status status =
        adjoint ? fmi3GetAdjointDerivative(s->c, of.vr, of.n, by.vr, by.n, seed, of.count, result, by.count)
                : fmi3GetDirectionalDerivative(s->c, of.vr, of.n, by.vr, by.n, seed, by.count, result, of.count);
    free(seed), free(result), free(of.vr), free(by.vr);
    return status;
}

static fmi3Status output_derivative(slot *s) {
    list l = references(LW_TYPE_FLOAT64);
    double *values = numbers(l.count);
    int32_t orders[5] = {1, 1, 1, 1, 1};
    if (!pick(10)) orders[0] = (int32_t)pick(4);
    fmi3Status status = fmi3GetOutputDerivatives(s->c, l.vr, l.n, orders, values, l.count);
    free(values), free(l.vr);
    return status;
}

static fmi3Status event(slot *s) { return fmi3EnterEventMode(s->c); }
static fmi3Status continuous(slot *s) { return fmi3EnterContinuousTimeMode(s->c); }
static fmi3Status discrete(slot *s) {
    bool f[5];
    double next;
    return fmi3UpdateDiscreteStates(s->c, f, f + 1, f + 2, f + 3, f + 4, pick(20) ? &next : NULL);
}
static fmi3Status completed(slot *s) {
    bool enter, stop;
    return fmi3CompletedIntegratorStep(s->c, pick(2), &enter, pick(20) ? &stop : NULL);
}
static fmi3Status set_time(slot *s) { return fmi3SetTime(s->c, number()); }
static fmi3Status states(slot *s) {
    size_t n = 0;
    fmi3Status status = fmi3GetNumberOfContinuousStates(s->c, &n);
    n += !pick(20);
    double *x = numbers(n);
    unsigned what = pick(4);
    if (what == 0) status = fmi3GetContinuousStates(s->c, x, n);
    if (what == 1) status = fmi3SetContinuousStates(s->c, x, n);
    if (what == 2) status = fmi3GetContinuousStateDerivatives(s->c, x, n);
    if (what == 3) status = fmi3GetNominalsOfContinuousStates(s->c, x, n);
    free(x);
    return status;
}
static fmi3Status nothing(slot *s) {
    fmi3ValueReference vr = 0;
    double x;
    switch (pick(5)) {
    case 0: return fmi3EnterStepMode(s->c);
    case 1: return fmi3GetIntervalDecimal(s->c, &vr, 1, &x, NULL);
    case 2: return fmi3GetString(s->c, &vr, pick(2), NULL, 0);
    case 3: return fmi3EnterConfigurationMode(s->c);
    default: return fmi3SetDebugLogging(s->c, pick(2), 0, NULL);
    }
}

#define CALLS(X)                                                                                          \
    X(instantiate) X(release) X(initialize) X(initialized) X(terminate) X(reset)                           \
    X(get) X(set) X(integers) X(booleans) X(step) X(state_get) X(state_set) X(state_free) X(bytes) X(derivative)       \
    X(output_derivative) X(event) X(continuous) X(discrete) X(completed) X(set_time) X(states) X(nothing)
#define ENTRY(name) {#name, name, {0}},
static struct {
    const char *name;
    fmi3Status (*call)(slot *);
    unsigned long outcomes[4];
} calls[] = {CALLS(ENTRY)};
enum { COUNT = sizeof calls / sizeof calls[0] };

/* The bytes of the present state. */
static unsigned char *image(slot *s, size_t *size) {
    fmi3FMUState state = NULL;
    if (fmi3GetFMUState(s->c, &state) || fmi3SerializedFMUStateSize(s->c, state, size)) abort();
    unsigned char *data = malloc(*size);
    if (fmi3SerializeFMUState(s->c, state, data, *size) || fmi3FreeFMUState(s->c, &state)) abort();
    return data;
}

static void one_call(void) {
    slot *s = inside ? current : &slots[pick(SLOTS)];
    unsigned which = !s->c ? 0 : pick(3) ? 6 + pick(5) : pick(COUNT); /* get, set, integers, booleans, step: most of life */
    size_t size = 0, same = 0;
    unsigned char *was = s->c && !inside ? image(s, &size) : NULL, *is = NULL;
    current = s;
    fmi3Status status = calls[which].call(s);
    if (status > fmi3Error) abort();
    ++calls[which].outcomes[status];
    if (was && s->c && status > fmi3Warning) {
        is = image(s, &same);
        if (size != same || memcmp(was, is, size)) {
            printf("%s changed something though it failed\n", calls[which].name);
            abort();
        }
    }
    free(was), free(is);
}

int main(int count, char **arguments) {
    if (count != 3) return 2;
    random_state = strtoull(arguments[1], NULL, 10) * 0x9e3779b97f4a7c15u + 1;
    for (long k = strtol(arguments[2], NULL, 10); k > 0; --k) one_call();
    for (int i = 0; i < SLOTS; ++i) fmi3FreeInstance(slots[i].c);
    for (int i = 0; i < COUNT; ++i)
        printf("%s %lu %lu %lu %lu\n", calls[i].name, calls[i].outcomes[0], calls[i].outcomes[1],
               calls[i].outcomes[2], calls[i].outcomes[3]);
    return 0;
}
