/* Wind: a uniform stream and travelling sinusoidal gusts.
 *
 *   U(t, r) = U0 + sum_i a_i sin(2 pi (f_i t + k_i . r) + phi_i)
 *
 * The total derivative at a point that moves with velocity v, dU/dt = @U/@t + (v . grad) U, is what an
 * added mass feels of an unsteady wind.
 */
#ifndef LW_WIND_H
#define LW_WIND_H

#include "lw_math.h"

enum { LW_GUST_SIZE = 8 };

typedef struct {
    double uniform[3];   /* U0 [m/s] in W */
    int n_gusts;
    const double *gusts; /* (n_gusts, 8): amplitude a [m/s] (3), frequency f [Hz], wavenumber k [1/m] (3),
                            phase phi [rad]; a and k in W */
} lw_wind;

/* Wind velocity [m/s] and its rate of change [m/s^2] at a point. */
typedef struct { lw_vec3 velocity, rate; } lw_wind_sample;

/* The wind at the point r [m], and its rate of change for an observer who passes r with velocity v. */
LW_API lw_wind_sample lw_wind_at(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v);

#endif
