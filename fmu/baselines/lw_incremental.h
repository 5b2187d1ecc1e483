/* The equations of S. M. Rahmati, A. Karimi, Appl. Sci. 11 (2021) 1136, Eqs. 6-9, for any number of links: bodies
 * in the plane, free or hinged to one another. The equations are in fmu/README.md, section Baselines. */
#ifndef LW_INCREMENTAL_H
#define LW_INCREMENTAL_H

#include "lw_multibody.h"

/* Bytes that they need; 8-byte alignment. */
LW_API size_t lw_incremental_size(const lw_multibody *multibody);

/* Let these equations give the accelerations. Returns -1, or a body that they do not describe: one whose joint is
 * neither a hinge about z to another body nor, at its COM, a planar one to the world, or has a spring or damper.
 * `memory` must live as long as the mechanism. */
LW_API int32_t lw_incremental_attach(void *memory, lw_multibody *multibody);

#endif
