/* The wakes behind the trailing edges, and what they need of the surfaces; for the files of this folder. */
#ifndef LW_WAKE_H
#define LW_WAKE_H

#include "lw_vortex.h"

/* Cores of the surfaces' filaments, of those of the wakes: small, but a point on a filament stays at rest. */
#define LW_SHEET 0.01

/* Put the corners of the surfaces where the bodies are, pose (n, 7). */
void lw_vortex_place(lw_vortex *vortex, const double *pose);

/* Write the filaments of the surfaces as they are placed, with these strengths of the rings; return their count. */
int32_t lw_vortex_bound(const lw_vortex *vortex, const double *strength, lw_filament *filaments);

/* Room for so many points, at rest. */
lw_points lw_vortex_room(const lw_vortex *vortex, int32_t count);

/* Write the filaments of the wakes, from the trailing edges as they are placed; return their count. */
int32_t lw_wake_filaments(const lw_vortex *vortex, lw_filament *filaments);

/* Shed a row of rings at the time t, and carry the wakes on for a step. */
void lw_wake_go(lw_vortex *vortex, double t);

#endif
