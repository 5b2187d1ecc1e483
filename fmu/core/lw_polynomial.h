/* A vector that varies in time as the Lagrange polynomial through samples. */
#ifndef LW_POLYNOMIAL_H
#define LW_POLYNOMIAL_H

#define LW_MAX_NODES 8

typedef struct {
    int count;
    double node[LW_MAX_NODES];
    double scale[LW_MAX_NODES]; /* 1 / product of (node - other node) */
} lw_polynomial;

/* Prepare `count` distinct nodes. Returns 0 for a good set, 1 for a bad count, a node that is not finite
 * or two equal nodes. */
int lw_polynomial_init(lw_polynomial *polynomial, int count, const double *nodes);

/* Write the value at `s` of `size` quantities, sampled as `samples[node][quantity]`. A node gives back
 * its sample exactly. */
void lw_polynomial_value(const lw_polynomial *polynomial, double s, int size, const double *samples,
                         double *value);

#endif
