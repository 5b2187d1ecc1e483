/* Reading and writing variables; calculated ones when they are asked for. */
#include <math.h>
#include <string.h>

#include "lw_part.h"

/* ---- looking up ---- */

const lw_fmu_variable *lw_variable(const lw_instance *instance, uint32_t reference) {
    if (reference < lw_fmu_variable_count) return &lw_fmu_variables[reference];
    lw_report(instance, LW_FMI_ERROR, "Expected a value reference below %lu but was %lu.",
              (unsigned long)lw_fmu_variable_count, (unsigned long)reference);
    return NULL;
}

const char *lw_name_at(int type, uint32_t index) {
    for (uint32_t i = 0; i < lw_fmu_variable_count; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[i];
        if (v->type == type && index >= v->offset && index - v->offset < v->size) return v->name;
    }
    return "a constant of the model";
}

/* The variable, if it is of the type; time is a Float64. */
static const lw_fmu_variable *typed(const lw_instance *instance, uint32_t reference, int type) {
    static const char *const names[] = {"Float64", "Float64", "Int32", "Boolean"};
    const lw_fmu_variable *v = lw_variable(instance, reference);
    if (!v || (v->type == LW_TYPE_TIME ? LW_TYPE_FLOAT64 : v->type) == type) return v;
    lw_report(instance, LW_FMI_ERROR, "%s: Expected a variable of type %s but was %s.", v->name, names[type],
              names[v->type]);
    return NULL;
}

/* Do the references name `count` values of the type? For writing: that may be set now? */
static int check(const lw_instance *instance, const uint32_t *references, size_t n, const void *values,
                 size_t count, int type, int writing) {
    size_t found = 0;
    if (n && !references) return lw_missing(instance, "valueReferences");
    if (count && !values) return lw_missing(instance, "values");
    for (size_t i = 0; i < n; ++i) {
        const lw_fmu_variable *v = typed(instance, references[i], type);
        if (!v) return LW_FMI_ERROR;
        if (writing && !(lw_settable[v->causality] & instance->mode))
            return lw_report(instance, LW_FMI_ERROR,
                             "%s: Expected a variable that may be set in this state but was another.",
                             v->name);
        found += v->size;
    }
    if (found == count) return LW_FMI_OK;
    return lw_report(instance, LW_FMI_ERROR, "Expected nValues = %lu but was %lu.", (unsigned long)found,
                     (unsigned long)count);
}

/* ---- calculated values ---- */

int lw_update(lw_instance *instance, unsigned groups) {
    groups &= instance->stale;
    if (!groups) return LW_FMI_OK;
    if (instance->unconfigured) {
        int status = lw_part_configure(instance);
        if (status) return status;
        instance->unconfigured = 0;
    }
    int status = lw_part_update(instance, groups);
    if (!status) instance->stale &= ~groups;
    return status;
}

/* What went in was finite: what is not so any more is too large to compute with. */
static int overflow(const lw_instance *instance, const char *name, double value) {
    return lw_report(instance, LW_FMI_DISCARD, "%s: Expected a finite result but was %g.", name, value);
}

int lw_check_results(const lw_instance *instance, const double *values, size_t count) {
    for (size_t k = 0; k < count; ++k)
        if (!isfinite(values[k])) return overflow(instance, "derivatives", values[k]);
    return LW_FMI_OK;
}

/* ---- Float64 ---- */

int lw_get_float64(lw_instance *instance, const uint32_t *references, size_t n, double *values,
                   size_t count) {
    unsigned groups = 0;
    int status = check(instance, references, n, values, count, LW_TYPE_FLOAT64, 0);
    if (status) return status;
    for (size_t i = 0; i < n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[references[i]];
        if (v->causality == LW_CALCULATED) groups |= lw_part_group(v->section);
    }
    if ((status = lw_update(instance, groups))) return status;
    for (size_t i = 0; i < n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[references[i]];
        const double *from = v->type == LW_TYPE_TIME ? &instance->time : instance->values + v->offset;
        for (uint32_t k = 0; k < v->size; ++k) {
            if (!isfinite(from[k])) return overflow(instance, v->name, from[k]);
            *values++ = from[k];
        }
    }
    return LW_FMI_OK;
}

static int check_finite(const lw_instance *instance, const uint32_t *references, const double *values,
                        size_t count) {
    const lw_fmu_variable *v = NULL;
    uint32_t left = 0;
    for (size_t k = 0; k < count; ++k, --left) {
        while (!left) v = &lw_fmu_variables[*references++], left = v->size;
        if (isfinite(values[k])) continue;
        return lw_report(instance, LW_FMI_ERROR, "%s: Expected a finite number but was %g.", v->name,
                         values[k]);
    }
    return LW_FMI_OK;
}

