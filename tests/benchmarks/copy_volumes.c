/* What a step of the lattice in space moves, and nothing else: 19 floats read and 19 written per cell. */
#include <stdint.h>

void copy_volumes(int64_t cells, int64_t volume, const float *restrict from, float *restrict to) {
    const float *f[19];
    float *t[19];
    for (int q = 0; q < 19; ++q) {
        f[q] = from + q * volume;
        t[q] = to + q * volume;
    }
#if defined(__clang__)
#pragma clang loop vectorize(assume_safety)
#else
#pragma GCC ivdep
#endif
    for (int64_t i = 0; i < cells; ++i) {
        t[0][i] = f[0][i];
        t[1][i] = f[1][i];
        t[2][i] = f[2][i];
        t[3][i] = f[3][i];
        t[4][i] = f[4][i];
        t[5][i] = f[5][i];
        t[6][i] = f[6][i];
        t[7][i] = f[7][i];
        t[8][i] = f[8][i];
        t[9][i] = f[9][i];
        t[10][i] = f[10][i];
        t[11][i] = f[11][i];
        t[12][i] = f[12][i];
        t[13][i] = f[13][i];
        t[14][i] = f[14][i];
        t[15][i] = f[15][i];
        t[16][i] = f[16][i];
        t[17][i] = f[17][i];
        t[18][i] = f[18][i];
    }
}
