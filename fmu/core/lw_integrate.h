/* What the integrators share. The vector y is (q, v, work, dissipated). */
#ifndef LW_INTEGRATE_H
#define LW_INTEGRATE_H

#include "lw_model.h"
#include "lw_polynomial.h"

/* One macro step in progress. */
typedef struct {
    lw_multibody *mb;
    const lw_macro_step *step;
    lw_polynomial wrench;
    double proposed; /* substep [s] that dopri5 would take next */
    int interrupted; /* by an event */
} lw_run;

/* lw_integrate.c: dy/dt at `s`, in units of the macro step, and `time` [s]; what is prescribed goes into y. */
int lw_derive(lw_run *run, double s, double time, double *y, double *rate);
/* lw_radau5.c: one step of `h` [s] from s and `time`; `width` is h in macro steps. The result is not on the
 * closures yet. */
int lw_radau5(lw_run *run, double s, double time, double width, double h);

#endif
