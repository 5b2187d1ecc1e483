/* Rigid bodies in a fluid on a lattice: markers at which the fluid moves with the body, exactly.
 *
 * Every marker pushes the fluid of the 3 x 3 cells around it, all of them so that the velocity interpolated at
 * every marker is the body's at the end of the step. The forces are linear in the velocities, so that the wrench on
 * the bodies is affine in their twists. Lattice units; twists and wrenches are planar: (x, y, about z).
 *
 * Equations and sources: fmu/README.md, "Bodies in the flow".
 */
#ifndef LW_BOUNDARY_H
#define LW_BOUNDARY_H

#include "lw_lattice.h"

enum { LW_STENCIL = 9 };

typedef enum {
    LW_PLACED = 0,
    LW_OUTSIDE, /* a marker is in the fringe or beyond the window */
    LW_OVERLAP  /* markers of bodies without a joint between them coincide, or nearly so */
} lw_placement;

typedef struct {
    int32_t bodies, count;
    const int32_t *body;  /* (count,2) the bodies that carry a marker; the second is -1, or shares it: a hinge */
    const int32_t *next;  /* (count) marker beside it on the same outline, -1 for none */
    const double *point;  /* (count,2,2) place in the frame of each of the two bodies [cells] */
    const int32_t *joined; /* (bodies,bodies) whether two bodies may touch, for there is a joint between them */
    /* written by lw_boundary_place */
    double *arm;          /* (count,2,2) from the centre of mass of each body, in world axes [cells] */
    double *at;           /* (count,2) in the window [cells]: the centre of cell (i, j) is at (i, j) */
    int32_t *cell;        /* (count,2) of the middle of the 3 x 3 cells */
    double *weight;       /* (count,9) of these cells */
    double *lightness;    /* (count,9) 1 / (2 density) of the fluid there */
    double *velocity;     /* (count,2) of the fluid at the marker at the end of the step, without force */
    int32_t *first;       /* (count) column at which a row of the factor begins */
    double *factor;       /* (count,count) Cholesky factor of the mobility, between `first` and the diagonal */
    double *solution;     /* (count, 6 bodies + 2) */
} lw_boundary;

/* Put the bodies to `pose` (bodies,4), x, y of the centre of mass in the window [cells], cosine and sine of the
 * angle, and factorise. Returns an lw_placement; `marker` is the one that it is about. */
LW_API int lw_boundary_place(lw_boundary *boundary, const lw_lattice *lattice, const double *pose,
                             int32_t *marker);

/* The wrench (bodies,3) on the bodies over the coming step if they have the twists (bodies,3) at its end, and minus
 * its derivative by the twists, `response` (3 bodies, 3 bodies). */
LW_API void lw_boundary_wrench(lw_boundary *boundary, const double *twist, double *wrench, double *response);

/* Write the forces on the fluid for these twists to the force array of the lattice, and which rows have any. */
LW_API void lw_boundary_act(lw_boundary *boundary, lw_lattice *lattice, float *force, const double *twist);

/* The largest velocity of the fluid through an outline, halfway between two markers, under these forces
 * [cells/step]. */
LW_API double lw_boundary_leak(const lw_boundary *boundary, const lw_lattice *lattice, const float *force,
                               const double *twist);

/* Set the cells that lw_boundary_act wrote to zero again. */
LW_API void lw_boundary_clear(const lw_boundary *boundary, lw_lattice *lattice, float *force);

#endif
