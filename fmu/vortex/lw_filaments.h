/* What straight vortex filaments do to the fluid at points: Biot-Savart's law with a core.
 *
 *   u = gamma / (4 pi) (|r1| + |r2|) r1 x r2 / (|r1| |r2| (|r1| |r2| + r1 . r2) + core^2 l^2)
 *
 * r1 and r2 lead from the ends a and b of the filament, of length l, to the point; gamma turns the fluid
 * right-handed about b - a. With core = 0 it is exact; with one u goes to 0 on the filament.
 *
 * A. van Garrel, Development of a wind turbine aerodynamics simulation module, ECN-C--03-079 (2003).
 */
#ifndef LW_FILAMENTS_H
#define LW_FILAMENTS_H

#include <stdint.h>

#include "lw_instructions.h"
#include "lw_threads.h"

enum { LW_LANES = 8 }; /* points are handled in groups of so many */

typedef struct { double a[3], b[3], strength, core; } lw_filament; /* [m], [m], [m^2/s], [m] */

/* Points and the velocity at each, one array an axis, of a length that LW_LANES divides; and who works on them. */
typedef struct {
    double *at[3], *velocity[3];
    int32_t count;
    lw_instructions instructions; /* of this processor */
    lw_threads *threads;          /* NULL: the caller alone */
} lw_points;

/* Add what `count` filaments do, one after the other, to the velocity of all points. The result has the same
 * bits for any number of threads and any set of instructions. */
void lw_filaments_add(const lw_filament *filaments, int32_t count, const lw_points *points);

/* The smallest number of points that LW_LANES divides and `count` fit in. */
int32_t lw_lanes(int32_t count);

#endif
