/* The mechanism: wrenches in, motion out. Numbers of the core are used as they come. */
#include <math.h>
#include <string.h>

#include "lw_model.h"
#include "lw_part.h"

enum { MAX_ORDER = 3 }; /* of input derivatives */
enum { PROPOSED, ORDER, RATES }; /* memory: substep of dopri5 [s], order and values of input derivatives */
enum { RATE = 1, MOTION = 2, ACCELERATION = 4, ENERGY = 8, EVENTS = 16 }; /* groups */

static const double drifted = 1e-9;  /* m, rad: loops that are open by more are closed in an event */
static const double slack = 1e-9;    /* of an indicator that a solver has found the zero of */
static const double not_yet = -1.0;  /* time of an event */
static const double ordered = -2.0;  /* of one that shall happen as soon as possible */

struct lw_part {
    uint32_t first[LW_DYNAMICS_SECTIONS + 1];
    lw_multibody *multibody;
    double *state, *wrench, *inputs; /* the last two at the nodes of a polynomial */
    double *stages;                  /* memory of radau5, if it is there */
    lw_evaluation out;
    const double *added; /* added inertia, NULL where it is zero */
};

/* Index of the first value of a section; the values themselves. */
#define FIRST(name) (instance->part->first[LW_DYNAMICS_##name])
#define AT(name) (instance->values + FIRST(name))

/* ---- layout ---- */

#define COUNT(name, size) count += (size_t)(size);

size_t lw_part_known(void) {
    int32_t n = lw_fmu_n, nq = lw_fmu_nq, nv = lw_fmu_nv;
    size_t count = 0;
    LW_DYNAMICS_KNOWN(COUNT)
    return count;
}

size_t lw_part_values(void) {
    int32_t n = lw_fmu_n, nq = lw_fmu_nq, nv = lw_fmu_nv;
    size_t count = lw_part_known();
    LW_DYNAMICS_CALCULATED(COUNT)
    return count;
}

static size_t forces(void) { return 6 * (size_t)lw_fmu_n; }

/* Inputs that are polynomials in time: forces and torques, and those of force elements. */
static size_t varying(void) { return forces() + (size_t)lw_fmu_inputs; }

/* When each event happened, and what its command was then, come last in the memory. */
static size_t rates_end(void) { return RATES + MAX_ORDER * varying(); }
static double *event_times(const lw_instance *instance) { return instance->store + rates_end(); }
static double *past_commands(const lw_instance *instance) { return event_times(instance) + lw_fmu_events; }

size_t lw_part_memory(void) { return rates_end() + 2 * (size_t)lw_fmu_events; }

/* What of the mechanism is constant. */
static lw_tables constants(void) {
    lw_tables tables = {
        .n = lw_fmu_n, .nq = lw_fmu_nq, .nv = lw_fmu_nv, .closures = lw_fmu_closures,
        .forces = lw_fmu_forces,
        .parent = lw_fmu_parent, .order = lw_fmu_order, .joint_type = lw_fmu_joint_type,
        .q_index = lw_fmu_q_index, .v_index = lw_fmu_v_index,
        .parent_rotation = lw_fmu_parent_rotation, .child_rotation = lw_fmu_child_rotation,
        .closure_body = lw_fmu_closure_body, .closure_rows = lw_fmu_closure_rows,
        .closure_point = lw_fmu_closure_point, .closure_rotation = lw_fmu_closure_rotation,
        .closure_length = lw_fmu_closure_length, .force_type = lw_fmu_force_type,
        .force_body = lw_fmu_force_body, .force_point = lw_fmu_force_point,
        .instructions = lw_fmu_instructions, .constants = lw_fmu_constants, .force_start = lw_fmu_force_start,
        .force_code = lw_fmu_force_code, .force_constants = lw_fmu_force_constants,
        .inputs = lw_fmu_inputs, .force_input = lw_fmu_force_input,
        .events = lw_fmu_events, .event_joint = lw_fmu_event_joint, .event_action = lw_fmu_event_action,
        .event_occasion = lw_fmu_event_occasion, .event_side = lw_fmu_event_side,
        .event_threshold = lw_fmu_event_threshold, .event_restitution = lw_fmu_event_restitution};
    return tables;
}

