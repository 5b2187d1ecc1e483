/* Time per communication step of an FMU, and of the core calls that it consists of: `fmu_step STEPS`.
 *
 * Prints nanoseconds: four evaluations and the kinematics of the core; fmi3DoStep; fmi3DoStep with setting
 * of the forces and reading of all poses and velocities. Each is the least of several rounds in turn. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "fmi3.h"
#include "lw_fmu.h"
#include "lw_multibody.h"

enum { ROUNDS = 25, MOST = 64 };

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static const double *start(unsigned section) {
    uint32_t i = 0;
    while (lw_fmu_variables[i].type != LW_TYPE_FLOAT64 || lw_fmu_variables[i].section != section) ++i;
    return lw_fmu_start + lw_fmu_variables[i].offset;
}

static lw_multibody *build(void) {
    lw_fault fault;
    lw_tables tables = {
        .n = lw_fmu_n, .nq = lw_fmu_nq, .nv = lw_fmu_nv, .closures = lw_fmu_closures,
        .forces = lw_fmu_forces,
        .parent = lw_fmu_parent, .order = lw_fmu_order, .joint_type = lw_fmu_joint_type,
        .q_index = lw_fmu_q_index, .v_index = lw_fmu_v_index,
        .parent_point = start(LW_DYNAMICS_PARENT_POINT), .parent_rotation = lw_fmu_parent_rotation,
        .child_point = start(LW_DYNAMICS_CHILD_POINT), .child_rotation = lw_fmu_child_rotation,
        .mass = start(LW_DYNAMICS_MASS), .inertia = start(LW_DYNAMICS_INERTIA),
        .gravity = start(LW_DYNAMICS_GRAVITY), .stiffness = start(LW_DYNAMICS_STIFFNESS),
        .damping = start(LW_DYNAMICS_DAMPING), .rest = start(LW_DYNAMICS_REST),
        .closure_body = lw_fmu_closure_body, .closure_rows = lw_fmu_closure_rows,
        .closure_point = lw_fmu_closure_point, .closure_rotation = lw_fmu_closure_rotation,
        .closure_length = lw_fmu_closure_length, .force_type = lw_fmu_force_type,
        .force_body = lw_fmu_force_body, .force_point = lw_fmu_force_point,
        .instructions = lw_fmu_instructions, .constants = lw_fmu_constants, .force_start = lw_fmu_force_start,
        .force_code = lw_fmu_force_code, .force_constants = lw_fmu_force_constants,
        .force_number = lw_fmu_forces ? start(LW_DYNAMICS_FORCE_NUMBER) : 0, .events = 0};
    lw_multibody *memory = malloc(lw_multibody_size(&tables));
    if (lw_multibody_init(memory, &tables, &fault)) abort();
    return memory;
}

static double time_core(lw_multibody *multibody, int steps) {
    double state[MOST] = {0.0}, out[4][4 * MOST];
    for (int k = 0; k < lw_fmu_nq + lw_fmu_nv; ++k) state[k] = start(LW_DYNAMICS_Q)[k];
    double begin = now();
    for (int k = 0; k < steps; ++k) {
        if (lw_multibody_repeat(multibody, state, 4)) abort();
        lw_multibody_motion(multibody, state, out[0], out[1], out[2], out[3]);
    }
    return (now() - begin) / steps;
}

/* References of the variables of some sections; how many values they have. */
static size_t find(unsigned first, unsigned last, fmi3ValueReference *vr, size_t *n) {
    size_t count = 0;
    *n = 0;
    for (uint32_t i = 0; i < lw_fmu_variable_count; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[i];
        if (v->type != LW_TYPE_FLOAT64 || v->section < first || v->section > last) continue;
        vr[(*n)++] = i, count += v->size;
    }
    return count;
}

static double time_fmu(int steps, int exchange_values) {
    bool flags[3];
    double last, values[16 * MOST] = {0.0}, h = 1e-4;
    fmi3ValueReference in[16 * MOST], out[16 * MOST];
    size_t n_in, n_out, count_in = find(LW_DYNAMICS_FORCE, LW_DYNAMICS_TORQUE, in, &n_in);
    size_t count_out = find(LW_DYNAMICS_POSITION, LW_DYNAMICS_ANGULAR, out, &n_out);
    fmi3Instance c = fmi3InstantiateCoSimulation("bench", lw_fmu_token, NULL, false, false, false, false, NULL, 0,
                                                 NULL, NULL, NULL);
    if (fmi3EnterInitializationMode(c, false, 0.0, 0.0, false, 0.0) || fmi3ExitInitializationMode(c)) abort();
    double begin = now();
    for (int k = 0; k < steps; ++k) {
        if (exchange_values) fmi3SetFloat64(c, in, n_in, values + count_out, count_in);
        if (fmi3DoStep(c, k * h, h, true, flags, flags + 1, flags + 2, &last)) abort();
        if (exchange_values) fmi3GetFloat64(c, out, n_out, values, count_out);
    }
    double spent = (now() - begin) / steps;
    fmi3FreeInstance(c);
    return spent;
}

static double least(double a, double b) { return a < b ? a : b; }

int main(int count, char **arguments) {
    int steps = count > 1 ? atoi(arguments[1]) : 1000;
    double core = 1e30, step = 1e30, exchanged = 1e30;
    lw_multibody *multibody = build();
    for (int k = 0; k < ROUNDS; ++k) {
        core = least(core, time_core(multibody, steps));
        step = least(step, time_fmu(steps, 0));
        exchanged = least(exchanged, time_fmu(steps, 1));
    }
    printf("%.1f %.1f %.1f\n", core, step, exchanged);
    return 0;
}
