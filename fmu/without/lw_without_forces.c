/* In place of lw_elements.c and lw_expression.c in an FMU without force elements. */
#include "lw_model.h"

void lw_elements_build(lw_multibody *mb, const lw_tables *t) { (void)mb, (void)t; }

void lw_multibody_set_inputs(lw_multibody *mb, const double *values) { (void)mb, (void)values; }

int lw_take_time(lw_multibody *mb, double time, lw_fault *fault) {
    (void)fault;
    mb->time = time;
    return LW_OK;
}

void lw_prescribe(const lw_multibody *mb, double *q, double *v) { (void)mb, (void)q, (void)v; }

void lw_prescribe_accelerations(lw_multibody *mb, int at_rest) { (void)mb, (void)at_rest; }

int lw_multibody_prescribe(lw_multibody *mb, double *state, double time, lw_fault *fault) {
    (void)mb, (void)state, (void)time, (void)fault;
    return LW_OK;
}

int lw_elements_load(lw_multibody *mb, const lw_multibody *tree, const double *q, lw_fault *fault) {
    (void)mb, (void)tree, (void)q, (void)fault;
    return LW_OK;
}

void lw_elements_drive(const lw_multibody *mb, const lw_link *l, const double *q, const double *v, double *force) {
    (void)mb, (void)l, (void)q, (void)v, (void)force;
}

int lw_elements_check(const lw_multibody *mb, lw_fault *fault) {
    (void)mb, (void)fault;
    return LW_OK;
}

void lw_elements_power(lw_multibody *mb, double *supplied, double *dissipated) {
    (void)mb, (void)supplied, (void)dissipated;
}

double lw_elements_energy(const lw_multibody *mb) {
    (void)mb;
    return 0.0;
}