size_t lw_part_size(void) {
    lw_tables tables = constants();
    size_t doubles = lw_state_size() + 1 + (size_t)lw_fmu_events + (MAX_ORDER + 1) * varying() + 3 * forces();
    doubles += (size_t)lw_fmu_nv;
    doubles += 6 * (size_t)lw_fmu_closures + 2 * (size_t)lw_fmu_forces + lw_radau5_size(lw_fmu_nq, lw_fmu_nv);
    return (sizeof(lw_part) + 7) / 8 * 8 + doubles * sizeof(double) + (lw_multibody_size(&tables) + 7) / 8 * 8;
}

void lw_part_create(lw_instance *instance) {
    lw_part *part = instance->part;
    int32_t n = lw_fmu_n, nq = lw_fmu_nq, nv = lw_fmu_nv;
    uint32_t count = 0, *first = part->first;
#define PLACE(name, size) *first++ = count, count += (uint32_t)(size);
    LW_DYNAMICS_KNOWN(PLACE) LW_DYNAMICS_CALCULATED(PLACE)
    *first = count;
    double *next = (double *)(void *)((char *)part + (sizeof *part + 7) / 8 * 8);
    part->state = next, next += lw_state_size() + 1 + (size_t)lw_fmu_events;
    part->wrench = next, next += (MAX_ORDER + 1) * forces();
    part->inputs = next, next += (MAX_ORDER + 1) * lw_fmu_inputs;
    part->out.acceleration = next, next += forces();
    part->out.reaction = next, next += forces();
    part->out.total_wrench = next, next += forces();
    part->out.joint_acceleration = next, next += lw_fmu_nv;
    part->out.closure_reaction = next, next += 6 * lw_fmu_closures;
    part->out.effort = next, next += lw_fmu_forces;
    part->out.power = next, next += lw_fmu_forces;
    part->stages = next, next += lw_radau5_size(lw_fmu_nq, lw_fmu_nv);
    part->multibody = (lw_multibody *)(void *)next;
}

void lw_part_restart(lw_instance *instance) {
    memset(instance->store, 0, lw_part_memory() * sizeof(double));
    for (int32_t i = 0; i < lw_fmu_events; ++i) event_times(instance)[i] = not_yet;
}

uint32_t lw_part_first(const lw_instance *instance, unsigned section) {
    return instance->part->first[section];
}

uint32_t lw_part_inputs(const lw_instance *instance) { return FIRST(FORCE); }

uint32_t lw_part_states(const lw_instance *instance) { return FIRST(Q); }

uint32_t lw_part_derivatives(const lw_instance *instance, unsigned *groups) {
    *groups = RATE | ACCELERATION;
    return FIRST(DER_Q);
}

/* ---- parameters ---- */

static int refuse(const lw_instance *instance, uint32_t index, const char *expected) {
    return lw_report(instance, LW_FMI_ERROR, "%s: Expected %s but was %.17g.",
                     lw_name_at(LW_TYPE_FLOAT64, index), expected, instance->values[index]);
}

/* Name the parameter that the core objects to. */
static int refuse_table(const lw_instance *instance, int status, const lw_fault *fault) {
    uint32_t row = (uint32_t)fault->item, inertia = FIRST(INERTIA) + 6 * row;
    switch (status) {
    case LW_BAD_MASS: return refuse(instance, FIRST(MASS) + row, "a mass of zero or more");
    case LW_BAD_INERTIA:
        for (int k = 0; k < 2 && instance->values[inertia] >= 0.0; ++k) ++inertia;
        return refuse(instance, inertia, "a moment of inertia of zero or more");
    case LW_BAD_REST:
        return refuse(instance, FIRST(REST) + (uint32_t)lw_fmu_q_index[row], "a rest with a rotation");
    default:
        return lw_report(instance, LW_FMI_ERROR, "Expected a mechanism but was trouble %d in row %d.", status,
                         fault->item);
    }
}

