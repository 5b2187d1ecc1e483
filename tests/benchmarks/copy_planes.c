/* What a step of the lattice moves, and nothing else: nine floats read and nine written per cell. */
#include <stdint.h>

void copy_planes(int64_t cells, int64_t plane, const float *restrict from, float *restrict to) {
    const float *f1 = from + plane, *f2 = f1 + plane, *f3 = f2 + plane, *f4 = f3 + plane, *f5 = f4 + plane;
    const float *f6 = f5 + plane, *f7 = f6 + plane, *f8 = f7 + plane;
    float *t1 = to + plane, *t2 = t1 + plane, *t3 = t2 + plane, *t4 = t3 + plane, *t5 = t4 + plane;
    float *t6 = t5 + plane, *t7 = t6 + plane, *t8 = t7 + plane;
#if defined(__clang__)
#pragma clang loop vectorize(assume_safety)
#else
#pragma GCC ivdep
#endif
    for (int64_t i = 0; i < cells; ++i) {
        to[i] = from[i];
        t1[i] = f1[i];
        t2[i] = f2[i];
        t3[i] = f3[i];
        t4[i] = f4[i];
        t5[i] = f5[i];
        t6[i] = f6[i];
        t7[i] = f7[i];
        t8[i] = f8[i];
    }
}
