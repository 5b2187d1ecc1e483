/* Joints that close loops, as equations between two bodies: README, section Closures. */
#include "lw_model.h"

static const lw_vec3 zero = {0.0, 0.0, 0.0};
static const lw_mat3 identity = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};

/* ---- building ---- */

/* Links in topological order: the later one of two is no ancestor of the other. */
static void find_path(const lw_multibody *mb, lw_closure *c) {
    int32_t end[2] = {c->link[0], c->link[1]}, *next = c->path;
    for (int side = 0; side < 2; ++side) c->count[side] = 0;
    while (end[0] != end[1]) {
        int side = end[1] > end[0];
        ++c->count[side];
        end[side] = mb->link[end[side]].parent;
    }
    for (int side = 0; side < 2; ++side)
        for (int32_t k = 0, l = c->link[side]; k < c->count[side]; ++k, l = mb->link[l].parent) *next++ = l;
    for (int32_t l = end[0]; l >= 0; l = mb->link[l].parent) *next++ = l;
    c->links = (int32_t)(next - c->path);
    c->count[2] = c->links - c->count[0] - c->count[1];
}

static int share(const lw_closure *c, const lw_closure *d) {
    for (int32_t i = 0; i < c->links; ++i)
        for (int32_t j = 0; j < d->links; ++j)
            if (c->path[i] == d->path[j]) return 1;
    return 0;
}

void lw_closures_build(lw_multibody *mb, const lw_tables *t) {
    int32_t row = 0;
    for (size_t k = 0; k < (size_t)mb->rows * mb->nv; ++k) mb->spread[k] = 0.0;
    for (int32_t i = 0; i < mb->closures; ++i) {
        lw_closure *c = &mb->closure[i];
        c->kept = t->closure_rows[i];
        c->row = row;
        c->rows = 0;
        for (int bit = 0; bit < 7; ++bit) c->rows += c->kept >> bit & 1;
        row += c->rows;
        for (int side = 0; side < 2; ++side) {
            c->link[side] = lw_link_of(mb, t->closure_body[2 * i + side]);
            c->point[side] = lw_load3(t->closure_point + 6 * i + 3 * side);
            c->rotation[side] = lw_load9(t->closure_rotation + 18 * i + 9 * side);
        }
        c->length = t->closure_length[i];
        find_path(mb, c);
        int32_t envelope = c->row;
        for (int32_t j = i - 1; j >= 0; --j)
            if (share(c, &mb->closure[j])) envelope = mb->closure[j].row;
        for (int32_t k = c->row; k < row; ++k) mb->row[k].envelope = envelope;
    }
}

/* ---- equations ---- */

/* One side of a closure in W. */
typedef struct {
    lw_vec3 com, point, velocity, centripetal, angular;
    lw_mat3 frame;
} lw_side;

static lw_side locate(const lw_multibody *mb, const lw_closure *c, int side) {
    lw_side s = {zero, c->point[side], zero, zero, zero, c->rotation[side]};
    if (c->link[side] < 0) return s;
    const lw_link *l = &mb->link[c->link[side]];
    lw_vec3 arm = lw_mat_vec(l->rotation, c->point[side]), swing = lw_cross(l->velocity.angular, arm);
    s.com = l->position;
    s.point = lw_add(l->position, arm);
    s.velocity = lw_add(l->velocity.linear, swing);
    s.centripetal = lw_cross(l->velocity.angular, swing);
    s.angular = l->velocity.angular;
    s.frame = lw_mat_mul(l->rotation, c->rotation[side]);
    return s;
}

static lw_vec3 axis(lw_mat3 frame, int k) {
    return k == 0 ? lw_column_x(frame) : k == 1 ? lw_column_y(frame) : lw_column_z(frame);
}

/* A force f on b at b's point, and against it on a at the same place. */
static void pull(lw_row *r, const lw_side *a, const lw_side *b, lw_vec3 f) {
    r->on[0].linear = lw_neg(f);
    r->on[0].angular = lw_cross(f, lw_sub(b->point, a->com));
    r->on[1].linear = f;
    r->on[1].angular = lw_cross(lw_sub(b->point, b->com), f);
}

/* e . (p_b - p_a) = 0 with e fixed on a. */
static void translation(lw_row *r, const lw_side *a, const lw_side *b, lw_vec3 e) {
    lw_vec3 apart = lw_sub(b->point, a->point), rate = lw_sub(b->velocity, a->velocity);
    lw_vec3 seen = lw_sub(rate, lw_cross(a->angular, apart)); /* from a */
    lw_vec3 coriolis = lw_cross(a->angular, lw_add(rate, seen));
    pull(r, a, b, e);
    r->value = lw_dot(e, apart);
    r->rate = lw_dot(e, seen);
    r->drift = lw_dot(e, lw_sub(lw_sub(b->centripetal, a->centripetal), coriolis));
}

/* e_a . e_b = 0 with one axis fixed on each: no turning about e_b x e_a. */
static void rotation(lw_row *r, const lw_side *a, const lw_side *b, lw_vec3 ea, lw_vec3 eb) {
    lw_vec3 about = lw_cross(eb, ea), relative = lw_sub(b->angular, a->angular);
    lw_vec3 turning = lw_add(lw_cross(lw_cross(b->angular, eb), ea), lw_cross(eb, lw_cross(a->angular, ea)));
    r->on[0].linear = r->on[1].linear = zero;
    r->on[0].angular = lw_neg(about);
    r->on[1].angular = about;
    r->value = lw_dot(ea, eb);
    r->rate = lw_dot(relative, about);
    r->drift = lw_dot(relative, turning);
}

