/* One instance of the FMU, as the layers of FMI 2 and FMI 3 use it: all of its life except its physics,
 * which is the part's (lw_part.h).
 *
 * Statuses are ints with the numbers of fmi2Status and fmi3Status. A call that returns more than a warning
 * has changed nothing: with corrected arguments the simulation may go on, though the standard does not ask
 * for it. No memory is allocated after the creation but for states that the environment asks for.
 */
#ifndef LW_INSTANCE_H
#define LW_INSTANCE_H

#include <stddef.h>
#include <stdint.h>

#include "lw_fmu.h"
#include "lw_modes.h"

enum { LW_FMI_OK, LW_FMI_WARNING, LW_FMI_DISCARD, LW_FMI_ERROR };
enum { LW_MODEL_EXCHANGE, LW_CO_SIMULATION };

/* In `stale`: groups of calculated values are the part's, this bit says that inputs were set. */
#define LW_STALE_INPUTS 0x80000000u
#define LW_STALE_ALL 0xffffffffu

typedef struct lw_instance lw_instance;
typedef struct lw_part lw_part;
typedef struct lw_snapshot lw_snapshot;
typedef void (*lw_callback)(void); /* a function of the environment, cast back where it is called */

struct lw_instance {
    /* to the environment */
    const char *name, *function; /* the instance's; the call in progress, for messages */
    void (*deliver)(const lw_instance *, int status, const char *category, const char *text);
    lw_callback logger, update;
    void *environment;
    unsigned logged;          /* bit per status */
    int early_return_allowed; /* FMI 3 */
    /* Between substeps; returns not 0 for a wish to return early, at the earliest at `until` [s]. */
    int (*intermediate)(lw_instance *, int last, double *until);
    /* life */
    int kind;
    unsigned mode;
    double time, stop; /* [s]; stop is infinite where none is defined */
    int step_status;   /* of the last step */
    /* values: memory of the part, known values, calculated values, in one array */
    double *store, *values; /* its start; the first known value */
    size_t state_count;     /* memory and known values: what a state consists of */
    double *undo, *saved;   /* (state_count) of a step, of differences */
    double *direction;      /* (known) of differences */
    int32_t integers[LW_INTEGERS];
    unsigned stale;
    int unconfigured; /* parameters were set */
    lw_part *part;
    lw_snapshot *snapshots;
};

/* ---- lw_instance.c ---- */
/* Returns NULL for an empty name, another token, or no memory; the reason goes to the logger of `with`, of
 * which the members of the environment and the kind are taken. */
lw_instance *lw_create(const lw_instance *with, const char *name, const char *token);
void lw_free(void *instance, const char *function);
void lw_reset(lw_instance *);
/* The instance, if the call is allowed in its mode (a mask of lw_modes.h); else NULL. */
lw_instance *lw_enter(void *instance, const char *function, unsigned allowed);
/* Log and return `status`. */
#if defined(__GNUC__)
__attribute__((format(printf, 3, 4)))
#endif
int lw_report(const lw_instance *, int status, const char *format, ...);
int lw_missing(const lw_instance *, const char *argument); /* a NULL pointer where there must be none */
int lw_set_categories(lw_instance *, int on, size_t count, const char *const categories[]);
/* Start and stop of the experiment [s]. */
int lw_set_experiment(lw_instance *, double start, int stop_defined, double stop);
int lw_exit_initialization(lw_instance *);
int lw_set_time(lw_instance *, double time);

/* ---- lw_values.c: `values` has `count` numbers in all ---- */
const lw_fmu_variable *lw_variable(const lw_instance *, uint32_t reference);
const char *lw_name_at(int type, uint32_t index); /* the variable that holds a value */
int lw_get_float64(lw_instance *, const uint32_t *references, size_t n, double *values, size_t count);
int lw_set_float64(lw_instance *, const uint32_t *references, size_t n, const double *values, size_t count);
int lw_get_int32(lw_instance *, const uint32_t *references, size_t n, int32_t *values, size_t count);
int lw_set_int32(lw_instance *, const uint32_t *references, size_t n, const int32_t *values, size_t count);
/* May n Booleans be read, or written? The environment's arrays differ: one value by one. */
int lw_check_booleans(const lw_instance *, const uint32_t *references, size_t n, const void *values, size_t count,
                      int writing);
int lw_get_boolean(const lw_instance *, uint32_t reference);
void lw_set_boolean(lw_instance *, uint32_t reference, int value);
int lw_check_results(const lw_instance *, const double *derivatives, size_t count); /* finite? */
/* Bring groups of calculated values up to date. */
int lw_update(lw_instance *, unsigned groups);
size_t lw_state_size(void); /* continuous states */
int lw_get_states(lw_instance *, double *states, size_t count);
int lw_set_states(lw_instance *, const double *states, size_t count);
int lw_get_state_derivatives(lw_instance *, double *derivatives, size_t count);
int lw_get_nominals(lw_instance *, double *nominals, size_t count);
size_t lw_indicator_count(const lw_instance *);
int lw_get_indicators(lw_instance *, double *indicators, size_t count);

/* ---- lw_cosimulation.c ---- */
/* One communication step; *early is set if it ended before its end. */
int lw_do_step(lw_instance *, double point, double size, int *early);
int lw_set_input_derivatives(lw_instance *, const uint32_t *references, size_t n, const int32_t *orders,
                             const double *values);
int lw_get_output_derivatives(lw_instance *, const uint32_t *references, size_t n, const int32_t *orders,
                              double *values, size_t count);

/* ---- lw_derivatives.c ---- */
typedef struct {
    const uint32_t *references;
    size_t n, count; /* variables, numbers in all */
} lw_variables;
int lw_directional_derivative(lw_instance *, lw_variables unknowns, lw_variables knowns, const double *seed,
                              double *sensitivity);
int lw_adjoint_derivative(lw_instance *, lw_variables unknowns, lw_variables knowns, const double *seed,
                          double *sensitivity);
/* Change of the unknowns along `direction`, a change of the known values. */
int lw_differentiate(lw_instance *, lw_variables unknowns, double *sensitivity);

/* ---- lw_snapshot.c ---- */
int lw_get_snapshot(lw_instance *, void **handle);
int lw_set_snapshot(lw_instance *, void *handle);
int lw_free_snapshot(lw_instance *, void **handle);
void lw_free_snapshots(lw_instance *);
int lw_serialized_size(lw_instance *, void *handle, size_t *size);
int lw_serialize(lw_instance *, void *handle, unsigned char *bytes, size_t size);
int lw_deserialize(lw_instance *, const unsigned char *bytes, size_t size, void **handle);

#endif
