#include "lw_model.h"

/* Gaussian elimination with row pivots; the solution replaces the right-hand side. */
int lw_solve(int m, double *a, double *b) {
    for (int k = 0; k < m; ++k) {
        int pivot = k;
        for (int i = k + 1; i < m; ++i)
            if (fabs(a[i * m + k]) > fabs(a[pivot * m + k])) pivot = i;
        if (!(fabs(a[pivot * m + k]) > 0.0)) return LW_NOT_CONVERGED;
        for (int j = k; j < m && pivot != k; ++j) {
            double swap = a[k * m + j];
            a[k * m + j] = a[pivot * m + j], a[pivot * m + j] = swap;
        }
        double swap = b[k];
        b[k] = b[pivot], b[pivot] = swap;
        for (int i = k + 1; i < m; ++i) {
            double factor = a[i * m + k] / a[k * m + k];
            if (factor == 0.0) continue;
            for (int j = k + 1; j < m; ++j) a[i * m + j] -= factor * a[k * m + j];
            b[i] -= factor * b[k];
        }
    }
    for (int i = m - 1; i >= 0; --i) {
        for (int j = i + 1; j < m; ++j) b[i] -= a[i * m + j] * b[j];
        b[i] /= a[i * m + i];
    }
    return LW_OK;
}
