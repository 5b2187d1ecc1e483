/* A fluid on a window of a lattice: D2Q9, collision in central moments, populations less their weights.
 *
 * Lattice units: a cell is 1 wide, a step takes 1, the density is 1 at rest. Directions, in the order of the
 * planes: rest; +x, +y, -x, -y; (+x, +y), (-x, +y), (-x, -y), (+x, -y). The window is surrounded by the
 * undisturbed stream: the outermost ring of cells is set to it, and `fringe` layers relax towards it.
 *
 * Equations and sources: fmu/README.md, "Flow on a lattice".
 */
#ifndef LW_LATTICE_H
#define LW_LATTICE_H

#include <stdint.h>

#include "lw_instructions.h"
#include "lw_threads.h"

enum {
    LW_DIRECTIONS = 9,
    LW_APART = 3,         /* rows between the places of the populations in the same memory */
    LW_PLANE_PADDING = 16 /* floats behind the cells of a plane that may be read, never used */
};

/* Arrays are row-major: cell (i, j) of a plane is at [j * nx + i], x along i, y along j. */
typedef struct {
    int32_t nx, ny;                 /* cells */
    int32_t fringe;                 /* layers on every side that relax towards the stream; layer k of them, 0
                                       the outermost, by 0.3 ((fringe - k) / fringe)^3 in a step */
    int32_t force_begin, force_end; /* the rows of `force` that are read; the others count as zero */
    float shear_rate;               /* omega = 1 / (3 nu + 1/2), nu the kinematic viscosity [cells^2/step] */
    float stream[2];                /* velocity of the undisturbed fluid [cells/step] */
    int64_t plane;                  /* floats from one plane of populations to the next, at least
                                       nx ny + LW_PLANE_PADDING, in the same memory LW_APART rows more */
    float *populations, *next;      /* (9, ny, nx), planes `plane` apart: after the collision, less the weight
                                       of the direction; exchanged by a step. One is LW_APART rows behind the
                                       other, which moves a third less through the memory; or each has its
                                       own, which threads need */
    const float *force;             /* (2, ny, nx) force on the fluid of each cell, x and y, in this step */
    float *blend;                   /* (nx) by how much each column relaxes; written by lw_lattice_init */
    lw_threads *threads;            /* NULL: the caller alone, row after row */
    int32_t instructions;           /* lw_instructions of this processor; written by lw_lattice_init */
} lw_lattice;

/* Fill everything with the stream, and `blend` and `instructions`. */
LW_API void lw_lattice_init(lw_lattice *lattice);

/* Go on by one step: move the window by whole cells, stream, add the force, collide, relax the fringe.
 * Cell (i, j) of the new window is (i + shift_x, j + shift_y) of the old one, to which the force belongs;
 * cells whose neighbours were not in the old window get the stream. A shift, by -1, 0 or 1 cells along each
 * axis, costs no time. The result has the same bits for any number of threads and any set of instructions. */
LW_API void lw_lattice_step(lw_lattice *lattice, int32_t shift_x, int32_t shift_y);

/* Write means over blocks of stride x stride cells: velocity (2, ny / stride, nx / stride), which is momentum
 * over mass, and density less 1 (ny / stride, nx / stride). Rows and columns that fill no block are left out.
 * It is the state after the collision: where a force acts, half of it is too much in the velocity. */
LW_API void lw_lattice_moments(const lw_lattice *lattice, int32_t stride, float *velocity, float *density);

/* Halve the time of a step, the cells stay as they are: velocities (and the stream) become half, what the
 * density differs from 1 a fourth, and the second moments are such that the stress in physical units stays.
 * `shear_rate` is the new one, 4 omega / (2 + omega) where the viscosity stays in physical units. Where
 * a force acted in the last step, half of it is in the velocity and is treated like the rest.
 * Returns 0, or 1 and changes nothing if the old rate is 1: there the populations hold no stress. */
LW_API int lw_lattice_halve_step(lw_lattice *lattice, float shear_rate);

/* The populations of the stream, less the weights. */
void lw_lattice_stream(const lw_lattice *lattice, float populations[LW_DIRECTIONS]);

/* By how much the layer at `distance` from the border relaxes in a step. */
float lw_lattice_blend(const lw_lattice *lattice, int32_t distance);

#endif
