/* What a force does to a free body with its added inertia: the inverse of a symmetric 6x6 matrix. */
#include "lw_constraints.h"

static const double pivot_tolerance = 1.5e-14; /* of a diagonal element: less is round-off */
static const lw_mat3 none = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};

int lw_inverse_sym3(lw_sym3 s, lw_sym3 *inverse) {
    double xx = s.yy * s.zz - s.yz * s.yz, yy = s.xx * s.zz - s.xz * s.xz, zz = s.xx * s.yy - s.xy * s.xy;
    double xy = s.xz * s.yz - s.xy * s.zz, xz = s.xy * s.yz - s.xz * s.yy, yz = s.xy * s.xz - s.yz * s.xx;
    double determinant = s.xx * xx + s.xy * xy + s.xz * xz;
    if (!(s.xx > 0.0 && zz > pivot_tolerance * s.xx * s.yy && determinant > pivot_tolerance * zz * s.zz)) return 0;
    double f = 1.0 / determinant;
    lw_sym3 result = {f * xx, f * yy, f * zz, f * xy, f * xz, f * yz};
    *inverse = result;
    return 1;
}

static lw_mat3 full(lw_sym3 s) {
    lw_mat3 m = {s.xx, s.xy, s.xz, s.xy, s.yy, s.yz, s.xz, s.yz, s.zz};
    return m;
}

static lw_sym3 sum(lw_sym3 a, lw_sym3 b) {
    lw_sym3 s = {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
    return s;
}

static lw_sym3 negative(lw_sym3 a) {
    lw_sym3 s = {-a.xx, -a.yy, -a.zz, -a.xy, -a.xz, -a.yz};
    return s;
}

/* Inverse of [[m, h], [hT, j]] by its Schur complement, in the body frame. */
static int invert(const lw_inertia6 *i, lw_inertia6 *inverse) {
    lw_sym3 p, q;
    if (!lw_inverse_sym3(i->m, &p)) return 0;
    lw_mat3 ph = lw_mat_mul(full(p), i->h), ht = lw_mat_transpose(i->h);
    if (!lw_inverse_sym3(sum(i->j, negative(lw_mat_mul_t_sym(ht, lw_mat_transpose(ph)))), &q)) return 0;
    lw_mat3 phq = lw_mat_mul(ph, full(q));
    lw_mat3 h = {-phq.xx, -phq.xy, -phq.xz, -phq.yx, -phq.yy, -phq.yz, -phq.zx, -phq.zy, -phq.zz};
    inverse->m = sum(p, lw_mat_mul_t_sym(phq, ph));
    inverse->j = q;
    inverse->h = h;
    return 1;
}

static int with_added(const lw_link *l, lw_inertia6 *inverse) {
    const double *a = l->added;
    lw_inertia6 body = {{a[0] + l->mass, a[7] + l->mass, a[14] + l->mass, a[1], a[2], a[8]},
                        {a[21], a[28], a[35], a[22], a[23], a[29]},
                        {a[3], a[4], a[5], a[9], a[10], a[11], a[15], a[16], a[17]}};
    lw_inertia6 found;
    body.j = sum(body.j, l->inertia);
    if (!invert(&body, &found)) return 0;
    inverse->m = lw_rotate_sym(l->rotation, found.m);
    inverse->j = lw_rotate_sym(l->rotation, found.j);
    inverse->h = lw_mat_mul(lw_mat_mul(l->rotation, found.h), lw_mat_transpose(l->rotation));
    return 1;
}

int lw_inverse_inertias(lw_maximal *m, const lw_multibody *mb, lw_fault *fault) {
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *l = &mb->link[i];
        fault->item = l->body;
        if (l->added) {
            if (!with_added(l, &m->inverse[i])) return LW_SINGULAR;
            continue;
        }
        if (!(l->mass > 0.0 && m->inverse_inertia[i].xx > 0.0)) return LW_SINGULAR;
        double f = 1.0 / l->mass;
        lw_inertia6 own = {{f, f, f, 0.0, 0.0, 0.0}, lw_rotate_sym(l->rotation, m->inverse_inertia[i]), none};
        m->inverse[i] = own;
    }
    return LW_OK;
}
