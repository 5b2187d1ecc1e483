/* Cholesky's method, tile by tile: each waits until all tiles above it are done and then takes away their products. */
#include "lw_tiles.h"

#include <math.h>

#include "lw_math.h"

/* c -= a^T b for tiles in rows of the given lengths. */
LW_INLINE void take(double *restrict c, int64_t c_row, const double *restrict a, int64_t a_row,
                    const double *restrict b, int64_t b_row) {
    for (int i = 0; i < LW_TILE; ++i) {
        double rest[LW_TILE];
        for (int j = 0; j < LW_TILE; ++j) rest[j] = c[i * c_row + j];
        for (int p = 0; p < LW_TILE; ++p)
            for (int j = 0; j < LW_TILE; ++j) rest[j] -= a[p * a_row + i] * b[p * b_row + j];
        for (int j = 0; j < LW_TILE; ++j) c[i * c_row + j] = rest[j];
    }
}

/* c -= a b, a of the factor. */
LW_INLINE void take_upper(double *restrict c, const double *restrict a, const double *restrict b, int64_t row) {
    for (int i = 0; i < LW_TILE; ++i) {
        double rest[LW_TILE];
        for (int j = 0; j < LW_TILE; ++j) rest[j] = c[i * row + j];
        for (int p = 0; p < LW_TILE; ++p)
            for (int j = 0; j < LW_TILE; ++j) rest[j] -= a[i * LW_TILE + p] * b[p * row + j];
        for (int j = 0; j < LW_TILE; ++j) c[i * row + j] = rest[j];
    }
}

/* Solve u^T x = x and u x = x with a tile of the diagonal, for 8 right-hand sides in rows of the given length. */
LW_INLINE void solve(const double *restrict u, double *restrict x, int64_t row) {
    for (int i = 0; i < LW_TILE; ++i) {
        for (int p = 0; p < i; ++p)
            for (int j = 0; j < LW_TILE; ++j) x[i * row + j] -= u[p * LW_TILE + i] * x[p * row + j];
        for (int j = 0; j < LW_TILE; ++j) x[i * row + j] *= u[i * LW_TILE + i];
    }
}

LW_INLINE void solve_upper(const double *restrict u, double *restrict x, int64_t row) {
    for (int i = LW_TILE - 1; i >= 0; --i) {
        for (int p = i + 1; p < LW_TILE; ++p)
            for (int j = 0; j < LW_TILE; ++j) x[i * row + j] -= u[i * LW_TILE + p] * x[p * row + j];
        for (int j = 0; j < LW_TILE; ++j) x[i * row + j] *= u[i * LW_TILE + i];
    }
}

/* A tile of the diagonal. Returns -1, or the row that has less left than `least` of what it had, `own`. */
LW_INLINE int32_t pivots(double *restrict u, const double *own, double least) {
    for (int i = 0; i < LW_TILE; ++i) {
        double *row = u + i * LW_TILE;
        for (int p = 0; p < i; ++p)
            for (int j = i; j < LW_TILE; ++j) row[j] -= u[p * LW_TILE + i] * u[p * LW_TILE + j];
        if (!(row[i] > least * own[i])) return i;
        row[i] = 1.0 / sqrt(row[i]);
        for (int j = i + 1; j < LW_TILE; ++j) row[j] *= row[i];
    }
    return -1;
}

LW_INLINE int32_t factorise(const lw_tiles *e, double least) {
    int32_t first = 0; /* row of tiles that reaches this column */
    for (int32_t i = 0; i < e->blocks; ++i) {
        double own[LW_TILE], *diagonal = lw_tile_at(e, i, i);
        for (int k = 0; k < LW_TILE; ++k) own[k] = diagonal[k * LW_TILE + k];
        while (e->end[first] <= i) ++first;
        for (int32_t p = first; p < i; ++p) {
            const double *above = lw_tile_at(e, p, i);
            for (int32_t j = i; j < e->end[p]; ++j)
                take(lw_tile_at(e, i, j), LW_TILE, above, LW_TILE, lw_tile_at(e, p, j), LW_TILE);
        }
        const int32_t bad = pivots(diagonal, own, least);
        if (bad >= 0) return i * LW_TILE + bad;
        for (int32_t j = i + 1; j < e->end[i]; ++j) solve(diagonal, lw_tile_at(e, i, j), LW_TILE);
    }
    return -1;
}

