/* In the place of lw_events.c and lw_impulse.c in an FMU of a mechanism to which nothing may happen. */
#include "lw_model.h"

void lw_events_build(lw_multibody *mb, const lw_tables *t) { (void)mb, (void)t; }

void lw_modes(lw_multibody *mb, const double *happened) { (void)mb, (void)happened; }

int lw_events_due(lw_multibody *mb, const double *y, double time, const double *wrench, int *due,
                  lw_fault *fault) {
    (void)mb, (void)y, (void)time, (void)wrench, (void)fault;
    *due = 0;
    return LW_OK;
}

int lw_events_happen(lw_multibody *mb, double *y, double time, double h, double slack, const double *wrench,
                     lw_fault *fault) {
    (void)mb, (void)y, (void)time, (void)h, (void)slack, (void)wrench, (void)fault;
    return LW_OK;
}

int lw_multibody_happen(lw_multibody *mb, double *state, double time, double slack, const double *wrench,
                        const double *added_inertia, lw_fault *fault) {
    (void)mb, (void)state, (void)time, (void)slack, (void)wrench, (void)added_inertia, (void)fault;
    return LW_OK;
}

int lw_multibody_indicators(lw_multibody *mb, const double *state, double time, const double *wrench,
                            const double *added_inertia, double *values, lw_fault *fault) {
    (void)mb, (void)state, (void)time, (void)wrench, (void)added_inertia, (void)values, (void)fault;
    return LW_OK;
}
