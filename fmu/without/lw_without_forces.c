/* In the place of lw_elements.c and lw_expression.c in an FMU of a mechanism without force elements. */
#include "lw_model.h"

void lw_elements_build(lw_multibody *mb, const lw_tables *t) { (void)mb, (void)t; }

int lw_elements_load(lw_multibody *mb, lw_fault *fault) {
    (void)mb, (void)fault;
    return LW_OK;
}

double lw_elements_dissipated(const lw_multibody *mb) {
    (void)mb;
    return 0.0;
}

double lw_elements_energy(const lw_multibody *mb) {
    (void)mb;
    return 0.0;
}
