/* The 3 x 3 x 3 cells around a point of a lattice in space: their weights, and the fluid in them.
 *
 * In rows of three along x, with a fourth cell of no weight: so a row is four numbers side by side.
 */
#ifndef LW_STENCIL3_H
#define LW_STENCIL3_H

#include "lw_lattice3.h"

enum { LW_ROW3 = 4, LW_ROWS3 = 9, LW_STENCIL3 = LW_ROW3 * LW_ROWS3 };

/* Velocity and 1 / (2 density) of the cells of a row. */
typedef struct { double x[LW_ROW3], y[LW_ROW3], z[LW_ROW3], lightness[LW_ROW3]; } lw_row3;

/* Function of A. M. Roma, C. S. Peskin, M. J. Berger 1999, doi:10.1006/jcph.1999.6293: three cells wide. */
LW_INLINE double lw_delta(double r) {
    const double a = fabs(r);
    if (a <= 0.5) return (1.0 + sqrt(1.0 - 3.0 * a * a)) / 3.0;
    if (a >= 1.5) return 0.0;
    return (5.0 - 3.0 * a - sqrt(1.0 - 3.0 * (1.0 - a) * (1.0 - a))) / 6.0;
}

LW_INLINE void lw_middle3(const double *at, int32_t *cell) {
    for (int axis = 0; axis < 3; ++axis) cell[axis] = (int32_t)floor(at[axis] + 0.5);
}

/* The weights (9,4) of the cells around the middle one for a point at `at`. */
LW_INLINE void lw_weigh3(const double *at, const int32_t *middle, double *weight) {
    double of[3][3];
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 3; ++i) of[axis][i] = lw_delta(at[axis] - (middle[axis] + i - 1));
    for (int r = 0; r < LW_ROWS3; ++r)
        for (int i = 0; i < LW_ROW3; ++i)
            weight[LW_ROW3 * r + i] = i < 3 ? of[0][i] * of[1][r % 3] * of[2][r / 3] : 0.0;
}

/* The first cell of a row, in a volume. */
LW_INLINE int64_t lw_row3_at(const lw_lattice3 *l, const int32_t *middle, int r) {
    return ((int64_t)(middle[2] + r / 3 - 1) * l->ny + middle[1] + r % 3 - 1) * l->nx + middle[0] - 1;
}

/* Add what comes along a pair of axes, `of` its four directions, to density and momentum. */
LW_INLINE void lw_add_diagonals(const float *of, int64_t volume, int64_t one, int64_t other, double *density,
                                double *along_one, double *along_other) {
    const float *both = of - one - other, *none = of + volume + one + other;
    const float *first = of + 2 * volume - one + other, *second = of + 3 * volume + one - other;
    for (int i = 0; i < LW_ROW3; ++i) {
        const double alike = (double)both[i] - (double)none[i], unlike = (double)first[i] - (double)second[i];
        density[i] += ((double)both[i] + (double)none[i]) + ((double)first[i] + (double)second[i]);
        along_one[i] += alike + unlike;
        along_other[i] += alike - unlike;
    }
}

/* A row after it has streamed, without force. */
LW_INLINE lw_row3 lw_streamed3(const lw_lattice3 *l, int64_t cell) {
    const int64_t x = 1, y = l->nx, z = (int64_t)l->nx * l->ny, volume = l->volume, step[3] = {x, y, z};
    const float *from = l->populations + cell;
    double density[LW_ROW3], momentum[3][LW_ROW3];
    for (int i = 0; i < LW_ROW3; ++i) density[i] = 1.0 + (double)from[i];
    for (int a = 0; a < 3; ++a) {
        const float *plus = from + (1 + 2 * a) * volume - step[a], *minus = from + (2 + 2 * a) * volume + step[a];
        for (int i = 0; i < LW_ROW3; ++i) {
            density[i] += (double)plus[i] + (double)minus[i];
            momentum[a][i] = (double)plus[i] - (double)minus[i];
        }
    }
    lw_add_diagonals(from + 7 * volume, volume, x, y, density, momentum[0], momentum[1]);
    lw_add_diagonals(from + 11 * volume, volume, x, z, density, momentum[0], momentum[2]);
    lw_add_diagonals(from + 15 * volume, volume, y, z, density, momentum[1], momentum[2]);
    lw_row3 out;
    for (int i = 0; i < LW_ROW3; ++i) {
        const double inverse = 1.0 / density[i];
        out.x[i] = momentum[0][i] * inverse;
        out.y[i] = momentum[1][i] * inverse;
        out.z[i] = momentum[2][i] * inverse;
        out.lightness[i] = 0.5 * inverse;
    }
    return out;
}

#endif
