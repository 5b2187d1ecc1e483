/* Communication steps, and derivatives with respect to time at their ends. */
#include <math.h>
#include <string.h>

#include "lw_part.h"

static int check_step(const lw_instance *instance, double point, double size) {
    /* The environment's clock may sum up its steps: round-off is no error, the wrong step is. */
    double slack = 1e-6 * size + 1e-12 * fmax(fabs(point), fabs(instance->time));
    if (!(size > 0.0) || !isfinite(size))
        return lw_report(instance, LW_FMI_ERROR, "Expected communicationStepSize > 0 but was %.17g.", size);
    if (!(fabs(point - instance->time) <= slack))
        return lw_report(instance, LW_FMI_ERROR, "Expected currentCommunicationPoint = %.17g but was %.17g.",
                         instance->time, point);
    if (!(point + size > point))
        return lw_report(instance, LW_FMI_ERROR,
                         "Expected communicationStepSize to advance the time %.17g but was %.17g.", point, size);
    if (point + size > instance->stop + slack)
        return lw_report(instance, LW_FMI_ERROR,
                         "Expected a step that ends by stopTime = %.17g but was %.17g.", instance->stop,
                         point + size);
    return LW_FMI_OK;
}

/* The callback between pieces; not 0 if the step ends here. */
static int interrupted(lw_instance *instance, int last) {
    const char *function = instance->function;
    double until = instance->time;
    instance->mode = last ? LW_INTERMEDIATE_END : LW_INTERMEDIATE;
    int wish = instance->intermediate(instance, last, &until);
    instance->mode = LW_STEP;
    instance->function = function;
    return wish && !last && !(until > instance->time);
}

static int advance(lw_instance *instance, double point, double size, int *early) {
    int32_t pieces = instance->intermediate ? lw_part_pieces(instance) : 1;
    double h = size / pieces;
    for (int32_t k = 1; k <= pieces; ++k) {
        int last = k == pieces, status = lw_part_advance(instance, h, pieces);
        if (status) return status;
        instance->time = last ? point + size : point + size * k / pieces;
        instance->stale |= LW_STALE_ALL & ~LW_STALE_INPUTS;
        if (instance->intermediate && interrupted(instance, last)) {
            *early = 1;
            return LW_FMI_OK;
        }
    }
    return LW_FMI_OK;
}

int lw_do_step(lw_instance *instance, double point, double size, int *early) {
    double start = instance->time;
    *early = 0;
    int status = check_step(instance, point, size);
    if (!status && instance->unconfigured) {
        status = lw_part_configure(instance);
        if (!status) instance->unconfigured = 0;
    }
    if (!status) {
        size_t bytes = instance->intermediate ? instance->state_count * sizeof(double) : 0;
        memcpy(instance->undo, instance->store, bytes);
        status = advance(instance, point, size, early);
        if (status) {
            memcpy(instance->store, instance->undo, bytes);
            instance->time = start;
            instance->stale = LW_STALE_ALL;
        }
    }
    instance->step_status = status;
    return status;
}

/* ---- derivatives with respect to time ---- */

static int check_input(const lw_instance *instance, uint32_t reference, int32_t order, double value) {
    const lw_fmu_variable *v = lw_variable(instance, reference);
    if (!v) return LW_FMI_ERROR;
    if (v->causality != LW_INPUT)
        return lw_report(instance, LW_FMI_ERROR, "%s: Expected an input but was another variable.", v->name);
    if (order < 1 || order > 3)
        return lw_report(instance, LW_FMI_ERROR, "%s: Expected an order of 1 to 3 but was %d.", v->name,
                         order);
    if (!isfinite(value))
        return lw_report(instance, LW_FMI_ERROR, "%s: Expected a finite number but was %g.", v->name, value);
    return LW_FMI_OK;
}

int lw_set_input_derivatives(lw_instance *instance, const uint32_t *references, size_t n,
                             const int32_t *orders, const double *values) {
    int status = LW_FMI_OK;
    if (n && !(references && orders && values)) return lw_missing(instance, "vr, order or value");
    for (size_t i = 0; i < n; ++i)
        if (check_input(instance, references[i], orders[i], values[i])) return LW_FMI_ERROR;
    for (size_t i = 0; i < n; ++i) {
        const lw_fmu_variable *v = &lw_fmu_variables[references[i]];
        if (!lw_part_set_input_derivative(instance, v->offset, orders[i], values[i]))
            status = lw_report(instance, LW_FMI_WARNING,
                               "%s: Expected an input that varies within a step but was one that is held.",
                               v->name);
    }
    return status;
}

/* Along the motion with inputs held: the variable that is the derivative, or else differences. */
static int output_derivative(lw_instance *instance, uint32_t reference, double *values) {
    const lw_fmu_variable *v = &lw_fmu_variables[reference];
    int section = v->type == LW_TYPE_TIME ? -1 : lw_part_rate(v->section);
    if (section >= 0) {
        int status = lw_update(instance, lw_part_group((unsigned)section));
        uint32_t rate = v->offset - lw_part_first(instance, v->section) +
                        lw_part_first(instance, (unsigned)section);
        memcpy(values, instance->values + rate, v->size * sizeof(double));
        return status;
    }
    if (v->causality != LW_CALCULATED) {
        for (uint32_t k = 0; k < v->size; ++k) values[k] = v->type == LW_TYPE_TIME ? 1.0 : 0.0;
        return LW_FMI_OK;
    }
    memset(instance->direction, 0, lw_part_known() * sizeof(double));
    double *flow = instance->direction + lw_part_states(instance);
    int status = lw_get_state_derivatives(instance, flow, lw_state_size());
    lw_variables unknown = {&reference, 1, v->size};
    return status ? status : lw_differentiate(instance, unknown, values);
}

int lw_get_output_derivatives(lw_instance *instance, const uint32_t *references, size_t n,
                              const int32_t *orders, double *values, size_t count) {
    size_t found = 0;
    if (n && !(references && orders && values))
        return lw_missing(instance, "valueReferences, orders or values");
    for (size_t i = 0; i < n; ++i) {
        const lw_fmu_variable *v = lw_variable(instance, references[i]);
        if (!v) return LW_FMI_ERROR;
        if (v->type > LW_TYPE_FLOAT64 || orders[i] < 1 || orders[i] > lw_part_output_order())
            return lw_report(instance, LW_FMI_ERROR,
                             "%s: Expected a Float64 and an order of 1, at most %d, but was %d.", v->name,
                             lw_part_output_order(), orders[i]);
        found += v->size;
    }
    if (found != count)
        return lw_report(instance, LW_FMI_ERROR, "Expected nValues = %lu but was %lu.", (unsigned long)found,
                         (unsigned long)count);
    double *next = values;
    for (size_t i = 0; i < n; ++i) {
        int status = output_derivative(instance, references[i], next);
        if (status) return status;
        next += lw_fmu_variables[references[i]].size;
    }
    return lw_check_results(instance, values, count);
}
