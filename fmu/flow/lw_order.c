#include "lw_order.h"

#include <stdlib.h>

#include "lw_math.h"

enum { SQUARINGS = 6 };

/* An axis along which a matrix of second moments is largest: of its 64th power any column is one. */
static lw_vec3 longest(lw_mat3 m) {
    for (int k = 0; k < SQUARINGS; ++k) {
        const double trace = m.xx + m.yy + m.zz, scale = trace > 0.0 ? 1.0 / trace : 0.0;
        double *of = &m.xx;
        for (int i = 0; i < 9; ++i) of[i] *= scale;
        m = lw_mat_mul(m, m);
    }
    const lw_vec3 columns[3] = {lw_column_x(m), lw_column_y(m), lw_column_z(m)};
    lw_vec3 axis = columns[0];
    for (int i = 1; i < 3; ++i)
        if (lw_dot(columns[i], columns[i]) > lw_dot(axis, axis)) axis = columns[i];
    const double length = lw_norm(axis);
    return length > 0.0 ? lw_scale(1.0 / length, axis) : lw_vec(1.0, 0.0, 0.0);
}

/* The part of a matrix of moments that is across an axis. */
static lw_mat3 across(lw_mat3 m, lw_vec3 a) {
    const lw_mat3 rest = {1.0 - a.x * a.x, -a.x * a.y, -a.x * a.z, -a.x * a.y, 1.0 - a.y * a.y,
                          -a.y * a.z, -a.x * a.z, -a.y * a.z, 1.0 - a.z * a.z};
    return lw_mat_mul(rest, lw_mat_mul(m, rest));
}

static int by_key(const void *a, const void *b) {
    const lw_ordered *one = a, *other = b;
    if (one->key != other->key) return one->key < other->key ? -1 : 1;
    return one->point < other->point ? -1 : 1;
}

void lw_order(int32_t count, const double *points, lw_ordered *order) {
    lw_vec3 mean = {0.0, 0.0, 0.0};
    lw_mat3 m = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    for (int32_t k = 0; k < count; ++k) mean = lw_add(mean, lw_scale(1.0 / count, lw_load3(points + 3 * k)));
    for (int32_t k = 0; k < count; ++k) {
        const lw_vec3 p = lw_sub(lw_load3(points + 3 * k), mean);
        m.xx += p.x * p.x, m.xy += p.x * p.y, m.xz += p.x * p.z;
        m.yy += p.y * p.y, m.yz += p.y * p.z, m.zz += p.z * p.z;
    }
    m.yx = m.xy, m.zx = m.xz, m.zy = m.yz;
    const lw_vec3 first = longest(m);
    const lw_mat3 rest = across(m, first);
    const lw_vec3 second = longest(rest);
    /* Of a row as wide as these moments say, the keys are less than a cell apart. */
    const double width = sqrt(12.0 * lw_dot(second, lw_mat_vec(rest, second)) / count) + 1.0;
    const lw_vec3 along = lw_add(first, lw_scale(1.0 / width, second));
    for (int32_t k = 0; k < count; ++k) {
        order[k].key = lw_dot(along, lw_sub(lw_load3(points + 3 * k), mean));
        order[k].point = k;
    }
    qsort(order, (size_t)count, sizeof *order, by_key);
}
