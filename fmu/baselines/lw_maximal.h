/* The constraint force equation: bodies that are all free, and joints that are forces between them. The
 * equations are in fmu/README.md, section Baselines.
 *
 * The bodies are a mechanism of their own, `bodies`: a free joint to the world at the COM of each, in the order
 * of the tree, coordinates of body i from 7 i on in q and 6 i on in v, and then in q one number for each
 * revolute and planar joint of the tree, its angle. Everything else of lw_multibody.h serves it as it is.
 */
#ifndef LW_MAXIMAL_H
#define LW_MAXIMAL_H

#include "lw_multibody.h"

typedef enum { LW_UNSTABILISED, LW_BAUMGARTE, LW_PROJECTION } lw_stabilisation;

/* Bytes that the joints need; 8-byte alignment. */
LW_API size_t lw_maximal_size(const lw_multibody *tree);

/* Join the bodies as those of `tree` are; `tree` and `memory` must live as long as they. `time` [s] is in which
 * Baumgarte's method undoes a violation. */
LW_API void lw_maximal_attach(void *memory, lw_multibody *bodies, lw_multibody *tree, int32_t stabilisation,
                              double time);

/* Force and torque (closures,6) of what closes loops, after the last evaluation: of the first on the second body
 * at the point on the second. */
void lw_maximal_closure_reactions(const lw_multibody *bodies, double *reaction);

/* The state of the bodies (nq + nv + 1) that a state of the tree means. */
LW_API void lw_maximal_start(lw_multibody *bodies, const double *tree_state, double *state);

/* The tree's coordinates q and v, as they follow from the poses and twists of the bodies. */
LW_API void lw_maximal_coordinates(lw_multibody *bodies, const double *state, lw_unaligned *q,
                                   lw_unaligned *v);

#endif
