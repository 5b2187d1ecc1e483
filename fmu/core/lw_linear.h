/* Small dense systems of linear equations. */
#ifndef LW_LINEAR_H
#define LW_LINEAR_H

/* Replace a (m,m), row-major, by the factors L U of its rows exchanged: row k with row pivots[k]. Returns 0, or
 * LW_NOT_CONVERGED if it is singular. */
int lw_factor(int m, double *a, double *pivots);

/* Solve a x = b with these factors; x replaces b. */
void lw_substitute(int m, const double *factors, const double *pivots, double *b);

#endif
