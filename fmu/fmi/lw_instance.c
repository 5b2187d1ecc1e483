/* Birth, life and messages of an instance. */
#include "lw_instance.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lw_part.h"

/* ---- messages ---- */

static const char *const categories[] = {NULL, "logStatusWarning", "logStatusDiscard", "logStatusError"};
static const unsigned all_categories = 1u << LW_FMI_WARNING | 1u << LW_FMI_DISCARD | 1u << LW_FMI_ERROR;

int lw_report(const lw_instance *instance, int status, const char *format, ...) {
    if (!instance->logger || !(instance->logged >> status & 1u)) return status;
    char text[512];
    int used = snprintf(text, sizeof text, "%s: ", instance->function);
    if (used < 0 || (size_t)used >= sizeof text) used = 0;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text + used, sizeof text - (size_t)used, format, arguments);
    va_end(arguments);
    instance->deliver(instance, status, categories[status], text);
    return status;
}

int lw_missing(const lw_instance *instance, const char *argument) {
    return lw_report(instance, LW_FMI_ERROR, "Expected a pointer in %s but was NULL.", argument);
}

static unsigned category_bit(const char *name) {
    for (unsigned status = LW_FMI_WARNING; name && status <= LW_FMI_ERROR; ++status)
        if (!strcmp(name, categories[status])) return 1u << status;
    return 0;
}

int lw_set_categories(lw_instance *instance, int on, size_t count, const char *const names[]) {
    unsigned bits = count ? 0 : all_categories;
    if (count && !names) return lw_missing(instance, "categories");
    for (size_t i = 0; i < count; ++i) {
        unsigned bit = category_bit(names[i]);
        if (!bit)
            return lw_report(instance, LW_FMI_ERROR,
                             "Expected categories logStatusWarning, logStatusDiscard or logStatusError but "
                             "was %.80s.", names[i] ? names[i] : "NULL");
        bits |= bit;
    }
    instance->logged = on ? instance->logged | bits : instance->logged & ~bits;
    return LW_FMI_OK;
}

/* ---- birth and death ---- */

static int check_birth(const lw_instance *with, const char *name, const char *token) {
    lw_instance reporter = *with;
    reporter.name = name ? name : "";
    reporter.logged = all_categories; /* a creation that fails tells why in any case */
    if (!name || !name[strspn(name, " \t\r\n")])
        return lw_report(&reporter, LW_FMI_ERROR, "Expected a name for the instance but was %s.",
                         name ? "blank" : "NULL");
    if (!token || strcmp(token, lw_fmu_token))
        return lw_report(&reporter, LW_FMI_ERROR, "Expected the token %s but was %.80s. Do the model "
                         "description and the binary belong together?", lw_fmu_token, token ? token : "NULL");
    if (lw_part_values() != lw_fmu_value_count)
        return lw_report(&reporter, LW_FMI_ERROR, "Expected %lu values in lw_fmu_data.c but was %lu.",
                         (unsigned long)lw_part_values(), (unsigned long)lw_fmu_value_count);
    return LW_FMI_OK;
}

lw_instance *lw_create(const lw_instance *with, const char *name, const char *token) {
    if (check_birth(with, name, token)) return NULL;
    size_t state_count = lw_part_memory() + lw_part_known();
    size_t stored = lw_part_memory() + lw_part_values();
    size_t doubles = stored + 2 * state_count + lw_part_known();
    size_t length = strlen(name) + 1, own = (sizeof(lw_instance) + 7) / 8 * 8;
    char *block = calloc(1, own + doubles * sizeof(double) + lw_part_size() + length);
    if (!block) return NULL;
    lw_instance *instance = (lw_instance *)(void *)block;
    *instance = *with;
    instance->store = (double *)(void *)(block + own);
    instance->values = instance->store + lw_part_memory();
    instance->state_count = state_count;
    instance->undo = instance->store + stored;
    instance->saved = instance->undo + state_count;
    instance->direction = instance->saved + state_count;
    instance->part = (lw_part *)(void *)(instance->store + doubles);
    instance->name = memcpy((char *)instance->part + lw_part_size(), name, length);
    lw_part_create(instance);
    lw_reset(instance);
    return instance;
}

void lw_free(void *pointer, const char *function) {
    lw_instance *instance = lw_enter(pointer, function, LW_RESTING); /* not while it takes a step */
    if (!instance) return;
    lw_free_snapshots(instance);
    free(instance);
}

void lw_reset(lw_instance *instance) {
    memcpy(instance->values, lw_fmu_start, lw_part_values() * sizeof(double));
    memcpy(instance->integers, lw_fmu_integers, sizeof instance->integers);
    lw_part_restart(instance);
    instance->mode = LW_INSTANTIATED;
    instance->time = 0.0;
    instance->stop = HUGE_VAL;
    instance->step_status = LW_FMI_OK;
    instance->unconfigured = 1;
    instance->stale = LW_STALE_ALL;
}

/* ---- life ---- */

static const char *mode_name(unsigned mode) {
    switch (mode) {
    case LW_INSTANTIATED: return "Instantiated";
    case LW_INITIALIZATION: return "Initialization Mode";
    case LW_EVENT: return "Event Mode";
    case LW_CONTINUOUS: return "Continuous-Time Mode";
    case LW_STEP: return "Step Mode";
    case LW_TERMINATED: return "Terminated";
    default: return "Intermediate Update Mode";
    }
}

lw_instance *lw_enter(void *pointer, const char *function, unsigned allowed) {
    lw_instance *instance = pointer;
    if (!instance) return NULL;
    instance->function = function;
    unsigned other_kind = instance->kind == LW_MODEL_EXCHANGE ? LW_ONLY_CS : LW_ONLY_ME;
    if (allowed & instance->mode && !(allowed & other_kind)) return instance;
    lw_report(instance, LW_FMI_ERROR, "Expected a state in which this call is allowed but was %s of %s.",
              mode_name(instance->mode),
              instance->kind == LW_MODEL_EXCHANGE ? "Model Exchange" : "Co-Simulation");
    return NULL;
}

int lw_set_experiment(lw_instance *instance, double start, int stop_defined, double stop) {
    if (!isfinite(start))
        return lw_report(instance, LW_FMI_ERROR, "Expected a finite startTime but was %.17g.", start);
    if (stop_defined && !(stop >= start))
        return lw_report(instance, LW_FMI_ERROR, "Expected stopTime >= startTime = %.17g but was %.17g.",
                         start, stop);
    instance->time = start;
    instance->stop = stop_defined ? stop : HUGE_VAL;
    instance->stale = LW_STALE_ALL;
    return LW_FMI_OK;
}

/* All outputs are computed once, so that values that make no sense together are found here. */
int lw_exit_initialization(lw_instance *instance) {
    int status = lw_update(instance, LW_STALE_ALL & ~LW_STALE_INPUTS);
    if (status) return status;
    instance->mode = instance->kind == LW_MODEL_EXCHANGE ? LW_EVENT : LW_STEP;
    return LW_FMI_OK;
}

int lw_set_time(lw_instance *instance, double time) {
    if (!isfinite(time))
        return lw_report(instance, LW_FMI_ERROR, "Expected a finite time but was %.17g.", time);
    instance->time = time;
    instance->stale |= LW_STALE_ALL & ~LW_STALE_INPUTS;
    return LW_FMI_OK;
}
