/* The wakes behind the trailing edges; for the files of this folder. */
#ifndef LW_WAKE_H
#define LW_WAKE_H

#include "lw_vortex.h"

/* Write the filaments of the wakes, from the trailing edges as they are placed; return their count. */
int32_t lw_wake_filaments(const lw_vortex *vortex, lw_filament *filaments);

/* Shed a row of rings at the time t, and carry the wakes on for a step. Returns 0, or 1 + the first corner of the
 * wakes that stays where it is, because the wind there is not finite. */
int lw_wake_go(lw_vortex *vortex, double t);

#endif