/* |p_b - p_a| = length */
static void distance(lw_row *r, const lw_side *a, const lw_side *b, double length) {
    lw_vec3 apart = lw_sub(b->point, a->point), rate = lw_sub(b->velocity, a->velocity);
    double size = lw_norm(apart);
    lw_vec3 e = lw_scale(1.0 / size, apart);
    pull(r, a, b, e);
    r->value = size - length;
    r->rate = lw_dot(e, rate);
    r->drift = lw_dot(e, lw_sub(b->centripetal, a->centripetal)) +
               (lw_dot(rate, rate) - r->rate * r->rate) / size;
}

static void forceless(lw_row *r) {
    for (int side = 0; side < 2; ++side) r->on[side].linear = r->on[side].angular = zero;
}

static void equations(const lw_multibody *mb, const lw_closure *c, lw_row *r) {
    static const int turned[3][2] = {{1, 2}, {0, 2}, {0, 1}}; /* axes on a and b that stay square */
    lw_side a = locate(mb, c, 0), b = locate(mb, c, 1);
    if (c->released) {
        for (int32_t k = 0; k < c->rows; ++k) r[k].value = r[k].rate = r[k].drift = 0.0, forceless(&r[k]);
        return;
    }
    if (c->kept == LW_DISTANCE) distance(r, &a, &b, c->length);
    if (c->kept == LW_DISTANCE) return;
    for (int k = 0; k < 3; ++k)
        if (c->kept >> k & 1) translation(r++, &a, &b, axis(a.frame, k));
    for (int k = 0; k < 3; ++k)
        if (c->kept >> (3 + k) & 1)
            rotation(r++, &a, &b, axis(a.frame, turned[k][0]), axis(b.frame, turned[k][1]));
}

void lw_closure_equations(lw_multibody *mb) {
    for (int32_t i = 0; i < mb->closures; ++i)
        equations(mb, &mb->closure[i], mb->row + mb->closure[i].row);
}

/* ---- for callers ---- */

static void add6(double *p, double s, lw_spatial f) {
    lw_store3(p, lw_add(lw_load3(p), lw_scale(s, f.linear)));
    lw_store3(p + 3, lw_add(lw_load3(p + 3), lw_scale(s, f.angular)));
}

void lw_closure_forces(const lw_multibody *mb, double *wrench, double *reaction) {
    for (int32_t i = 0; i < mb->closures; ++i) {
        const lw_closure *c = &mb->closure[i];
        lw_side b = locate(mb, c, 1);
        double *own = reaction + 6 * i, at_com[6] = {0.0};
        for (int32_t k = c->row; k < c->row + c->rows; ++k) {
            for (int side = 0; side < 2; ++side)
                if (c->link[side] >= 0)
                    add6(wrench + 6 * mb->link[c->link[side]].body, mb->multiplier[k], mb->row[k].on[side]);
            add6(at_com, mb->multiplier[k], mb->row[k].on[1]);
        }
        lw_vec3 force = lw_load3(at_com), arm = lw_sub(b.point, b.com);
        lw_store3(own, force);
        lw_store3(own + 3, lw_sub(lw_load3(at_com + 3), lw_cross(arm, force)));
    }
}

/* Pose of one side from given poses of the bodies. */
static lw_vec3 point_at(const lw_multibody *mb, const lw_closure *c, int side, const lw_unaligned *position,
                        const lw_unaligned *orientation, lw_mat3 *frame) {
    *frame = c->rotation[side];
    if (c->link[side] < 0) return c->point[side];
    int32_t body = mb->link[c->link[side]].body;
    lw_mat3 r = lw_quat_matrix(lw_load4(orientation + 4 * body));
    *frame = lw_mat_mul(r, c->rotation[side]);
    return lw_add(lw_load3(position + 3 * body), lw_mat_vec(r, c->point[side]));
}

double lw_closure_gap(const lw_multibody *mb, const lw_closure *c, const lw_unaligned *position,
                      const lw_unaligned *orientation) {
    lw_mat3 frame = identity, other;
    lw_vec3 a = point_at(mb, c, 0, position, orientation, &frame);
    lw_vec3 apart = lw_sub(point_at(mb, c, 1, position, orientation, &other), a);
    double square = 0.0;
    if (c->released) return 0.0;
    if (c->kept == LW_DISTANCE) return fabs(lw_norm(apart) - c->length);
    for (int k = 0; k < 3; ++k) {
        double along = lw_dot(axis(frame, k), apart);
        if (c->kept >> k & 1) square += along * along;
    }
    return sqrt(square);
}

void lw_multibody_closure_values(lw_multibody *mb, const double *state) {
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_kinematics(mb, state, state + mb->nq);
    lw_closure_equations(mb);
}

void lw_multibody_closures(lw_multibody *mb, const double *state, double *value, double *jacobian) {
    lw_multibody_closure_values(mb, state);
    for (int32_t k = 0; k < mb->rows * mb->nv; ++k) jacobian[k] = 0.0;
    for (int32_t i = 0; i < mb->closures; ++i) {
        const lw_closure *c = &mb->closure[i];
        for (int32_t k = c->row; k < c->row + c->rows; ++k) {
            const int32_t *way = c->path;
            value[k] = mb->row[k].value;
            for (int side = 0; side < 2; ++side) {
                lw_spatial f = mb->row[k].on[side];
                for (int32_t j = 0; j < c->count[side]; ++j) {
                    const lw_link *l = &mb->link[*way++];
                    for (int m = 0; m < l->columns; ++m)
                        jacobian[k * mb->nv + l->v + m] =
                            lw_dot(l->column[m].s.linear, f.linear) + lw_dot(l->column[m].s.angular, f.angular);
                    f.angular = lw_add(f.angular, lw_cross(l->offset, f.linear));
                }
            }
        }
    }
}
