/* The widest set of vector instructions that loops may be compiled for: it is chosen when the program runs. */
#ifndef LW_INSTRUCTIONS_H
#define LW_INSTRUCTIONS_H

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

#include "lw_math.h"

typedef enum { LW_PLAIN, LW_AVX2, LW_AVX512 } lw_instructions;

/* The widest one that processor and system have. */
lw_instructions lw_instructions_here(void);

/* Define the function `name` of some parameters: what `body` does with the arguments, which the compiler must
 * inline, in a version for each set of instructions, of which `set` is one. Without fast-math and contraction
 * they give the same bits. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(LW_ONE_VERSION)
#define LW_VERSIONS(name, body, parameters, arguments, set)                                   \
    static void name##_plain parameters { body arguments; }                                   \
    __attribute__((target("avx2"))) static void name##_avx2 parameters { body arguments; }    \
    __attribute__((target("avx512f"))) static void name##_avx512 parameters { body arguments; } \
    static void name parameters {                                                             \
        switch (set) {                                                                        \
        case LW_AVX512: name##_avx512 arguments; return;                                      \
        case LW_AVX2: name##_avx2 arguments; return;                                          \
        default: name##_plain arguments;                                                      \
        }                                                                                     \
    }
#else
#define LW_VERSIONS(name, body, parameters, arguments, set) \
    static void name parameters {                           \
        (void)(set);                                        \
        body arguments;                                     \
    }
#endif

/* Before a loop whose turns do not depend on each other, which the compiler cannot see for many pointers. */
#if defined(__clang__)
#define LW_INDEPENDENT _Pragma("clang loop vectorize(assume_safety)")
#elif defined(__GNUC__)
#define LW_INDEPENDENT _Pragma("GCC ivdep")
#else
#define LW_INDEPENDENT
#endif

/* From now on numbers that are too small for a float are zero, which they are ahead of the first waves in a fluid at
 * rest: handled in full they make a step several times as slow. Returns what lw_restore_small takes. */
LW_INLINE unsigned lw_flush_small(void) {
#if defined(__SSE__)
    const unsigned mode = _mm_getcsr(), flush_to_zero = 0x8000, denormals_are_zero = 0x0040;
    _mm_setcsr(mode | flush_to_zero | denormals_are_zero);
    return mode;
#else
    return 0;
#endif
}

LW_INLINE void lw_restore_small(unsigned mode) {
#if defined(__SSE__)
    _mm_setcsr(mode);
#else
    (void)mode;
#endif
}

#endif
