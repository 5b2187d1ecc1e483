/* What comes in with every call must be numbers. */
#include "lw_model.h"

int lw_first_not_finite(const double *values, int count) {
    for (int i = 0; i < count; ++i)
        if (!isfinite(values[i])) return i;
    return -1;
}

int lw_inputs_check(const lw_multibody *mb, const double *state, int32_t count, const double *wrenches,
                    const double *added_inertia, lw_fault *fault) {
    int row;
    fault->time = 0.0;
    if ((row = lw_first_not_finite(state, mb->nq + mb->nv + 1 + mb->events)) >= 0) {
        fault->item = row;
        return LW_STATE_NOT_FINITE;
    }
    if ((row = lw_first_not_finite(wrenches, 6 * mb->n * count)) >= 0) {
        fault->item = row / 6 % mb->n;
        return LW_WRENCH_NOT_FINITE;
    }
    if (added_inertia && (row = lw_first_not_finite(added_inertia, 36 * mb->n)) >= 0) {
        fault->item = row / 36;
        return LW_ADDED_NOT_FINITE;
    }
    return LW_OK;
}