static int check_solver(const lw_instance *instance) {
    int32_t integrator = instance->integers[LW_INTEGRATOR], substeps = instance->integers[LW_SUBSTEPS];
    double rtol = *AT(RTOL), atol = *AT(ATOL);
    int implicit = lw_radau5_size(lw_fmu_nq, lw_fmu_nv) > 0;
    if (integrator < LW_EULER || integrator > (implicit ? LW_RADAU5 : LW_DOPRI5))
        return lw_report(instance, LW_FMI_ERROR, "%s: Expected 0 euler, 1 semi-implicit euler, 2 rk4, 3 dopri5%s "
                         "but was %d.", lw_name_at(LW_TYPE_INT32, LW_INTEGRATOR), implicit ? " or 4 radau5" : "",
                         integrator);
    if (substeps < 1)
        return lw_report(instance, LW_FMI_ERROR, "%s: Expected at least 1 but was %d.",
                         lw_name_at(LW_TYPE_INT32, LW_SUBSTEPS), substeps);
    if (!(rtol >= 0.0)) return refuse(instance, FIRST(RTOL), "zero or more");
    if (!(atol > 0.0)) return refuse(instance, FIRST(ATOL), "more than zero");
    return LW_FMI_OK;
}

int lw_part_configure(lw_instance *instance) {
    lw_fault fault;
    int status = check_solver(instance);
    lw_tables tables = constants();
    tables.parent_point = AT(PARENT_POINT), tables.child_point = AT(CHILD_POINT);
    tables.mass = AT(MASS), tables.inertia = AT(INERTIA), tables.gravity = AT(GRAVITY);
    tables.stiffness = AT(STIFFNESS), tables.damping = AT(DAMPING), tables.rest = AT(REST);
    tables.force_number = AT(FORCE_NUMBER);
    if (status) return status;
    status = lw_multibody_init(instance->part->multibody, &tables, &fault);
    return status ? refuse_table(instance, status, &fault) : LW_FMI_OK;
}

/* ---- trouble of the core ---- */

static int discard(const lw_instance *instance, int status, const lw_fault *fault) {
    const char *expected = "numbers that stay finite", *was = "an overflow";
    if (status == LW_SINGULAR) expected = "a joint with inertia to move", was = "a massless body";
    if (status == LW_OPEN) expected = "loops that stay closed", was = "one that does not reach";
    if (status == LW_FORCE_NOT_FINITE) expected = "an expression that gives numbers", was = "one that does not";
    if (status == LW_POINTS_MEET) expected = "points apart", was = "two that coincide";
    if (status == LW_NEWTON) expected = "Newton's method of radau5 to converge", was = "not so in these substeps";
    if (status == LW_STEP_UNDERFLOW) expected = "a substep that meets the tolerance", was = "none";
    return lw_report(instance, LW_FMI_DISCARD, "Expected %s but was %s at body, loop or force %d, %.9g s into the step.",
                     expected, was, fault->item, fault->time);
}

/* ---- inputs ---- */

/* An input `dt` [s] into the step: its Taylor polynomial; `i` counts from the first force. */
static double input_at(const lw_instance *instance, size_t i, double dt) {
    const double *rate = instance->store + RATES + i;
    int order = (int)instance->store[ORDER];
    double value = AT(FORCE)[i], factor = 1.0;
    for (int k = 1; k <= order; ++k, rate += varying()) {
        factor *= dt / k;
        value += factor * *rate;
    }
    return value;
}

/* Forces and torques, (n, 6), and inputs of force elements, as the core takes them. */
static void pack(const lw_instance *instance, double dt, double *wrench, double *inputs) {
    size_t torque = 3 * (size_t)lw_fmu_n;
    for (size_t i = forces(); i < varying(); ++i) *inputs++ = input_at(instance, i, dt);
    for (size_t i = 0; i < torque; i += 3, wrench += 6)
        for (size_t axis = 0; axis < 3; ++axis) {
            wrench[axis] = input_at(instance, i + axis, dt);
            wrench[3 + axis] = input_at(instance, torque + i + axis, dt);
        }
}

static void take_inputs(const lw_instance *instance) {
    lw_part *part = instance->part;
    pack(instance, 0.0, part->wrench, part->inputs);
    lw_multibody_set_inputs(part->multibody, part->inputs);
}

/* Where the added inertia is, if it is not zero. */
static const double *find_added(lw_instance *instance) {
    if (!(instance->stale & LW_STALE_INPUTS)) return instance->part->added;
    const double *added = AT(ADDED_INERTIA);
    instance->part->added = NULL;
    for (size_t k = 0; k < 6 * forces(); ++k)
        if (added[k] != 0.0) instance->part->added = added;
    instance->stale &= ~LW_STALE_INPUTS;
    return instance->part->added;
}

