/* Force fields given as expressions, compiled to the programs of lw_expression.h, whose results
 * are fx, fy, fz, tx, ty, tz.
 *
 * An expression may use the variables below (world coordinates, SI units); theta is the heading of the
 * body's x axis about world z, unwrapped in time against the last committed value. */
#ifndef LW_FIELD_H
#define LW_FIELD_H

#include <stdint.h>

#include "lw_forces.h"
#include "lw_math.h"

enum { /* variables, by operand of LW_VARIABLE */
    LW_VAR_T, LW_VAR_X, LW_VAR_Y, LW_VAR_Z, LW_VAR_VX, LW_VAR_VY, LW_VAR_VZ,
    LW_VAR_WX, LW_VAR_WY, LW_VAR_WZ, LW_VAR_THETA, LW_VARIABLES
};

typedef struct {
    int n;                   /* programs, one a body */
    const int32_t *body;     /* (n) the body's index among all bodies */
    const int32_t *start;    /* (n + 1) first instruction of each program */
    const int32_t *code;     /* (instructions, 2) operation, operand */
    const double *constants;
} lw_field;

/* Take the heading of every body at an accepted state as the one to unwrap against: theta (n) [rad]. */
LW_API void lw_field_commit(const lw_field *field, const lw_motion *motion, double *theta);

/* The values of all variables for body i of the field. */
LW_API void lw_field_variables(const lw_field *field, int i, double t, const lw_motion *motion,
                        const double *theta, double variables[LW_VARIABLES]);

/* Write the wrench on every body; added inertia is left alone. Returns 0, or 1 + 6 i + c where c is the
 * first component of body i that is not finite. */
LW_API int lw_field_evaluate(const lw_field *field, double t, const lw_motion *motion, const double *theta,
                      const lw_wrench *wrench);

#endif
