/* Linear equations a x = b, (m,m) row-major: Gaussian elimination with row pivots. */
#include "lw_model.h"

static void swap(double *a, double *b) {
    double kept = *a;
    *a = *b, *b = kept;
}

int lw_factor(int m, double *a, double *pivots) {
    for (int k = 0; k < m; ++k) {
        int pivot = k;
        for (int i = k + 1; i < m; ++i)
            if (fabs(a[(size_t)i * m + k]) > fabs(a[(size_t)pivot * m + k])) pivot = i;
        double *upper = a + (size_t)k * m, *other = a + (size_t)pivot * m;
        if (!(fabs(other[k]) > 0.0)) return LW_NOT_CONVERGED;
        pivots[k] = pivot;
        for (int j = 0; j < m && pivot != k; ++j) swap(&upper[j], &other[j]);
        for (int i = k + 1; i < m; ++i) {
            double *row = a + (size_t)i * m, factor = row[k] = row[k] / upper[k];
            if (factor == 0.0) continue;
            for (int j = k + 1; j < m; ++j) row[j] -= factor * upper[j];
        }
    }
    return LW_OK;
}

void lw_substitute(int m, const double *a, const double *pivots, double *b) {
    for (int k = 0; k < m; ++k) swap(&b[k], &b[(int)pivots[k]]);
    for (int i = 1; i < m; ++i)
        for (int j = 0; j < i; ++j) b[i] -= a[(size_t)i * m + j] * b[j];
    for (int i = m - 1; i >= 0; --i) {
        const double *row = a + (size_t)i * m;
        for (int j = i + 1; j < m; ++j) b[i] -= row[j] * b[j];
        b[i] /= row[i];
    }
}