int lw_part_set_input_derivative(lw_instance *instance, uint32_t index, int32_t order, double value) {
    uint32_t first = FIRST(FORCE);
    double *memory = instance->store;
    if (index - first >= varying()) return 0;
    memory[RATES + (size_t)(order - 1) * varying() + (index - first)] = value;
    if (order > memory[ORDER]) memory[ORDER] = order;
    return 1;
}

/* ---- outputs ---- */

unsigned lw_part_group(unsigned number) {
    switch (number) {
    case LW_DYNAMICS_DER_Q: return RATE;
    case LW_DYNAMICS_POSITION:
    case LW_DYNAMICS_ORIENTATION:
    case LW_DYNAMICS_LINEAR:
    case LW_DYNAMICS_ANGULAR: return MOTION;
    case LW_DYNAMICS_EVENT_TIME:
    case LW_DYNAMICS_EVENT_INDICATOR: return EVENTS;
    case LW_DYNAMICS_KINETIC_ENERGY:
    case LW_DYNAMICS_POTENTIAL_ENERGY: return ENERGY;
    default: return ACCELERATION;
    }
}

static void load_state(lw_instance *instance) {
    lw_part *part = instance->part;
    memcpy(part->state, AT(Q), lw_state_size() * sizeof(double));
    part->state[lw_state_size()] = instance->store[PROPOSED];
    memcpy(part->state + lw_state_size() + 1, event_times(instance), (size_t)lw_fmu_events * sizeof(double));
}

static void store_state(lw_instance *instance) {
    const double *state = instance->part->state;
    memcpy(AT(Q), state, lw_state_size() * sizeof(double));
    instance->store[PROPOSED] = state[lw_state_size()];
    memcpy(event_times(instance), state + lw_state_size() + 1, (size_t)lw_fmu_events * sizeof(double));
}

static void split(int32_t count, const double *six, double *linear, double *angular) {
    for (int i = 0; i < count; ++i) {
        memcpy(linear + 3 * i, six + 6 * i, 3 * sizeof(double));
        memcpy(angular + 3 * i, six + 6 * i + 3, 3 * sizeof(double));
    }
}

static int update_acceleration(lw_instance *instance) {
    lw_part *part = instance->part;
    lw_fault fault;
    take_inputs(instance);
    int status = lw_multibody_evaluate(part->multibody, part->state, instance->time, part->wrench,
                                       find_added(instance),
                                       &part->out, &fault);
    if (status) return discard(instance, status, &fault);
    memcpy(AT(DER_V), part->out.joint_acceleration, (size_t)lw_fmu_nv * sizeof(double));
    split(lw_fmu_n, part->out.acceleration, AT(LINEAR_ACCELERATION), AT(ANGULAR_ACCELERATION));
    split(lw_fmu_n, part->out.reaction, AT(REACTION_FORCE), AT(REACTION_TORQUE));
    memcpy(AT(FORCE_EFFORT), part->out.effort, (size_t)lw_fmu_forces * sizeof(double));
    memcpy(AT(FORCE_POWER), part->out.power, (size_t)lw_fmu_forces * sizeof(double));
    split(lw_fmu_closures, part->out.closure_reaction, AT(CLOSURE_FORCE), AT(CLOSURE_TORQUE));
    return LW_FMI_OK;
}

static int update_events(lw_instance *instance) {
    lw_part *part = instance->part;
    lw_fault fault;
    size_t bytes = (size_t)lw_fmu_events * sizeof(double);
    memcpy(AT(EVENT_TIME), event_times(instance), bytes);
    if (!lw_fmu_events) return LW_FMI_OK;
    take_inputs(instance);
    int status = lw_multibody_indicators(part->multibody, part->state, instance->time, part->wrench,
                                         find_added(instance), AT(EVENT_INDICATOR), &fault);
    return status ? discard(instance, status, &fault) : LW_FMI_OK;
}

