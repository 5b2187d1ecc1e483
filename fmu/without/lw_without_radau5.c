/* In the place of lw_radau5.c and lw_linear.c in an FMU of a scenario with another integrator. */
#include "lw_integrate.h"

size_t lw_radau5_size(int32_t nq, int32_t nv) {
    (void)nq, (void)nv;
    return 0;
}

int lw_radau5(lw_run *run, double s, double time, double width, double h) {
    (void)run, (void)s, (void)time, (void)width, (void)h;
    return LW_BAD_INTEGRATOR;
}
