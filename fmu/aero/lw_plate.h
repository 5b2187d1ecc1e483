/* Quasi-steady forces on thin flat plates; the equations are in fmu/README.md, "Force models".
 *
 * A plate's chord lies along body x, its span along body z, its normal along body y, its centre at the
 * centre of mass. Its span is cut into equal strips, each of which meets the air with the velocity of its own
 * centre. The strips of a wing have chords and centres of their own, anywhere in the body's x, z plane.
 */
#ifndef LW_PLATE_H
#define LW_PLATE_H

#include <stdint.h>

#include "lw_forces.h"
#include "lw_wind.h"

enum { LW_PLATE_RISTROPH = 0, LW_PLATE_ANDERSEN = 1, LW_PLATE_TABLE = 2 };

typedef struct {
    int n;                /* plates */
    int coefficients;     /* LW_PLATE_... */
    int strips;           /* of each plate, 1 or more */
    int curve_size;       /* numbers in each of the curves; 0 without a table */
    const int32_t *body;  /* (n) the plate's index among all bodies */
    const double *size;   /* (n, 2) chord, of a wing the mean one, and span [m] */
    const double *planform; /* (n, strips, 3) of each strip: chord and x of its centre over the mean chord, and by
                               how much z of it, over the span, is more than that of a plate's strip, whose row is
                               1, 0, 0; NULL where all are plates */
    const double *curves; /* (3, curve_size) of a table: lift, drag and moment about the middle of the chord,
                             nose up, over the angle of attack -pi ... pi [rad], as lw_curve reads them */
    double density;       /* of the fluid [kg/m^3] */
    lw_wind wind;
} lw_plates;

/* Of a plate: added mass along the normal, m = pi rho (c/2)^2 s [kg], and added inertia about the chord, that of m
 * in the centres of the strips, m s^2 (1 - 1/n^2) / 12, and about the span, m (c/2)^2 / 8 [kg m^2]. */
typedef struct { double normal, chord, span; } lw_added_mass;

LW_API lw_added_mass lw_plate_added_mass(double density, double chord, double span, int strips);

/* Write the wrench on every plate, without the part that is proportional to its acceleration, and that
 * part as added inertia (constant). Returns 0, or 1 + the index of the first plate whose wrench is not
 * finite. */
LW_API int lw_plates_evaluate(const lw_plates *plates, double t, const lw_motion *motion,
                              const lw_wrench *wrench);

/* Of a plate whose wrench is not finite, why: 1 + the component of the wind that is not where it meets the plate, and
 * position [m] and velocity [m/s] there, place (6); 0 if it is not for the wind. */
LW_API int lw_plates_wind_fault(const lw_plates *plates, int i, double t, const lw_motion *motion, double *place);

#endif