int lw_part_update(lw_instance *instance, unsigned groups) {
    lw_part *part = instance->part;
    lw_multibody *mb = part->multibody;
    lw_fault fault;
    int status = LW_FMI_OK;
    load_state(instance);
    /* What motions prescribe is no matter of the importer's integrator. */
    if (instance->kind == LW_MODEL_EXCHANGE)
        status = lw_multibody_prescribe(mb, part->state, instance->time, &fault);
    if (status) return discard(instance, status, &fault);
    if (groups & RATE) {
        memset(AT(DER_Q), 0, (size_t)lw_fmu_nq * sizeof(double)); /* room that no joint uses */
        lw_modes(mb, part->state + lw_state_size() + 1);
        lw_coordinate_rate(mb, part->state, part->state + lw_fmu_nq, AT(DER_Q));
    }
    if (groups & EVENTS && (status = update_events(instance))) return status;
    if (groups & ENERGY) lw_multibody_energy(mb, part->state, AT(KINETIC_ENERGY), AT(POTENTIAL_ENERGY));
    if (groups & MOTION)
        lw_multibody_motion(mb, part->state, AT(POSITION), AT(ORIENTATION), AT(LINEAR), AT(ANGULAR));
    return groups & ACCELERATION ? update_acceleration(instance) : LW_FMI_OK;
}

int32_t lw_part_output_order(void) { return 1; }

int lw_part_rate(unsigned number) {
    switch (number) {
    case LW_DYNAMICS_Q: return LW_DYNAMICS_DER_Q;
    case LW_DYNAMICS_V: return LW_DYNAMICS_DER_V;
    case LW_DYNAMICS_POSITION: return LW_DYNAMICS_LINEAR;
    case LW_DYNAMICS_LINEAR: return LW_DYNAMICS_LINEAR_ACCELERATION;
    case LW_DYNAMICS_ANGULAR: return LW_DYNAMICS_ANGULAR_ACCELERATION;
    default: return -1;
    }
}

/* ---- commands ---- */

/* Events whose command has become true, if they have not happened yet: as soon as possible. */
static void order_events(lw_instance *instance) {
    double *time = instance->part->state + lw_state_size() + 1;
    for (int32_t i = 0; i < lw_fmu_events; ++i)
        if (AT(EVENT_COMMAND)[i] > past_commands(instance)[i] && time[i] == not_yet) time[i] = ordered;
}

static void remember_commands(lw_instance *instance) {
    memcpy(past_commands(instance), AT(EVENT_COMMAND), (size_t)lw_fmu_events * sizeof(double));
}

/* ---- steps ---- */

/* Equal substeps under a held wrench are steps of their own; the others are one. */
int32_t lw_part_pieces(const lw_instance *instance) {
    int splits = instance->integers[LW_INTEGRATOR] != LW_DOPRI5 && instance->store[ORDER] == 0.0;
    return splits ? instance->integers[LW_SUBSTEPS] : 1;
}

/* Time [s]; whole nanoseconds are meant where there are nearly whole ones, however the environment sums up its
 * steps, so that an event falls on the same bit as in a run. */
static double snapped(double time) {
    double ns = 1e9 * time, whole = floor(ns + 0.5);
    return fabs(ns - whole) < 1e-3 ? whole / 1e9 : time;
}

int lw_part_advance(lw_instance *instance, double h, int32_t pieces) {
    lw_part *part = instance->part;
    double nodes[MAX_ORDER + 1] = {0.0}, work[2];
    int order = (int)instance->store[ORDER];
    lw_fault fault = {0, 0.0};
    load_state(instance);
    order_events(instance);
    for (int i = 0; i <= order; ++i) {
        if (order) nodes[i] = (double)i / order;
        pack(instance, nodes[i] * h, part->wrench + (size_t)i * forces(), part->inputs + i * lw_fmu_inputs);
    }
    lw_macro_step step = {
        .state = part->state, .h = h, .time = snapped(instance->time),
        .nodes = nodes, .wrenches = part->wrench, .inputs = lw_fmu_inputs ? part->inputs : NULL, .count = order + 1,
        .added_inertia = find_added(instance), .integrator = instance->integers[LW_INTEGRATOR],
        .substeps = pieces > 1 ? 1 : instance->integers[LW_SUBSTEPS],
        .rtol = *AT(RTOL), .atol = *AT(ATOL),
        .next = part->state, .work = work, .fault = &fault,
        .memory = part->stages};
    int status = lw_multibody_advance(part->multibody, &step);
    if (status) return discard(instance, status, &fault);
    store_state(instance);
    remember_commands(instance);
    if (order) memset(instance->store + ORDER, 0, (rates_end() - ORDER) * sizeof(double));
    return LW_FMI_OK;
}

/* ---- events ---- */

size_t lw_part_indicators(const lw_instance *instance, uint32_t *first, unsigned *group) {
    *first = FIRST(EVENT_INDICATOR), *group = EVENTS;
    return (size_t)lw_fmu_events;
}

