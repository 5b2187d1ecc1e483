/* What an FMU computes: either lw_part_dynamics.c or lw_part_aero.c is compiled. */
#ifndef LW_PART_H
#define LW_PART_H

#include "lw_instance.h"

/* Doubles that a part keeps from step to step besides known values; they belong to the state. */
size_t lw_part_memory(void);
/* Known values: parameters, inputs, states. Calculated ones follow. */
size_t lw_part_known(void);
/* All Float64 values; equals lw_fmu_value_count. */
size_t lw_part_values(void);
/* Index of the first value of a section. */
uint32_t lw_part_first(const lw_instance *, unsigned section);
/* Index of the first input: parameters lie before it. */
uint32_t lw_part_inputs(const lw_instance *);
/* The continuous states, and their derivatives in the same order: first value, and their groups. */
uint32_t lw_part_states(const lw_instance *);
uint32_t lw_part_derivatives(const lw_instance *, unsigned *groups);

/* Bytes of private memory, a multiple of 8; its layout. */
size_t lw_part_size(void);
void lw_part_create(lw_instance *);
/* Set the memory to its start. */
void lw_part_restart(lw_instance *);

/* Take the parameters; an error names the variable that makes no sense. */
int lw_part_configure(lw_instance *);
/* Group (one bit) that a calculated variable is computed with; compute groups. */
unsigned lw_part_group(unsigned section);
int lw_part_update(lw_instance *, unsigned groups);

/* How many pieces a communication step may be cut into without a change of its result. */
int32_t lw_part_pieces(const lw_instance *);
/* Take one of them, h [s] long. */
int lw_part_advance(lw_instance *, double h, int32_t pieces);
/* The present values are those of an accepted point of time; whether something has to be done about them. */
void lw_part_accept(lw_instance *, int *event);

/* Model Exchange: number of event indicators, their first value, their group. Do what is due; `changed`: the
 * states did; `next` is when something happens at a known time [s], infinite for never. */
size_t lw_part_indicators(const lw_instance *, uint32_t *first, unsigned *group);
int lw_part_event(lw_instance *, int *changed, double *next);

/* A derivative of an input with respect to time, for the coming step; returns 0 where it is of no use. */
int lw_part_set_input_derivative(lw_instance *, uint32_t index, int32_t order, double value);
/* Greatest order of an output derivative; the section that is the time derivative of another, or -1. */
int32_t lw_part_output_order(void);
int lw_part_rate(unsigned section);

/* By how much a known value typically varies, to choose steps of differences. */
double lw_part_scale(const lw_instance *, const lw_fmu_variable *variable, uint32_t index);

#endif
