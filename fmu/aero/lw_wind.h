/* Wind: a uniform stream and travelling gusts.
 *
 *   U(t, r) = U0 + sum_i a_i s_i(2 pi (f_i t + k_i . r) + phi_i)
 *
 * s is a sine, or (1 - cos)/2 between 0 and 2 pi and 0 outside: a single gust, continuous with its slope.
 *
 * The total derivative at a point that moves with velocity v, dU/dt = @U/@t + (v . grad) U, is what an
 * added mass feels of an unsteady wind.
 */
#ifndef LW_WIND_H
#define LW_WIND_H

#include "lw_math.h"

enum { LW_GUST_SIZE = 9 };
enum { LW_SINE, LW_ONE_MINUS_COSINE }; /* shapes of gusts */

typedef struct {
    double uniform[3];   /* U0 [m/s] in W */
    int n_gusts;
    const double *gusts; /* (n_gusts, 9): amplitude a [m/s] (3), frequency f [Hz], wavenumber k [1/m] (3),
                            phase phi [rad], shape; a and k in W */
} lw_wind;

/* Wind velocity [m/s] and its rate of change [m/s^2] at a point. */
typedef struct { lw_vec3 velocity, rate; } lw_wind_sample;

/* The wind at the point r [m], and its rate of change for an observer who passes r with velocity v. */
LW_API lw_wind_sample lw_wind_at(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v);

#endif