/* Largest violation of a loop; 0 without loops. */
static double loops_open(lw_instance *instance) {
    lw_multibody *mb = instance->part->multibody;
    double largest = 0.0;
    if (!mb->rows) return largest;
    load_state(instance);
    lw_multibody_closure_values(mb, instance->part->state);
    for (int32_t i = 0; i < mb->rows; ++i) largest = fmax(largest, fabs(mb->row[i].value));
    return largest;
}

/* A solver knows nothing of the loops: what it has drifted from them is taken back in an event. */
void lw_part_accept(lw_instance *instance, int *event) { *event = loops_open(instance) > drifted; }

int lw_part_event(lw_instance *instance, int *changed, double *next) {
    lw_part *part = instance->part;
    lw_fault fault;
    int status = LW_OK;
    load_state(instance);
    order_events(instance);
    take_inputs(instance);
    if (lw_fmu_events)
        status = lw_multibody_happen(part->multibody, part->state, instance->time, slack, part->wrench,
                                     find_added(instance), &fault);
    if (!status && part->multibody->rows) status = lw_multibody_close(part->multibody, part->state, &fault);
    if (status) return discard(instance, status, &fault);
    *changed = memcmp(AT(Q), part->state, lw_state_size() * sizeof(double)) != 0 ||
               memcmp(event_times(instance), part->state + lw_state_size() + 1,
                      (size_t)lw_fmu_events * sizeof(double)) != 0;
    store_state(instance);
    remember_commands(instance);
    instance->stale |= LW_STALE_ALL & ~LW_STALE_INPUTS;
    *next = HUGE_VAL;
    for (int32_t i = 0; i < lw_fmu_events; ++i)
        if (lw_fmu_event_occasion[i] == LW_ON_TIME && !(event_times(instance)[i] >= 0.0))
            *next = fmin(*next, lw_fmu_event_threshold[i]);
    return LW_FMI_OK;
}

/* ---- scales of differences ---- */

/* What resists along one of the six directions of a body: mass, or a moment of inertia. */
static double resistance(const lw_instance *instance, uint32_t body, uint32_t direction) {
    const double *mass = AT(MASS) + body;
    const double *inertia = AT(INERTIA) + 6 * body;
    const double *added = AT(ADDED_INERTIA) + 36 * body;
    double largest = fmax(inertia[0], fmax(inertia[1], inertia[2]));
    return (direction < 3 ? *mass : largest) + fabs(added[7 * direction]);
}

static double length_scale(const lw_instance *instance, const double *points, uint32_t body) {
    lw_vec3 point = lw_load3(points + 3 * body);
    double mass = resistance(instance, body, 0), inertia = resistance(instance, body, 3);
    double sum = lw_norm(point) + (mass > 0.0 ? sqrt(inertia / mass) : 0.0);
    return sum > 0.0 ? sum : 1.0;
}

double lw_part_scale(const lw_instance *instance, const lw_fmu_variable *variable, uint32_t index) {
    uint32_t place = index - instance->part->first[variable->section], body = place / 36;
    double size = fabs(instance->values[index]), scale = size;
    switch (variable->section) {
    case LW_DYNAMICS_Q:
    case LW_DYNAMICS_REST: return 1.0;
    case LW_DYNAMICS_V:
    case LW_DYNAMICS_FORCE:
    case LW_DYNAMICS_TORQUE:
    case LW_DYNAMICS_GRAVITY:
    case LW_DYNAMICS_STIFFNESS:
    case LW_DYNAMICS_DAMPING:
    case LW_DYNAMICS_FORCE_NUMBER: return 100.0 * fmax(1.0, size); /* no truncation */
    case LW_DYNAMICS_PARENT_POINT: return length_scale(instance, AT(PARENT_POINT), place / 3);
    case LW_DYNAMICS_CHILD_POINT: return length_scale(instance, AT(CHILD_POINT), place / 3);
    case LW_DYNAMICS_INERTIA:
        if (place % 6 > 2) scale = resistance(instance, place / 6, 3);
        break;
    case LW_DYNAMICS_FORCE_INPUT: return fmax(1.0, size);
    case LW_DYNAMICS_ADDED_INERTIA:
        scale = sqrt(resistance(instance, body, place % 36 / 6) * resistance(instance, body, place % 6));
        break;
    default: break;
    }
    return scale > 0.0 ? scale : 1.0;
}
