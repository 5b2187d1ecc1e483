#include "lw_mobility3.h"

#include <math.h>
#include <string.h>

#include "lw_stencil3.h"

/* Share of its own mobility that a marker is softer by, so that the factor exists where markers come close. */
static const double softness = 1e-5;

/* Surfaces that cross have markers nearer to each other than this [cells]: those on one are 1.1 apart. */
static const double nearest = 0.8;

enum {
    REACH = 2,            /* cells between the middles of stencils that meet */
    WIDE = 3 + 2 * REACH, /* cells that stencils cover which meet another */
    NOWHERE = -1000000,   /* cell of what fills up the last block */
    CHUNK = 32            /* markers that a thread takes at a time */
};

/* ---- which stencils meet ---- */

static int marker_at(const lw_boundary3 *b, int place) { return b->order[place].point; }

static int last_of(const lw_boundary3 *b, int block) {
    const int last = (block + 1) * LW_TILE;
    return last < b->count ? last : b->count;
}

/* The cells of a block, in the order of the markers. */
static void gather(lw_boundary3 *b, int block) {
    int32_t *box = b->box + 6 * block;
    for (int axis = 0; axis < 3; ++axis) {
        int32_t *cells = b->cells + (3 * block + axis) * LW_TILE;
        for (int q = 0; q < LW_TILE; ++q) cells[q] = NOWHERE;
        for (int p = block * LW_TILE; p < last_of(b, block); ++p) {
            const int32_t at = b->cell[3 * marker_at(b, p) + axis];
            cells[p % LW_TILE] = at;
            if (p % LW_TILE == 0 || at < box[axis]) box[axis] = at;
            if (p % LW_TILE == 0 || at > box[3 + axis]) box[3 + axis] = at;
        }
    }
}

LW_INLINE int box_apart(const int32_t *box, const int32_t *low, const int32_t *high) {
    for (int axis = 0; axis < 3; ++axis)
        if (low[axis] - box[3 + axis] > REACH || box[axis] - high[axis] > REACH) return 1;
    return 0;
}

/* Which stencils of a block are apart from one with this middle? Returns how many meet it. */
LW_INLINE int meet(const int32_t *cells, const int32_t *cell, int32_t apart[LW_TILE]) {
    int32_t count = 0;
    for (int q = 0; q < LW_TILE; ++q) {
        const uint32_t x = (uint32_t)(cells[q] - cell[0] + REACH);
        const uint32_t y = (uint32_t)(cells[LW_TILE + q] - cell[1] + REACH);
        const uint32_t z = (uint32_t)(cells[2 * LW_TILE + q] - cell[2] + REACH);
        apart[q] = (x > 2 * REACH) | (y > 2 * REACH) | (z > 2 * REACH);
        count += 1 - apart[q];
    }
    return count;
}

static int blocks_apart(const lw_boundary3 *b, int i, int j) {
    int32_t apart[LW_TILE];
    const int32_t *box = b->box + 6 * i;
    if (box_apart(b->box + 6 * j, box, box + 3)) return 1;
    for (int p = i * LW_TILE; p < last_of(b, i); ++p)
        if (meet(b->cells + 3 * LW_TILE * j, b->cell + 3 * marker_at(b, p), apart)) return 0;
    return 1;
}

/* How far every row of tiles reaches. */
static void lay_out(lw_boundary3 *b) {
    lw_tiles *t = &b->mobility;
    int64_t start = 0;
    for (int32_t i = 0; i < t->blocks; ++i) gather(b, i);
    for (int32_t i = 0; i < t->blocks; ++i) {
        const int32_t least = i > 0 && t->end[i - 1] > i + 1 ? t->end[i - 1] : i + 1;
        int32_t end = t->blocks;
        while (end > least && blocks_apart(b, i, end - 1)) --end;
        t->end[i] = end;
        t->start[i] = start;
        start += end - i;
    }
}

/* ---- the velocity at marker k by a unit force at marker m ---- */

/* What a force at a marker does, where stencils that meet its own can see it: rows along x, none outside. */
typedef struct { double of[WIDE][WIDE][WIDE + 1]; } surroundings;

LW_INLINE void surround(const lw_boundary3 *b, int k, surroundings *s) {
    const double *weight = b->weight + LW_STENCIL3 * k, *lightness = b->lightness + LW_STENCIL3 * k;
    for (int r = 0; r < LW_ROWS3; ++r)
        for (int i = 0; i < 3; ++i) {
            const int c = LW_ROW3 * r + i;
            s->of[REACH + r / 3][REACH + r % 3][REACH + i] = weight[c] * lightness[c];
        }
}