int lw_set_float64(lw_instance *instance, const uint32_t *references, size_t n, const double *values,
                   size_t count) {
    int status = check(instance, references, n, values, count, LW_TYPE_FLOAT64, 1);
    if (status || (status = check_finite(instance, references, values, count))) return status;
    for (size_t i = 0; i < n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[references[i]];
        for (uint32_t k = 0; k < v->size; ++k) instance->values[v->offset + k] = *values++;
        if (v->causality == LW_FIXED_PARAMETER || v->causality == LW_TUNABLE_PARAMETER)
            instance->unconfigured = 1;
    }
    if (n) instance->stale = LW_STALE_ALL;
    return LW_FMI_OK;
}

/* ---- Int32 ---- */

int lw_get_int32(lw_instance *instance, const uint32_t *references, size_t n, int32_t *values, size_t count) {
    int status = check(instance, references, n, values, count, LW_TYPE_INT32, 0);
    for (size_t i = 0; !status && i < n; ++i)
        values[i] = instance->integers[lw_fmu_variables[references[i]].offset];
    return status;
}

int lw_set_int32(lw_instance *instance, const uint32_t *references, size_t n, const int32_t *values,
                 size_t count) {
    int status = check(instance, references, n, values, count, LW_TYPE_INT32, 1);
    for (size_t i = 0; !status && i < n; ++i) {
        instance->integers[lw_fmu_variables[references[i]].offset] = values[i];
        instance->unconfigured = 1;
        instance->stale = LW_STALE_ALL;
    }
    return status;
}

/* ---- Boolean ---- */

int lw_check_booleans(const lw_instance *instance, const uint32_t *references, size_t n, const void *values,
                      size_t count, int writing) {
    return check(instance, references, n, values, count, LW_TYPE_BOOLEAN, writing);
}

int lw_get_boolean(const lw_instance *instance, uint32_t reference) {
    return instance->values[lw_fmu_variables[reference].offset] != 0.0;
}

/* Nothing is calculated from it. */
void lw_set_boolean(lw_instance *instance, uint32_t reference, int value) {
    instance->values[lw_fmu_variables[reference].offset] = value ? 1.0 : 0.0;
}

/* ---- continuous states ---- */

size_t lw_state_size(void) { return (size_t)lw_fmu_nq + (size_t)lw_fmu_nv; }

static int check_count(const lw_instance *instance, const double *values, size_t count) {
    if (count != lw_state_size())
        return lw_report(instance, LW_FMI_ERROR, "Expected %lu continuous states but was %lu.",
                         (unsigned long)lw_state_size(), (unsigned long)count);
    return count && !values ? lw_missing(instance, "continuousStates") : LW_FMI_OK;
}

int lw_get_states(lw_instance *instance, double *states, size_t count) {
    int status = check_count(instance, states, count);
    if (!status && count) memcpy(states, instance->values + lw_part_states(instance), count * sizeof(double));
    return status;
}

int lw_set_states(lw_instance *instance, const double *states, size_t count) {
    int status = check_count(instance, states, count);
    for (size_t k = 0; !status && k < count; ++k)
        if (!isfinite(states[k]))
            return lw_report(instance, LW_FMI_ERROR, "%s: Expected a finite number but was %g.",
                             lw_name_at(LW_TYPE_FLOAT64, lw_part_states(instance) + (uint32_t)k), states[k]);
    if (status || !count) return status;
    memcpy(instance->values + lw_part_states(instance), states, count * sizeof(double));
    instance->stale |= LW_STALE_ALL & ~LW_STALE_INPUTS;
    return LW_FMI_OK;
}

int lw_get_state_derivatives(lw_instance *instance, double *derivatives, size_t count) {
    int status = check_count(instance, derivatives, count);
    if (status || !count) return status;
    unsigned groups;
    uint32_t first = lw_part_derivatives(instance, &groups);
    if ((status = lw_update(instance, groups))) return status;
    memcpy(derivatives, instance->values + first, count * sizeof(double));
    return lw_check_results(instance, derivatives, count);
}

/* Metres, radians and quaternions of moderate machines are all of order one. */
int lw_get_nominals(lw_instance *instance, double *nominals, size_t count) {
    int status = check_count(instance, nominals, count);
    for (size_t k = 0; !status && k < count; ++k) nominals[k] = 1.0;
    return status;
}

size_t lw_indicator_count(const lw_instance *instance) {
    uint32_t first;
    unsigned group;
    return lw_part_indicators(instance, &first, &group);
}

int lw_get_indicators(lw_instance *instance, double *indicators, size_t count) {
    uint32_t first;
    unsigned group;
    size_t expected = lw_part_indicators(instance, &first, &group);
    if (count != expected)
        return lw_report(instance, LW_FMI_ERROR, "Expected %lu event indicators but was %lu.",
                         (unsigned long)expected, (unsigned long)count);
    if (!count) return LW_FMI_OK;
    if (!indicators) return lw_missing(instance, "eventIndicators");
    int status = lw_update(instance, group);
    if (status) return status;
    memcpy(indicators, instance->values + first, count * sizeof(double));
    return lw_check_results(instance, indicators, count);
}
