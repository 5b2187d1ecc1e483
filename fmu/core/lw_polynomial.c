#include "lw_polynomial.h"

#include <math.h>

int lw_polynomial_init(lw_polynomial *polynomial, int count, const double *nodes) {
    if (count < 1 || count > LW_MAX_NODES) return 1;
    polynomial->count = count;
    for (int j = 0; j < count; ++j) {
        double product = 1.0;
        for (int k = 0; k < count; ++k)
            if (k != j) product *= nodes[j] - nodes[k];
        if (!isfinite(nodes[j]) || !isfinite(product) || product == 0.0) return 1;
        polynomial->node[j] = nodes[j];
        polynomial->scale[j] = 1.0 / product;
    }
    return 0;
}

static double weight(const lw_polynomial *polynomial, int j, double s) {
    if (s == polynomial->node[j]) return 1.0;
    double product = polynomial->scale[j];
    for (int k = 0; k < polynomial->count; ++k)
        if (k != j) product *= s - polynomial->node[k];
    return product;
}

void lw_polynomial_value(const lw_polynomial *polynomial, double s, int size, const double *samples,
                         double *value) {
    double first = weight(polynomial, 0, s);
    for (int i = 0; i < size; ++i) value[i] = first * samples[i];
    for (int j = 1; j < polynomial->count; ++j) {
        double factor = weight(polynomial, j, s);
        const double *sample = samples + (long)j * size;
        for (int i = 0; i < size; ++i) value[i] += factor * sample[i];
    }
}
