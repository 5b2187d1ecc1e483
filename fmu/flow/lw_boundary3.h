/* Rigid bodies in a fluid on a lattice in space: markers at which the fluid moves with the body, exactly.
 *
 * The sibling of lw_boundary.h: every marker pushes the fluid of the 3 x 3 x 3 cells around it. Lattice units, world
 * axes; a pose is the centre of mass in the window [cells] and a unit quaternion (w, x, y, z), body to world; a
 * twist is linear, then angular; a wrench is force, then torque about the centre of mass.
 *
 * Equations and sources: fmu/README.md, "Bodies in the flow", "Bodies in space".
 */
#ifndef LW_BOUNDARY3_H
#define LW_BOUNDARY3_H

#include "lw_boundary.h"
#include "lw_lattice3.h"
#include "lw_order.h"
#include "lw_tiles.h"

typedef struct {
    int32_t bodies, count, faces;
    const int32_t *body;   /* (count) that carries a marker */
    const int32_t *face;   /* (faces,4) markers around a patch of a surface; a triangle repeats its last */
    const int32_t *joined; /* (bodies,bodies) whether two bodies may touch, for there is a joint between them */
    const double *point;   /* (count,3) place in the frame of the body [cells] */
    /* written by lw_boundary3_place */
    double *arm;           /* (count,3) from the centre of mass of the body, in world axes [cells] */
    double *at;            /* (count,3) in the window [cells]: the centre of cell (i, j, k) is at (i, j, k) */
    int32_t *cell;         /* (count,3) of the middle of the 3 x 3 x 3 cells */
    double *weight;        /* (count,9,4) of these cells, in rows of lw_stencil3.h */
    double *lightness;     /* (count,9,4) 1 / (2 density) of the fluid there */
    double *velocity;      /* (count,3) of the fluid at the marker at the end of the step, without force */
    lw_ordered *order;     /* (count) of the markers in `mobility` and `solution` */
    int32_t *cells;        /* (blocks,3,8) `cell` of the markers in that order */
    int32_t *box;          /* (blocks,6) the lowest and the highest of a block */
    int32_t *touched;      /* (blocks) a marker that one of the block must not touch, or -1 */
    lw_tiles mobility;     /* of 8 markers a block: the last ones of the last block may be none */
    double *solution;      /* (8 blocks, width), width a multiple of 8 of at least 4 bodies + 3 */
    double *products;      /* (width,width) */
} lw_boundary3;

/* Put the bodies to `pose` (bodies,7) and factorise. Returns an lw_placement; `marker` is the one that it is
 * about. */
LW_API int lw_boundary3_place(lw_boundary3 *boundary, const lw_lattice3 *lattice, const double *pose,
                              int32_t *marker);

/* The wrench (bodies,6) on the bodies over the coming step if they have the twists (bodies,6) at its end, and
 * minus its derivative by the twists, `response` (6 bodies, 6 bodies). */
LW_API void lw_boundary3_wrench(lw_boundary3 *boundary, const double *twist, double *wrench,
                                double *response);

/* Write the forces on the fluid for these twists to the force array of the lattice, and which rows have any. */
LW_API void lw_boundary3_act(lw_boundary3 *boundary, lw_lattice3 *lattice, const double *twist);

/* The largest velocity of the fluid through a surface, in the middle of its patches, under these forces
 * [cells/step]. */
LW_API double lw_boundary3_leak(const lw_boundary3 *boundary, const lw_lattice3 *lattice,
                                const double *twist);

/* Set the cells and rows that lw_boundary3_act wrote to zero again. */
LW_API void lw_boundary3_clear(const lw_boundary3 *boundary, lw_lattice3 *lattice);

#endif
