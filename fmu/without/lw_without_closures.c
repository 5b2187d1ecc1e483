/* In the place of lw_closures.c, lw_delassus.c and lw_projection.c in an FMU of a mechanism without loops. */
#include "lw_model.h"

void lw_closures_build(lw_multibody *mb, const lw_tables *t) { (void)mb, (void)t; }

void lw_closure_forces(const lw_multibody *mb, double *wrench, double *reaction) {
    (void)mb, (void)wrench, (void)reaction;
}

double lw_closure_gap(const lw_multibody *mb, const lw_closure *c, const lw_unaligned *position,
                      const lw_unaligned *orientation) {
    (void)mb, (void)c, (void)position, (void)orientation;
    return 0.0;
}

void lw_multibody_closure_values(lw_multibody *mb, const double *state) { (void)mb, (void)state; }

void lw_delassus_close(lw_multibody *mb, double *joint_acceleration) { (void)mb, (void)joint_acceleration; }

int lw_project(lw_multibody *mb, double *q, double *v, lw_fault *fault) {
    (void)mb, (void)q, (void)v, (void)fault;
    return LW_OK;
}

int lw_allow(lw_multibody *mb, const double *q, double *v, lw_fault *fault) {
    (void)mb, (void)q, (void)v, (void)fault;
    return LW_OK;
}

int lw_multibody_close(lw_multibody *mb, double *state, lw_fault *fault) {
    (void)mb, (void)state, (void)fault;
    return LW_OK;
}
