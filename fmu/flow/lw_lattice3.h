/* A fluid on a window of a lattice in space: D3Q19, collision in central moments, populations less their weights.
 *
 * Lattice units: a cell is 1 wide, a step takes 1, the density is 1 at rest. Directions, in the order of the
 * volumes: rest; +x, -x, +y, -y, +z, -z; in the plane of x and y (+,+), (-,-), (+,-), (-,+), then in that of x and
 * z, then of y and z. The window is surrounded by the undisturbed stream: the outermost layer of cells is set to
 * it, and `fringe` layers relax towards it.
 *
 * Equations and sources: fmu/README.md, "Flow in space".
 */
#ifndef LW_LATTICE3_H
#define LW_LATTICE3_H

#include <stdint.h>

#include "lw_instructions.h"
#include "lw_threads.h"

enum {
    LW_DIRECTIONS3 = 19,
    LW_VOLUME_PADDING = 16 /* floats behind the cells of a volume that may be read, never used */
};

/* Cell (i, j, k) of a volume is at [(k * ny + j) * nx + i], x along i, y along j, z along k. */
typedef struct {
    int32_t nx, ny, nz;         /* cells */
    int32_t fringe;             /* layers on every side that relax towards the stream; layer k of them, 0 the
                                   outermost, by 0.3 ((fringe - k) / fringe)^3 in a step */
    float shear_rate;           /* omega = 1 / (3 nu + 1/2), nu the kinematic viscosity [cells^2/step] */
    float stream[3];            /* velocity of the undisturbed fluid [cells/step] */
    int64_t volume;             /* floats from one volume of populations to the next, at least
                                   nx ny nz + LW_VOLUME_PADDING, in the same memory 2 ny + 3 rows more */
    float *populations, *next;  /* (19, nz, ny, nx), volumes `volume` apart: after the collision, less the weight
                                   of the direction; exchanged by a step. One is 2 ny + 3 rows behind the other,
                                   which moves a third less through the memory; or each has its own, which
                                   threads need */
    float *force;               /* (3, nz, ny, nx) force on the fluid of each cell, x, y and z, in this step */
    uint8_t *forced;            /* (nz, ny) whether a row of `force` is read; the others count as zero */
    float *blend;               /* (nx) by how much each column relaxes; written by lw_lattice3_init */
    lw_threads *threads;        /* NULL: the caller alone */
    int32_t instructions;       /* lw_instructions of this processor; written by lw_lattice3_init */
} lw_lattice3;

/* Fill everything with the stream, and `blend` and `instructions`. */
LW_API void lw_lattice3_init(lw_lattice3 *lattice);

/* Go on by one step: move the window by -1, 0 or 1 cells along each axis, stream, add the force, collide, relax the
 * fringe. Cell (i, j, k) of the new window is (i, j, k) + shift of the old one, to which the force belongs; cells
 * whose neighbours were not in the old window get the stream. The result has the same bits for any number of
 * threads and any set of instructions. */
LW_API void lw_lattice3_step(lw_lattice3 *lattice, const int32_t shift[3]);

/* Write means over blocks of stride^3 cells: velocity (3, nz / stride, ny / stride, nx / stride), which is momentum
 * over mass, and density less 1 (nz / stride, ny / stride, nx / stride). What fills no block is left out. It is the
 * state after the collision: where a force acts, half of it is too much in the velocity. */
LW_API void lw_lattice3_moments(const lw_lattice3 *lattice, int32_t stride, float *velocity, float *density);

/* Halve the time of a step, as lw_lattice_halve_step does in the plane. */
LW_API int lw_lattice3_halve_step(lw_lattice3 *lattice, float shear_rate);

/* The populations of the stream, less the weights. */
void lw_lattice3_stream(const lw_lattice3 *lattice, float populations[LW_DIRECTIONS3]);

/* By how much the layer at `distance` from the border relaxes in a step. */
float lw_lattice3_blend(const lw_lattice3 *lattice, int32_t distance);

#endif
