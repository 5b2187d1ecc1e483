/* An order of points in space in which those that are near each other follow each other closely. */
#ifndef LW_ORDER_H
#define LW_ORDER_H

#include <stdint.h>

typedef struct {
    double key;
    int32_t point;
} lw_ordered;

/* Sort points (count,3) along the longest of their principal axes; those of a row across it follow each other. The
 * result, which depends on the points only, is in `order` (count). */
void lw_order(int32_t count, const double *points, lw_ordered *order);

#endif
