/* Cholesky's method, tile by tile: one waits until all above it are done, and then takes away their products. */
#include "lw_tiles.h"

#include <math.h>

#include "lw_math.h"

/* A row of a tile, which compilers keep in as few registers as there are to hold it. */
typedef double lanes __attribute__((vector_size(8 * LW_TILE), aligned(8), may_alias));

LW_INLINE void load(lanes rest[LW_TILE], const double *tile, int64_t row) {
    for (int i = 0; i < LW_TILE; ++i) rest[i] = *(const lanes *)(tile + i * row);
}

LW_INLINE void store(double *tile, int64_t row, const lanes rest[LW_TILE]) {
    for (int i = 0; i < LW_TILE; ++i) *(lanes *)(tile + i * row) = rest[i];
}

/* rest -= a^T b for tiles in rows of the given lengths. */
LW_INLINE void take(lanes rest[LW_TILE], const double *a, int64_t a_row, const double *b, int64_t b_row) {
    for (int p = 0; p < LW_TILE; ++p) {
        const lanes row = *(const lanes *)(b + p * b_row);
        for (int i = 0; i < LW_TILE; ++i) rest[i] -= a[p * a_row + i] * row;
    }
}

/* rest -= a b, a of the factor. */
LW_INLINE void take_upper(lanes rest[LW_TILE], const double *a, const double *b, int64_t b_row) {
    for (int p = 0; p < LW_TILE; ++p) {
        const lanes row = *(const lanes *)(b + p * b_row);
        for (int i = 0; i < LW_TILE; ++i) rest[i] -= a[i * LW_TILE + p] * row;
    }
}

/* Solve u^T x = x and u x = x with a tile of the diagonal, for 8 right-hand sides in rows of that length. */
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

LW_INLINE int32_t factorise(const lw_tiles *t, double least) {
    int32_t first = 0; /* row of tiles that reaches this column */
    for (int32_t i = 0; i < t->blocks; ++i) {
        double own[LW_TILE], *diagonal = lw_tile_at(t, i, i);
        for (int k = 0; k < LW_TILE; ++k) own[k] = diagonal[k * LW_TILE + k];
        while (t->end[first] <= i) ++first;
        for (int32_t j = i, from = first; j < t->end[i] && i > first; ++j) {
            double *tile = lw_tile_at(t, i, j);
            lanes rest[LW_TILE];
            while (from < i && t->end[from] <= j) ++from;
            load(rest, tile, LW_TILE);
            for (int32_t p = from; p < i; ++p)
                take(rest, lw_tile_at(t, p, i), LW_TILE, lw_tile_at(t, p, j), LW_TILE);
            store(tile, LW_TILE, rest);
        }
        const int32_t bad = pivots(diagonal, own, least);
        if (bad >= 0) return i * LW_TILE + bad;
        for (int32_t j = i + 1; j < t->end[i]; ++j) solve(diagonal, lw_tile_at(t, i, j), LW_TILE);
    }
    return -1;
}

LW_INLINE void forward(const lw_tiles *t, int32_t width, double *x) {
    int32_t first = 0;
    for (int32_t i = 0; i < t->blocks; ++i) {
        while (t->end[first] <= i) ++first;
        for (int32_t c = 0; c < width; c += LW_TILE) {
            double *mine = x + (int64_t)i * LW_TILE * width + c;
            lanes rest[LW_TILE];
            load(rest, mine, width);
            for (int32_t p = first; p < i; ++p)
                take(rest, lw_tile_at(t, p, i), LW_TILE, x + (int64_t)p * LW_TILE * width + c, width);
            store(mine, width, rest);
            solve(lw_tile_at(t, i, i), mine, width);
        }
    }
}

LW_INLINE void backward(const lw_tiles *t, int32_t width, double *x) {
    for (int32_t i = t->blocks - 1; i >= 0; --i)
        for (int32_t c = 0; c < width; c += LW_TILE) {
            double *mine = x + (int64_t)i * LW_TILE * width + c;
            lanes rest[LW_TILE];
            load(rest, mine, width);
            for (int32_t j = i + 1; j < t->end[i]; ++j)
                take_upper(rest, lw_tile_at(t, i, j), x + (int64_t)j * LW_TILE * width + c, width);
            store(mine, width, rest);
            solve_upper(lw_tile_at(t, i, i), mine, width);
        }
}

LW_INLINE void products(const lw_tiles *t, int32_t width, const double *x, double *out) {
    for (int32_t a = 0; a < width; a += LW_TILE)
        for (int32_t b = 0; b < width; b += LW_TILE) {
            lanes rest[LW_TILE] = {{0.0}};
            for (int32_t i = 0; i < t->blocks; ++i) {
                const double *rows = x + (int64_t)i * LW_TILE * width;
                take(rest, rows + a, width, rows + b, width);
            }
            store(out + a * width + b, width, rest);
        }
}

/* ---- one version for each set of instructions ---- */

typedef enum { FACTORISE, FORWARD, BACKWARD, PRODUCTS } task;

typedef struct {
    task task;
    double least;
    int32_t *failed;
    int32_t width;
    double *x, *products;
} work;

LW_INLINE void do_any(const lw_tiles *t, const work *w) {
    switch (w->task) {
    case FACTORISE: *w->failed = factorise(t, w->least); break;
    case FORWARD: forward(t, w->width, w->x); break;
    case BACKWARD: backward(t, w->width, w->x); break;
    case PRODUCTS: products(t, w->width, w->x, w->products); break;
    }
}

LW_VERSIONS(perform, do_any, (const lw_tiles *t, const work *w), (t, w), t->instructions)

int32_t lw_tiles_factorise(const lw_tiles *t, double least) {
    int32_t failed;
    const work w = {.task = FACTORISE, .least = least, .failed = &failed};
    perform(t, &w);
    return failed;
}

void lw_tiles_forward(const lw_tiles *t, int32_t width, double *x) {
    const work w = {.task = FORWARD, .width = width, .x = x};
    perform(t, &w);
}

void lw_tiles_backward(const lw_tiles *t, int32_t width, double *x) {
    const work w = {.task = BACKWARD, .width = width, .x = x};
    perform(t, &w);
}

void lw_tiles_products(const lw_tiles *t, int32_t width, const double *x, double *out) {
    const work w = {.task = PRODUCTS, .width = width, .x = (double *)x, .products = out};
    perform(t, &w);
}
