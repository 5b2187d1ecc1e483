/* What every force model of fmu/aero reads and writes.
 *
 * All arrays lie body by body, in world coordinates W at the centres of mass, SI units. A model owns
 * a subset of the bodies: it reads the motion of all of them and writes its own, in its own order. */
#ifndef LW_FORCES_H
#define LW_FORCES_H

#include "lw_math.h"

typedef struct {
    const lw_unaligned *position;    /* (bodies, 3) [m] */
    const lw_unaligned *orientation; /* (bodies, 4) unit quaternion (w, x, y, z), body to world */
    const lw_unaligned *linear;      /* (bodies, 3) [m/s] */
    const lw_unaligned *angular;     /* (bodies, 3) [rad/s] */
} lw_motion;

typedef struct {
    lw_unaligned *force;         /* (n, 3) [N] */
    lw_unaligned *torque;        /* (n, 3) [N m] */
    lw_unaligned *added_inertia; /* (n, 6, 6) body frame, force rows first; NULL where it is not wanted */
} lw_wrench;

#endif