LW_INLINE double mobility(const lw_boundary3 *b, const surroundings *s, int k, int m) {
    const int32_t *from = b->cell + 3 * k, *to = b->cell + 3 * m;
    const double *weight = b->weight + LW_STENCIL3 * m;
    const double *seen = &s->of[to[2] - from[2] + REACH][to[1] - from[1] + REACH][to[0] - from[0] + REACH];
    double sum[LW_ROW3] = {0.0, 0.0, 0.0, 0.0};
    for (int z = 0; z < 3; ++z)
        for (int y = 0; y < 3; ++y)
            for (int i = 0; i < LW_ROW3; ++i)
                sum[i] += weight[LW_ROW3 * (3 * z + y) + i] * seen[(z * WIDE + y) * (WIDE + 1) + i];
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* Do two markers belong to bodies that touch and should not? */
LW_INLINE int touch(const lw_boundary3 *b, int k, int m) {
    const int32_t one = b->body[k], other = b->body[m];
    if (one == other || b->joined[one * b->bodies + other]) return 0;
    const lw_vec3 gap = lw_sub(lw_load3(b->at + 3 * k), lw_load3(b->at + 3 * m));
    return lw_dot(gap, gap) <= nearest * nearest;
}

/* A row of the matrix, from its diagonal on. Returns -1, or a marker that the row's must not touch. */
LW_INLINE int32_t fill_row(const lw_boundary3 *b, surroundings *s, int p) {
    const lw_tiles *t = &b->mobility;
    const int i = p / LW_TILE, k = marker_at(b, p);
    const int32_t *cell = b->cell + 3 * k;
    surround(b, k, s);
    for (int j = i; j < t->end[i]; ++j) {
        double *to = lw_tile_at(t, i, j) + p % LW_TILE * LW_TILE;
        int32_t apart[LW_TILE];
        for (int q = 0; q < LW_TILE; ++q) to[q] = 0.0;
        if (box_apart(b->box + 6 * j, cell, cell) || !meet(b->cells + 3 * LW_TILE * j, cell, apart)) continue;
        for (int q = j > i ? 0 : p % LW_TILE; q < LW_TILE; ++q) {
            if (apart[q]) continue;
            const int m = marker_at(b, j * LW_TILE + q);
            if (touch(b, k, m)) return m;
            to[q] = mobility(b, s, k, m);
        }
    }
    lw_tile_at(t, i, i)[p % LW_TILE * (LW_TILE + 1)] *= 1.0 + softness;
    return -1;
}

LW_INLINE void fill_block(const lw_boundary3 *b, int32_t block) {
    surroundings s = {{{{0.0}}}};
    b->touched[block] = -1;
    for (int p = block * LW_TILE; p < (block + 1) * LW_TILE; ++p) {
        if (p < b->count) {
            const int32_t other = fill_row(b, &s, p);
            if (other >= 0) b->touched[block] = other;
        } else { /* no marker: a row of the unit matrix */
            double *row = lw_tile_at(&b->mobility, block, block) + p % LW_TILE * LW_TILE;
            for (int q = 0; q < LW_TILE; ++q) row[q] = q == p % LW_TILE;
        }
    }
}

/* ---- what the fluid at the markers does by itself ---- */

LW_INLINE void sample(const lw_boundary3 *b, const lw_lattice3 *l, int k) {
    double x = 0.0, y = 0.0, z = 0.0;
    lw_weigh3(b->at + 3 * k, b->cell + 3 * k, b->weight + LW_STENCIL3 * k);
    for (int r = 0; r < LW_ROWS3; ++r) {
        const double *weight = b->weight + LW_STENCIL3 * k + LW_ROW3 * r;
        const lw_row3 row = lw_streamed3(l, lw_row3_at(l, b->cell + 3 * k, r));
        for (int i = 0; i < 3; ++i) {
            x += weight[i] * row.x[i];
            y += weight[i] * row.y[i];
            z += weight[i] * row.z[i];
        }
        memcpy(b->lightness + LW_STENCIL3 * k + LW_ROW3 * r, row.lightness, sizeof row.lightness);
    }
    lw_store3(b->velocity + 3 * k, lw_vec(x, y, z));
}

LW_INLINE void sample_chunk(const lw_boundary3 *b, const lw_lattice3 *l, int32_t chunk) {
    for (int k = chunk * CHUNK; k < b->count && k < (chunk + 1) * CHUNK; ++k) sample(b, l, k);
}

/* ---- one version for each set of instructions: without fast-math and contraction the same bits ---- */

typedef struct {
    const lw_boundary3 *boundary;
    const lw_lattice3 *lattice;
    int fill; /* blocks of the matrix, or sample chunks of markers */
} part_job;

LW_INLINE void do_any(const part_job *job, int32_t part) {
    if (job->fill) {
        fill_block(job->boundary, part);
    } else {
        sample_chunk(job->boundary, job->lattice, part);
    }
}

LW_VERSIONS(do_one, do_any, (const part_job *job, int32_t part), (job, part), job->lattice->instructions)

static void do_part(const void *job, int32_t part) { do_one(job, part); }

int lw_mobility3(lw_boundary3 *b, const lw_lattice3 *l, int32_t *marker) {
    part_job job = {b, l, 0};
    const lw_tiles *t = &b->mobility;
    lw_threads_run(l->threads, do_part, &job, (b->count + CHUNK - 1) / CHUNK);
    lw_order(b->count, b->at, b->order);
    lay_out(b);
    job.fill = 1;
    lw_threads_run(l->threads, do_part, &job, t->blocks);
    for (int32_t i = 0; i < t->blocks; ++i) {
        *marker = b->touched[i];
        if (*marker >= 0) return LW_OVERLAP;
    }
    const int32_t bad = lw_tiles_factorise(t, 0.1 * softness);
    *marker = bad < 0 ? -1 : marker_at(b, bad);
    return bad < 0 ? LW_PLACED : LW_OVERLAP;
}
