/* Wind: a uniform stream, functions of time and place, and travelling gusts.
 *
 *   U(t, r) = U0 + u(t, r) + sum_i a_i s_i(2 pi (f_i t + k_i . r) + phi_i)
 *
 * u is a program of lw_expression.h. s is a sine, or (1 - cos)/2 between 0 and 2 pi and 0 outside: a single gust,
 * continuous with its slope.
 *
 * The total derivative at a point that moves with velocity v, dU/dt = @U/@t + (v . grad) U, is what an
 * added mass feels of an unsteady wind. That of u comes with its value: the program runs on t and r as jets
 * whose rates are 1 and v.
 */
#ifndef LW_WIND_H
#define LW_WIND_H

#include <stdint.h>

#include "lw_math.h"

enum { LW_GUST_SIZE = 9 };
enum { LW_SINE, LW_ONE_MINUS_COSINE }; /* shapes of gusts */
enum { LW_WIND_T, LW_WIND_X, LW_WIND_Y, LW_WIND_Z, LW_WIND_VARIABLES }; /* variables of the program */

typedef struct {
    double uniform[3];       /* U0 [m/s] in W */
    int n_gusts;
    const double *gusts;     /* (n_gusts, 9): amplitude a [m/s] (3), frequency f [Hz], wavenumber k [1/m] (3),
                                phase phi [rad], shape; a and k in W */
    int instructions;        /* of the program; 0 without one */
    const int32_t *code;     /* (instructions, 2) operation, operand; results 0, 1, 2 are u along x, y, z, those that
                                it does not give are 0 */
    const double *constants; /* of the program */
} lw_wind;

/* Wind velocity [m/s] and its rate of change [m/s^2] at a point. */
typedef struct { lw_vec3 velocity, rate; } lw_wind_sample;

/* The wind at the point r [m], and its rate of change for an observer who passes r with velocity v. */
LW_API lw_wind_sample lw_wind_at(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v);

/* The same for n observers: t (n), r (n, 3), v (n, 3); velocity (n, 3), rate (n, 3). */
LW_API void lw_wind_sample_many(const lw_wind *wind, int n, const double *t, const double *r, const double *v,
                                double *velocity, double *rate);

/* 0, or 1 + the first component of which value or rate is not finite. */
LW_API int lw_wind_fault(lw_wind_sample sample);

#endif
