#include "lw_wind.h"

static const double two_pi = 6.283185307179586476925286766559;

/* The shape of a gust at a phase [rad], and its derivative. */
typedef struct { double value, slope; } lw_shape;

static lw_shape shape_at(double shape, double phase) {
    lw_shape at = {0.0, 0.0};
    if (shape == (double)LW_SINE) {
        at.value = sin(phase);
        at.slope = cos(phase);
    } else if (phase >= 0.0 && phase <= two_pi) {
        at.value = 0.5 * (1.0 - cos(phase));
        at.slope = 0.5 * sin(phase);
    }
    return at;
}

lw_wind_sample lw_wind_at(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v) {
    lw_wind_sample sample = {lw_load3(wind->uniform), {0.0, 0.0, 0.0}};
    for (int i = 0; i < wind->n_gusts; ++i) {
        const double *gust = wind->gusts + i * LW_GUST_SIZE;
        const lw_vec3 amplitude = lw_load3(gust), wavenumber = lw_load3(gust + 4);
        const double phase = two_pi * (gust[3] * t + lw_dot(wavenumber, r)) + gust[7];
        const double encounter = two_pi * (gust[3] + lw_dot(wavenumber, v)); /* angular frequency met */
        const lw_shape at = shape_at(gust[8], phase);
        sample.velocity = lw_add(sample.velocity, lw_scale(at.value, amplitude));
        sample.rate = lw_add(sample.rate, lw_scale(encounter * at.slope, amplitude));
    }
    return sample;
}
