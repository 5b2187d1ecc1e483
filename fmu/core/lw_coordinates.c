/* Joint coordinates q and their rates: README, section Joint coordinates. */
#include "lw_model.h"

/* dq/dt of a unit quaternion turning with w, given in the turned frame: half of q (0, w). */
static void quat_rate(const double *q, const double *w, double *rate) {
    lw_quat product = lw_quat_mul(lw_load4(q), lw_quat_of(0.0, w[0], w[1], w[2]));
    lw_store4(rate, lw_quat_of(0.5 * product.w, 0.5 * product.x, 0.5 * product.y, 0.5 * product.z));
}

void lw_coordinate_rate(const lw_multibody *mb, const double *q, const double *v, double *rate) {
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        if (l->type == LW_SPHERICAL) {
            quat_rate(q + l->q, v + l->v, rate + l->q);
        } else if (l->type == LW_FREE) {
            lw_store3(rate + l->q, lw_load3(v + l->v));
            quat_rate(q + l->q + 3, v + l->v + 3, rate + l->q + 3);
        } else {
            for (int k = 0; k < l->freedoms; ++k) rate[l->q + k] = v[l->v + k];
        }
    }
}

void lw_coordinate_normalise(const lw_multibody *mb, double *q) {
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        if (l->type != LW_SPHERICAL && l->type != LW_FREE) continue;
        double *quat = q + l->q + l->translations;
        lw_store4(quat, lw_quat_unit(lw_load4(quat)));
    }
}

/* Rotation vector [rad] of a quaternion of any length, between 0 and pi. */
lw_vec3 lw_rotation_vector(lw_quat q) {
    double side = q.w < 0.0 ? -1.0 : 1.0;
    lw_vec3 part = lw_vec(side * q.x, side * q.y, side * q.z);
    double sine = lw_norm(part), cosine = side * q.w;
    if (sine < 1e-8 * cosine) return lw_scale(2.0 / cosine, part);
    return lw_scale(2.0 * atan2(sine, cosine) / sine, part);
}