LW_INLINE void forward(const lw_tiles *e, int32_t width, double *x) {
    int32_t first = 0;
    for (int32_t i = 0; i < e->blocks; ++i) {
        double *mine = x + (int64_t)i * LW_TILE * width;
        while (e->end[first] <= i) ++first;
        for (int32_t p = first; p < i; ++p)
            for (int32_t c = 0; c < width; c += LW_TILE)
                take(mine + c, width, lw_tile_at(e, p, i), LW_TILE, x + (int64_t)p * LW_TILE * width + c, width);
        for (int32_t c = 0; c < width; c += LW_TILE) solve(lw_tile_at(e, i, i), mine + c, width);
    }
}

LW_INLINE void backward(const lw_tiles *e, int32_t width, double *x) {
    for (int32_t i = e->blocks - 1; i >= 0; --i) {
        double *mine = x + (int64_t)i * LW_TILE * width;
        for (int32_t j = i + 1; j < e->end[i]; ++j)
            for (int32_t c = 0; c < width; c += LW_TILE)
                take_upper(mine + c, lw_tile_at(e, i, j), x + (int64_t)j * LW_TILE * width + c, width);
        for (int32_t c = 0; c < width; c += LW_TILE) solve_upper(lw_tile_at(e, i, i), mine + c, width);
    }
}

LW_INLINE void products(const lw_tiles *e, int32_t width, const double *x, double *out) {
    for (int32_t k = 0; k < width * width; ++k) out[k] = 0.0;
    for (int32_t i = 0; i < e->blocks; ++i) {
        const double *mine = x + (int64_t)i * LW_TILE * width;
        for (int32_t a = 0; a < width; a += LW_TILE)
            for (int32_t b = 0; b < width; b += LW_TILE) take(out + a * width + b, width, mine + a, width, mine + b, width);
    }
}

/* ---- one version for each set of instructions: without fast-math and contraction they give the same bits ---- */

typedef enum { FACTORISE, FORWARD, BACKWARD, PRODUCTS } task;

typedef struct {
    task task;
    double least;
    int32_t width;
    double *x, *products;
} work;

LW_INLINE int32_t do_any(const lw_tiles *e, const work *w) {
    switch (w->task) {
    case FACTORISE: return factorise(e, w->least);
    case FORWARD: forward(e, w->width, w->x); break;
    case BACKWARD: backward(e, w->width, w->x); break;
    case PRODUCTS: products(e, w->width, w->x, w->products); break;
    }
    return -1;
}

static int32_t do_plain(const lw_tiles *e, const work *w) { return do_any(e, w); }

#if defined(__x86_64__) && defined(__GNUC__) && !defined(LW_ONE_VERSION)
__attribute__((target("avx2"))) static int32_t do_avx2(const lw_tiles *e, const work *w) { return do_any(e, w); }
__attribute__((target("avx512f"))) static int32_t do_avx512(const lw_tiles *e, const work *w) {
    return do_any(e, w);
}

static int32_t perform(const lw_tiles *e, const work *w) {
    switch (e->instructions) {
    case LW_AVX512: return do_avx512(e, w);
    case LW_AVX2: return do_avx2(e, w);
    default: return do_plain(e, w);
    }
}
#else
static int32_t perform(const lw_tiles *e, const work *w) { return do_plain(e, w); }
#endif

int32_t lw_tiles_factorise(const lw_tiles *e, double least) {
    const work w = {.task = FACTORISE, .least = least};
    return perform(e, &w);
}

void lw_tiles_forward(const lw_tiles *e, int32_t width, double *x) {
    const work w = {.task = FORWARD, .width = width, .x = x};
    perform(e, &w);
}

void lw_tiles_backward(const lw_tiles *e, int32_t width, double *x) {
    const work w = {.task = BACKWARD, .width = width, .x = x};
    perform(e, &w);
}

void lw_tiles_products(const lw_tiles *e, int32_t width, const double *x, double *out) {
    const work w = {.task = PRODUCTS, .width = width, .x = (double *)x, .products = out};
    perform(e, &w);
}
