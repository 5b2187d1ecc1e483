/* Directional and adjoint derivatives, by central differences of sixth order.
 *
 * The known values move along a direction in steps of a thousandth of what they typically vary by
 * (lw_part_scale), so that truncation and round-off are both about 1e-11. Accelerations are affine in
 * forces and quadratic in velocities: there is no truncation. At a kink of a force law (a plate whose
 * rotation changes sign) differences see both sides of it.
 */
#include <math.h>
#include <string.h>

#include "lw_part.h"

static const double relative_step = 1e-3;

/* f' = sum of weight (f(+k step) - f(-k step)) / step; B. Fornberg 1988,
 * doi:10.1090/S0025-5718-1988-0935077-0, table 1. */
static const double weights[3] = {3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0};

static int check(const lw_instance *instance, lw_variables variables, int known, const double *numbers,
                 const char *name) {
    size_t found = 0;
    if ((variables.n && !variables.references) || (variables.count && !numbers))
        return lw_missing(instance, name);
    for (size_t i = 0; i < variables.n; ++i) {
        const lw_fmu_variable *v = lw_variable(instance, variables.references[i]);
        if (!v) return LW_FMI_ERROR;
        if (v->type != LW_TYPE_FLOAT64 || (known && v->causality >= LW_CALCULATED))
            return lw_report(instance, LW_FMI_ERROR, "%s: Expected %s but was another variable.", v->name,
                             known ? "an input, state or parameter of type Float64" : "a Float64");
        found += v->size;
    }
    if (found == variables.count) return LW_FMI_OK;
    return lw_report(instance, LW_FMI_ERROR, "Expected %lu numbers for the %s but was %lu.",
                     (unsigned long)found, name, (unsigned long)variables.count);
}

/* Length of the step along the direction; 0 if it leads nowhere. Tells whether parameters move. */
static double choose_step(const lw_instance *instance, int *parameters) {
    double largest = 0.0;
    *parameters = 0;
    for (uint32_t i = 0; i < lw_fmu_variable_count; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[i];
        if (v->type != LW_TYPE_FLOAT64 || v->causality >= LW_CALCULATED) continue;
        for (uint32_t k = v->offset; k < v->offset + v->size; ++k) {
            if (instance->direction[k] == 0.0) continue;
            largest = fmax(largest, fabs(instance->direction[k]) / lw_part_scale(instance, v, k));
            *parameters |= v->causality == LW_FIXED_PARAMETER || v->causality == LW_TUNABLE_PARAMETER;
        }
    }
    return largest > 0.0 ? relative_step / largest : 0.0;
}

/* Set the known values to those saved plus `step` times the direction. */
static void move(lw_instance *instance, double step, int parameters) {
    const double *from = instance->saved + (instance->values - instance->store);
    for (size_t k = 0; k < lw_part_known(); ++k)
        if (instance->direction[k] != 0.0) instance->values[k] = from[k] + step * instance->direction[k];
    instance->unconfigured |= parameters;
    instance->stale = LW_STALE_ALL;
}

/* What to sum up: each unknown, or with `seed` their scalar product with it. */
typedef struct {
    lw_variables unknowns;
    const double *seed;
    double *sums;
} lw_target;

static void add(const lw_target *target, size_t j, double value) {
    if (target->seed)
        *target->sums += target->seed[j] * value;
    else
        target->sums[j] += value;
}

/* Unknowns that are not calculated change as the direction says. */
static void start(const lw_instance *instance, const lw_target *target) {
    size_t j = 0;
    memset(target->sums, 0, (target->seed ? 1 : target->unknowns.count) * sizeof(double));
    for (size_t i = 0; i < target->unknowns.n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[target->unknowns.references[i]];
        for (uint32_t k = 0; k < v->size; ++k, ++j)
            if (v->causality != LW_CALCULATED) add(target, j, instance->direction[v->offset + k]);
    }
}

static int evaluate(lw_instance *instance, const lw_target *target, double factor) {
    unsigned groups = 0;
    size_t j = 0;
    for (size_t i = 0; i < target->unknowns.n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[target->unknowns.references[i]];
        if (v->causality == LW_CALCULATED) groups |= lw_part_group(v->section);
    }
    int status = lw_update(instance, groups);
    for (size_t i = 0; !status && i < target->unknowns.n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[target->unknowns.references[i]];
        for (uint32_t k = 0; k < v->size; ++k, ++j)
            if (v->causality == LW_CALCULATED) add(target, j, factor * instance->values[v->offset + k]);
    }
    return status;
}

static int differentiate(lw_instance *instance, const lw_target *target) {
    int parameters, status = LW_FMI_OK;
    double step = choose_step(instance, &parameters);
    start(instance, target);
    if (step == 0.0) return LW_FMI_OK;
    memcpy(instance->saved, instance->store, instance->state_count * sizeof(double));
    for (int k = 3; k >= 1 && !status; --k)
        for (int side = -1; side <= 1 && !status; side += 2) {
            move(instance, side * k * step, parameters);
            status = evaluate(instance, target, side * weights[k - 1] / step);
        }
    memcpy(instance->store, instance->saved, instance->state_count * sizeof(double));
    instance->unconfigured |= parameters;
    instance->stale = LW_STALE_ALL;
    return status;
}

int lw_differentiate(lw_instance *instance, lw_variables unknowns, double *sensitivity) {
    lw_target target = {unknowns, NULL, sensitivity};
    return differentiate(instance, &target);
}

int lw_directional_derivative(lw_instance *instance, lw_variables unknowns, lw_variables knowns,
                              const double *seed, double *sensitivity) {
    int status = check(instance, unknowns, 0, sensitivity, "unknowns");
    if (status || (status = check(instance, knowns, 1, seed, "knowns"))) return status;
    memset(instance->direction, 0, lw_part_known() * sizeof(double));
    for (size_t i = 0; i < knowns.n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[knowns.references[i]];
        for (uint32_t k = 0; k < v->size; ++k) instance->direction[v->offset + k] += *seed++;
    }
    for (size_t k = 0; k < lw_part_known(); ++k)
        if (!isfinite(instance->direction[k]))
            return lw_report(instance, LW_FMI_ERROR, "%s: Expected a finite seed but was %g.",
                             lw_name_at(LW_TYPE_FLOAT64, (uint32_t)k), instance->direction[k]);
    status = lw_differentiate(instance, unknowns, sensitivity);
    return status ? status : lw_check_results(instance, sensitivity, unknowns.count);
}

/* One column of the Jacobian after the other, times the seed. */
int lw_adjoint_derivative(lw_instance *instance, lw_variables unknowns, lw_variables knowns,
                          const double *seed, double *sensitivity) {
    int status = check(instance, unknowns, 0, seed, "unknowns");
    if (status || (status = check(instance, knowns, 1, sensitivity, "knowns"))) return status;
    for (size_t j = 0; j < unknowns.count; ++j)
        if (!isfinite(seed[j]))
            return lw_report(instance, LW_FMI_ERROR, "Expected a finite seed but was %g.", seed[j]);
    lw_target target = {unknowns, seed, sensitivity};
    for (size_t i = 0; i < knowns.n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[knowns.references[i]];
        for (uint32_t k = 0; k < v->size; ++k, ++target.sums) {
            memset(instance->direction, 0, lw_part_known() * sizeof(double));
            instance->direction[v->offset + k] = 1.0;
            if ((status = differentiate(instance, &target))) return status;
        }
    }
    return lw_check_results(instance, sensitivity, knowns.count);
}
