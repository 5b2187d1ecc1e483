/* The equations of a joint between two bodies, and their first and second derivatives in time. */
#include "lw_constraints.h"

static const lw_vec3 zero = {0.0, 0.0, 0.0};

int32_t lw_constraint_kept(int joint_type) {
    static const int32_t kept[LW_JOINT_TYPES] = {LW_KEPT_ALL, 31, 59, 28, 7, 0};
    return kept[joint_type];
}

int32_t lw_constraint_count(int32_t kept) {
    int32_t count = 0;
    for (; kept; kept >>= 1) count += kept & 1;
    return count;
}

/* One side of a joint in W. */
typedef struct {
    lw_vec3 arm, point, velocity, angular, centripetal; /* arm: the point from the COM */
    lw_mat3 frame;
} lw_end;

static lw_end locate(const lw_multibody *mb, const lw_constraint *c, int side) {
    lw_end e = {c->point[side], c->point[side], zero, zero, zero, c->rotation[side]};
    if (c->link[side] < 0) return e;
    const lw_link *l = &mb->link[c->link[side]];
    e.arm = lw_mat_vec(l->rotation, c->point[side]);
    e.point = lw_add(l->position, e.arm);
    e.angular = l->velocity.angular;
    lw_vec3 swing = lw_cross(e.angular, e.arm);
    e.velocity = lw_add(l->velocity.linear, swing);
    e.centripetal = lw_cross(e.angular, swing);
    e.frame = lw_mat_mul(l->rotation, c->rotation[side]);
    return e;
}

static lw_vec3 axis(const lw_mat3 *frame, int k) {
    return k == 0 ? lw_column_x(*frame) : k == 1 ? lw_column_y(*frame) : lw_column_z(*frame);
}

/* e . d = 0, d from a's to b's point, e fixed on a: the force on a acts at b's point. */
static void keep_along(lw_constraint_row *r, const lw_end *a, const lw_end *b, lw_vec3 e) {
    lw_vec3 d = lw_sub(b->point, a->point), parting = lw_sub(b->velocity, a->velocity);
    lw_vec3 turning = lw_cross(a->angular, e);
    r->on[0].linear = lw_neg(e);
    r->on[0].angular = lw_cross(e, lw_add(a->arm, d));
    r->on[1].linear = e;
    r->on[1].angular = lw_cross(b->arm, e);
    r->value = lw_dot(e, d);
    r->rate = lw_dot(e, parting) + lw_dot(turning, d);
    r->drift = lw_dot(e, lw_sub(b->centripetal, a->centripetal)) + 2.0 * lw_dot(turning, parting) +
               lw_dot(lw_cross(a->angular, turning), d);
}

/* x . y = 0, x fixed on a and y on b. */
static void keep_square(lw_constraint_row *r, const lw_end *a, const lw_end *b, lw_vec3 x, lw_vec3 y) {
    lw_vec3 normal = lw_cross(y, x), x_rate = lw_cross(a->angular, x), y_rate = lw_cross(b->angular, y);
    r->on[0].linear = r->on[1].linear = zero;
    r->on[0].angular = lw_neg(normal);
    r->on[1].angular = normal;
    r->value = lw_dot(x, y);
    r->rate = lw_dot(lw_sub(b->angular, a->angular), normal);
    r->drift = lw_dot(lw_cross(b->angular, y_rate), x) + lw_dot(y, lw_cross(a->angular, x_rate)) +
               2.0 * lw_dot(x_rate, y_rate);
}

/* |d| = length */
static void keep_distance(lw_constraint_row *r, const lw_end *a, const lw_end *b, double length) {
    lw_vec3 d = lw_sub(b->point, a->point), parting = lw_sub(b->velocity, a->velocity);
    double size = lw_norm(d);
    lw_vec3 e = lw_scale(1.0 / size, d);
    r->on[0].linear = lw_neg(e);
    r->on[0].angular = lw_cross(e, a->arm);
    r->on[1].linear = e;
    r->on[1].angular = lw_cross(b->arm, e);
    r->value = size - length;
    r->rate = lw_dot(e, parting);
    r->drift = lw_dot(e, lw_sub(b->centripetal, a->centripetal)) +
               (lw_dot(parting, parting) - r->rate * r->rate) / size;
}

/* Which axes of a and b are square for the turns kept, so that the free turns change nothing about them: an axis
 * of b stays square to two of a where b turns about it; a last one to a third where nothing turns. */
static int32_t squares(int32_t turns, int pair[3][2]) {
    static const int table[8][3][2] = {
        {{0, 0}}, {{1, 2}}, {{0, 2}}, {{0, 2}, {1, 2}}, {{0, 1}}, {{2, 1}, {0, 1}}, {{1, 0}, {2, 0}},
        {{0, 2}, {1, 2}, {0, 1}}};
    for (int k = 0; k < 3; ++k) pair[k][0] = table[turns][k][0], pair[k][1] = table[turns][k][1];
    return lw_constraint_count(turns);
}

static void equations(const lw_multibody *mb, const lw_constraint *c, lw_constraint_row *row) {
    lw_end a = locate(mb, c, 0), b = locate(mb, c, 1);
    if (c->kept == LW_KEPT_DISTANCE) {
        keep_distance(row, &a, &b, c->length);
        return;
    }
    for (int k = 0; k < 3; ++k)
        if (c->kept >> k & 1) keep_along(row++, &a, &b, axis(&a.frame, k));
    int pair[3][2];
    int32_t turns = squares(c->kept / LW_KEPT_TURN, pair);
    for (int32_t k = 0; k < turns; ++k)
        keep_square(row++, &a, &b, axis(&a.frame, pair[k][0]), axis(&b.frame, pair[k][1]));
}

/* A row that asks for nothing. */
static void let_go(lw_constraint_row *r) {
    r->on[0].linear = r->on[0].angular = r->on[1].linear = r->on[1].angular = zero;
    r->value = r->rate = r->drift = 0.0;
}

void lw_constraint_equations(lw_maximal *m, const lw_multibody *mb) {
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        if (lw_constraint_acts(m, c)) equations(mb, c, m->row + c->row);
        else for (int32_t r = c->row; r < c->row + c->rows; ++r) let_go(&m->row[r]);
    }
}
