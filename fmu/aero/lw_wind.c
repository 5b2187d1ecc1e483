#include "lw_wind.h"

static const double two_pi = 6.283185307179586476925286766559;

lw_wind_sample lw_wind_at(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v) {
    lw_wind_sample sample = {lw_load3(wind->uniform), {0.0, 0.0, 0.0}};
    for (int i = 0; i < wind->n_gusts; ++i) {
        const double *gust = wind->gusts + i * LW_GUST_SIZE;
        const lw_vec3 amplitude = lw_load3(gust), wavenumber = lw_load3(gust + 4);
        const double phase = two_pi * (gust[3] * t + lw_dot(wavenumber, r)) + gust[7];
        const double encounter = two_pi * (gust[3] + lw_dot(wavenumber, v)); /* angular frequency met */
        sample.velocity = lw_add(sample.velocity, lw_scale(sin(phase), amplitude));
        sample.rate = lw_add(sample.rate, lw_scale(encounter * cos(phase), amplitude));
    }
    return sample;
}
