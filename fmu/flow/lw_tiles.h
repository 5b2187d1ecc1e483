/* Symmetric, positive definite matrices of thousands of rows whose numbers lie near the diagonal: S = U^T U.
 *
 * In tiles of 8 x 8, of which those within an envelope are kept. Every number has the same products taken away in
 * the same order whatever the instructions: the bits are the same.
 */
#ifndef LW_TILES_H
#define LW_TILES_H

#include <stdint.h>

#include "lw_instructions.h"

enum { LW_TILE = 8, LW_TILE_SIZE = LW_TILE * LW_TILE };

typedef struct {
    int32_t blocks;       /* rows of tiles; rows that fill up the last one are those of a unit matrix */
    int32_t instructions; /* lw_instructions of this processor */
    int32_t *end;         /* (blocks) past the last column of tiles of each row: no less than of the row before */
    int64_t *start;       /* (blocks) tiles before those of the row, whose first one is on the diagonal */
    double *tiles;        /* room for blocks (blocks + 1) / 2 of them, each (8,8); memory that is not reached is
                             not touched */
} lw_tiles;

/* Tile (i, j), j at least i. */
static inline double *lw_tile_at(const lw_tiles *e, int32_t i, int32_t j) {
    return e->tiles + (e->start[i] + j - i) * LW_TILE_SIZE;
}

/* Replace the upper part of S by U; its diagonal holds reciprocals. Returns -1, or the first row in which not more
 * than `least` of the diagonal is left. */
int32_t lw_tiles_factorise(const lw_tiles *tiles, double least);

/* Solve U^T x = x, and U x = x, for `width` right-hand sides, a multiple of 8: x (8 blocks, width). */
void lw_tiles_forward(const lw_tiles *tiles, int32_t width, double *x);
void lw_tiles_backward(const lw_tiles *tiles, int32_t width, double *x);

/* Write -x^T x (width,width). */
void lw_tiles_products(const lw_tiles *tiles, int32_t width, const double *x, double *products);

#endif
