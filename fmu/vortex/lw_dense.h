/* Dense systems of hundreds of linear equations: lw_factor of core/lw_linear.h in blocks, with its very bits. */
#ifndef LW_DENSE_H
#define LW_DENSE_H

#include "lw_instructions.h"

/* Replace a (m,m), row-major, by the factors of lw_factor, which lw_substitute takes. Returns 0, or 1 if it is
 * singular. */
int lw_factor_dense(int m, double *a, double *pivots, lw_instructions instructions);

#endif
