#include "lw_wind.h"

#include "lw_expression.h"

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

/* Add the functions of time and place. */
static void add_functions(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v, lw_wind_sample *sample) {
    const lw_jet variables[LW_WIND_VARIABLES] = {{t, 1.0, 0.0}, {r.x, v.x, 0.0}, {r.y, v.y, 0.0}, {r.z, v.z, 0.0}};
    lw_jet u[3] = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    lw_expression_jet(wind->code, wind->code + 2 * wind->instructions, wind->constants, variables, u);
    sample->velocity = lw_add(sample->velocity, lw_vec(u[0].value, u[1].value, u[2].value));
    sample->rate = lw_add(sample->rate, lw_vec(u[0].rate, u[1].rate, u[2].rate));
}

lw_wind_sample lw_wind_at(const lw_wind *wind, double t, lw_vec3 r, lw_vec3 v) {
    lw_wind_sample sample = {lw_load3(wind->uniform), {0.0, 0.0, 0.0}};
    if (wind->instructions) add_functions(wind, t, r, v, &sample);
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

void lw_wind_sample_many(const lw_wind *wind, int n, const double *t, const double *r, const double *v,
                         double *velocity, double *rate) {
    for (int i = 0; i < n; ++i) {
        const lw_wind_sample sample = lw_wind_at(wind, t[i], lw_load3(r + 3 * i), lw_load3(v + 3 * i));
        lw_store3(velocity + 3 * i, sample.velocity);
        lw_store3(rate + 3 * i, sample.rate);
    }
}

int lw_wind_fault(lw_wind_sample sample) {
    const lw_vec3 u = sample.velocity, a = sample.rate;
    return !isfinite(u.x + a.x) ? 1 : !isfinite(u.y + a.y) ? 2 : !isfinite(u.z + a.z) ? 3 : 0;
}
