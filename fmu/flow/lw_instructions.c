/* Asked of the processor itself: the compilers' own way pulls in, with zig, a runtime whose sin, cos and exp then
 * take the place of the C library's in the whole of this library, and differ in the last bit. */
#include "lw_instructions.h"

#if defined(__x86_64__) && defined(__GNUC__)
#include <cpuid.h>

/* Which registers the system saves: bits 1, 2 for AVX, 5 to 7 for AVX-512. */
static unsigned saved(void) {
    unsigned low, high;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    return low;
}

lw_instructions lw_instructions_here(void) {
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & (1u << 27))) return LW_PLAIN; /* xgetbv is there */
    const unsigned registers = saved();
    if (!__get_cpuid_count(7, 0, &a, &b, &c, &d)) return LW_PLAIN;
    if ((registers & 0xe6u) == 0xe6u && (b & (1u << 16))) return LW_AVX512;
    if ((registers & 0x06u) == 0x06u && (b & (1u << 5))) return LW_AVX2;
    return LW_PLAIN;
}
#else
lw_instructions lw_instructions_here(void) { return LW_PLAIN; }
#endif
