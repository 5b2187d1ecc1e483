/* The surfaces where the bodies are: corners, filaments, targets; for the files of this folder. */
#ifndef LW_SURFACE_H
#define LW_SURFACE_H

#include <stddef.h>

#include "lw_vortex.h"

/* Cores of the surfaces' filaments, of those of the wakes: small, but a point on a filament stays at rest. */
#define LW_SHEET 0.01

/* A filament of the bodies between the corners `from` and `to` of one surface: the ring that runs along it, and
 * the one that runs against it; -1 for none. */
typedef struct { int32_t surface, from, to, with, against; } lw_bearer;

/* Of one surface: rings, corners, filaments along the span and all that bear force; targets and components of the
 * twists of all surfaces. */
typedef struct { int32_t rings, corners, spanwise, bearers, targets, columns; } lw_sizes;

lw_sizes lw_sizes_of(const lw_vortex *vortex);

/* Filament k of a surface, those that bear force first, along the span, then along the chord; then those of the
 * trailing edge. */
lw_bearer lw_filament_of(const lw_vortex *vortex, int32_t surface, int32_t k);

/* Put the corners of the surfaces where the bodies are, pose (n, 7). */
void lw_vortex_place(lw_vortex *vortex, const double *pose);

/* Area vectors of the rings, and the targets: collocation points and middles of what bears force. */
lw_points lw_place_targets(lw_vortex *vortex, const double *pose);

/* Write the filaments of the surfaces as they are placed, with these strengths of the rings; return their count. */
int32_t lw_vortex_bound(const lw_vortex *vortex, const double *strength, lw_filament *filaments);

/* Room for so many points, at rest. */
lw_points lw_vortex_room(const lw_vortex *vortex, int32_t count);

LW_INLINE void lw_fill(double *values, size_t count) {
    for (size_t k = 0; k < count; ++k) values[k] = 0.0;
}

LW_INLINE void lw_put(const lw_points *points, int32_t k, lw_vec3 r) {
    points->at[0][k] = r.x, points->at[1][k] = r.y, points->at[2][k] = r.z;
}

LW_INLINE lw_vec3 lw_at(double *const axes[3], int32_t k) { return lw_vec(axes[0][k], axes[1][k], axes[2][k]); }

LW_INLINE double lw_net(const double *strength, const lw_bearer *b) {
    return (b->with < 0 ? 0.0 : strength[b->with]) - (b->against < 0 ? 0.0 : strength[b->against]);
}

#endif
