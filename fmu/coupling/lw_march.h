/* Regular steps of the scheme `pec`, many in one call, held against the record of a run.
 *
 * It does what linkwind.coupling.pec, the dynamics service and its providers do between two steps, in the
 * same order of operations: predict, ask the force models, correct, choose the next degree, and write the
 * four messages of each step. It stops before the first step of which a message differs from the record, or
 * with which anything is wrong, and leaves everything as it was there: whoever goes on from there finds out
 * what it is. So it can never take for the same what is not. */
#ifndef LW_MARCH_H
#define LW_MARCH_H

#include <stddef.h>
#include <stdint.h>

#include "lw_forces.h"
#include "lw_multibody.h"

typedef uint64_t lw_unaligned_count __attribute__((aligned(1)));
typedef uint32_t lw_unaligned_number __attribute__((aligned(1)));

/* A message of fixed layout, and the bytes that it is to have step by step. */
typedef struct {
    const uint8_t *bytes;            /* (size) with everything in it that does not change */
    size_t size;
    lw_unaligned_count *step, *time; /* where they lie in it; time in [ns] */
    const uint8_t *const *recorded;  /* (count) each of `size` bytes */
} lw_message;

typedef enum { LW_NO_FORCE, LW_PLATES, LW_FIELD } lw_force_model;

/* A provider: a force model with its message. */
typedef struct {
    int32_t model;         /* lw_force_model */
    const void *constants; /* lw_plates or lw_field */
    double *theta;         /* the memory of a field: (n) headings, committed */
    int32_t n;
    const int32_t *body;   /* (n) of each row of the wrench, among all bodies */
    lw_wrench wrench;      /* in the message */
    lw_message message;
} lw_provider;

typedef struct {
    lw_multibody *multibody;
    int32_t n, state_size;
    const lw_macro_step *how;     /* integrator, substeps, tolerances, memory, fault; the rest is not read */
    const lw_point *point;        /* where State's numbers go; state, trial, wrench, time are not read */
    int32_t providers, alone;     /* alone: the one provider has all bodies, in their order */
    const lw_provider *provider;  /* (providers) */
    lw_message motion, end, step; /* MotionStep, State, Step */
    lw_motion accepted, trial;    /* in MotionStep */
    lw_unaligned *kinetic, *potential, *external, *dissipated, *gap; /* in State [J, m] */
    lw_unaligned_number *extrapolated; /* in Step: degree of the prediction */
    lw_unaligned *extrapolation_error; /* (order + 1) */
    lw_unaligned *residual, *interface_energy;
    double *room;                 /* lw_march_room(march) doubles, for the time of the call */
    int64_t step_ns;

    /* where the run is, brought up to date */
    int64_t first;                /* the next step */
    double *state;                /* (state_size) accepted before it */
    double work[2];               /* external, dissipated, since t_0 [J] */
    int32_t order, adaptive, degree, depth; /* degree: of the next prediction */
    double *wrenches;             /* (depth,n,6) newest first */
    const double *added_inertia;  /* (n,6,6) which every answer is to have; NULL for none */
    const double *weight;         /* (n,6) */
    double *differences;          /* (order + 2,n,6) backward differences of the weighted wrenches */
    double *errors;               /* (order + 1) by degree */
    double largest_gap, largest_force; /* so far, as lw_measures */
} lw_march;

/* Needs n, state_size, order and depth. */
LW_API size_t lw_march_room(const lw_march *march);

/* Take up to `count` steps; return how many. `first` stays. */
LW_API int32_t lw_march_go(lw_march *march, int32_t count);

#endif
