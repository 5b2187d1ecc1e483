/* What the fluid at the markers in space lacks, and the matrix of their mobility, factorised. */
#ifndef LW_MOBILITY3_H
#define LW_MOBILITY3_H

#include "lw_boundary3.h"

/* Fill what lw_boundary3_place writes, from `weight` on, for markers that are located. Returns an lw_placement;
 * `marker` is the one that it is about. */
int lw_mobility3(lw_boundary3 *boundary, const lw_lattice3 *lattice, int32_t *marker);

#endif
