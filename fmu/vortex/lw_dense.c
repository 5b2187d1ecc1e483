/* Gaussian elimination with row pivots, right-looking, in blocks of columns. Every number has the same products
 * taken away in the same order as without blocks, only sooner or later: so the blocks change no bit. */
#include "lw_dense.h"

#include <math.h>
#include <stddef.h>

#include "lw_math.h"

enum { BLOCK = 32, AT_ONCE = 8, TILE = 256 }; /* columns; rows that are taken away at once; numbers of a row */

/* Columns [begin, end) are eliminated. */
typedef struct { double *a; int m, begin, end; lw_instructions instructions; } block;

static double *row_of(const block *b, int i) { return b->a + (size_t)i * b->m; }

/* Take the rows [from, to) above, times what row i has in their columns, from its numbers [j, end). */
LW_INLINE void eliminate(const block *b, int i, int from, int to, int j, int end) {
    double *restrict row = row_of(b, i);
    int k = from;
    for (; k + AT_ONCE <= to; k += AT_ONCE) {
        const double *restrict above = row_of(b, k);
        double factor[AT_ONCE];
        for (int q = 0; q < AT_ONCE; ++q) factor[q] = row[k + q];
        for (int c = j; c < end; ++c) {
            double rest = row[c];
            for (int q = 0; q < AT_ONCE; ++q) rest -= factor[q] * above[(size_t)q * b->m + c];
            row[c] = rest;
        }
    }
    for (; k < to; ++k) {
        const double *restrict above = row_of(b, k);
        const double factor = row[k];
        for (int c = j; c < end; ++c) row[c] -= factor * above[c];
    }
}

/* What is right of the block: its own rows one after the other, then all below, a tile that stays near. */
LW_INLINE void rest_of(const block *b) {
    for (int j = b->end; j < b->m; j += TILE) {
        const int end = j + TILE < b->m ? j + TILE : b->m;
        for (int i = b->begin + 1; i < b->end; ++i) eliminate(b, i, b->begin, i, j, end);
        for (int i = b->end; i < b->m; ++i) eliminate(b, i, b->begin, b->end, j, end);
    }
}

LW_VERSIONS(rest, rest_of, (const block *b), (b), b->instructions)

static void exchange(const block *b, int i, int k) {
    double *one = row_of(b, i), *other = row_of(b, k);
    for (int j = 0; j < b->m && i != k; ++j) {
        const double kept = one[j];
        one[j] = other[j], other[j] = kept;
    }
}

/* The columns of the block, as if there were no others but for the exchange of rows. */
static int columns(const block *b, double *pivots) {
    for (int k = b->begin; k < b->end; ++k) {
        int pivot = k;
        for (int i = k + 1; i < b->m; ++i)
            if (fabs(row_of(b, i)[k]) > fabs(row_of(b, pivot)[k])) pivot = i;
        if (!(fabs(row_of(b, pivot)[k]) > 0.0)) return 1;
        pivots[k] = pivot;
        exchange(b, k, pivot);
        const double *upper = row_of(b, k);
        for (int i = k + 1; i < b->m; ++i) {
            double *row = row_of(b, i);
            row[k] /= upper[k];
            for (int j = k + 1; j < b->end; ++j) row[j] -= row[k] * upper[j];
        }
    }
    return 0;
}

int lw_factor_dense(int m, double *a, double *pivots, lw_instructions instructions) {
    for (int begin = 0; begin < m; begin += BLOCK) {
        const block b = {a, m, begin, begin + BLOCK < m ? begin + BLOCK : m, instructions};
        if (columns(&b, pivots)) return 1;
        rest(&b);
    }
    return 0;
}
