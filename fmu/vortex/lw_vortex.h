/* Thin lifting surfaces that shed free wakes: the unsteady vortex lattice method, in three dimensions.
 *
 * A surface is a grid of vortex rings that moves with its body, in front of its first column of corners the
 * leading edge, behind its last row the trailing edge, where a row of rings is shed each step. Rings are
 * right-handed about their area vector; corners run along the chord (i), then the span (j). Their strengths
 * are such that no fluid passes the collocation points.
 *
 * The order of calls: evaluate for the trial state at the end of a step, as often as wanted, then commit with
 * the state that was accepted there, which sheds and carries the wake to the end of the next step.
 *
 * Equations and sources: fmu/README.md, "Vortex lattice".
 */
#ifndef LW_VORTEX_H
#define LW_VORTEX_H

#include "lw_filaments.h"
#include "lw_wind.h"

/* Arrays are row-major. n surfaces, one a body, of c x s rings and (c + 1) x (s + 1) corners. */
typedef struct {
    int32_t surfaces, chordwise, spanwise; /* n, c, s */
    int32_t capacity;                      /* rows of wake rings that are kept at most */
    int32_t instructions;                  /* lw_instructions; written by lw_vortex_init */
    double density, step, core;            /* [kg/m^3]; h [s]; radius of the wakes' cores [m] */
    double suction;                        /* share of the pull along the chord, at leading edges, that is there */
    lw_wind wind;
    const double *corner;  /* (n, c + 1, s + 1, 3) in the frame of the body [m] */
    const double *control; /* (n, c, s, 3) collocation points, likewise */
    lw_threads *threads;   /* NULL: the caller alone */

    /* What is remembered, as it was committed, at the time t. */
    int32_t started, rows; /* 0 before the first commit; rows of wake rings */
    double *strength;    /* (n, c, s) of the rings on the bodies [m^2/s] */
    double *steady;      /* (n, 6) wrench without what the change of strengths adds [N, N m] */
    double *wake;        /* (capacity, n, s + 1, 3) where the corners of the wakes are at t + h, behind the edges */
    double *wake_rings;  /* (capacity, n, s) strengths, the first row between the edge and wake[0] */

    /* The trial. */
    double *trial_twist;     /* (n, 6) */
    double *trial_strength;  /* (n, c, s) */
    double *trial_steady;    /* (n, 6) */
    double *by_twist;        /* (6 n, n c s) derivative of trial_strength by each component */
    double *steady_by_twist; /* (6 n, 6 n) of trial_steady, likewise */

    /* Room to work in. */
    double *placed, *normal;  /* (n, c + 1, s + 1, 3) corners in W; (n, c, s, 3) area vectors [m^2] */
    double *edge;             /* (n, s + 1, 3) the trailing edges themselves, in W */
    lw_filament *filaments;   /* of all bodies, then of all wakes: lw_vortex_filaments of them */
    double *points;           /* (6, lw_vortex_points): where, and the velocity there, an axis after the other */
    double *influence;        /* (n c s, 3, lw_vortex_targets): velocity by each ring, an axis after the other */
    double *matrix, *pivots;  /* (n c s, n c s); (n c s) */
    double *change;           /* (3, lw_vortex_targets) by a component of the twist: velocity at the targets */
    double *gained;           /* (n c s) strengths in a step */
    double *pressed, *row;    /* (6 n) wrench by that, and a column of the response */
} lw_vortex;

/* Before everything else. */
LW_API void lw_vortex_init(lw_vortex *vortex);

/* How long the working arrays are. Targets: collocation points, then the middles of filaments that bear force. */
LW_API int32_t lw_vortex_filaments(const lw_vortex *vortex);
LW_API int32_t lw_vortex_points(const lw_vortex *vortex);
LW_API int32_t lw_vortex_targets(const lw_vortex *vortex);

/* The mean wrench (n, 6) over the step that ends at the time t in the trial state, in W at the centres of
 * mass, and minus its derivative by the twists at the end, response (6 n, 6 n). At the first time of all it
 * is the wrench at that time. pose (n, 7): position and quaternion; twist (n, 6).
 * Returns 0, or 1 if no strengths of the rings fulfil the condition. */
LW_API int lw_vortex_evaluate(lw_vortex *vortex, double t, const double *pose, const double *twist,
                              double *wrench, double *response);

/* Take the state that was accepted at the time t that was evaluated last. Returns 0, or 1 + the first corner of the
 * wakes that stays where it is, because the wind there is not finite. */
LW_API int lw_vortex_commit(lw_vortex *vortex, double t, const double *pose, const double *twist);

/* The velocity of the fluid (count, 3) at points (count, 3) [m] at the time t, by bodies and wakes as they are
 * after an evaluation, and by the wind. */
LW_API void lw_vortex_velocity(lw_vortex *vortex, double t, int32_t count, const double *point,
                               double *velocity);

#endif
