/* What the forces of closures do: README, section Closures. After the elimination of the articulated bodies
 * M = L D Lᵀ over the joints' columns, so that J M⁻¹ Jᵀ = (L⁻¹ Jᵀ)ᵀ D⁻¹ (L⁻¹ Jᵀ), and a row of J is spread over
 * the links of its loop only. */
#include "lw_model.h"

/* Added to the diagonal, which is scaled to 1: rows that say the same twice can be factored. */
static const double proximal = 1e-10;
enum { LW_PROXIMAL_ITERATIONS = 20 };

/* ---- L⁻¹ Jᵀ ---- */

/* Spread a force along links towards the root; it leaves as what the parent gets. `parts`, the sizes of the
 * force and torque that it is the sum of, bound round-off: returns what the row would move if none cancelled. */
static double spread_along(const lw_multibody *mb, const int32_t *way, int32_t count, lw_spatial *force,
                           const double parts[2], double *spread) {
    lw_spatial f = *force;
    double size = 0.0;
    for (int32_t j = 0; j < count; ++j) {
        const lw_link *l = &mb->link[way[j]];
        for (int k = 0; k < l->columns; ++k) {
            const lw_column *c = &l->column[k];
            double own = lw_dot(c->s.linear, f.linear) + lw_dot(c->s.angular, f.angular), share = own * c->inverse;
            double bound = lw_norm(c->s.linear) * parts[0] + lw_norm(c->s.angular) * parts[1];
            spread[l->v + k] = own;
            size += bound * bound * c->inverse;
            f.linear = lw_sub(f.linear, lw_scale(share, c->u.linear));
            f.angular = lw_sub(f.angular, lw_scale(share, c->u.angular));
        }
        f.angular = lw_add(f.angular, lw_cross(l->offset, f.linear));
    }
    *force = f;
    return size;
}

static double spread_row(lw_multibody *mb, const lw_closure *c, int32_t i) {
    double *spread = mb->spread + (size_t)i * mb->nv, size = 0.0;
    lw_spatial f[2] = {mb->row[i].on[0], mb->row[i].on[1]}, both;
    const int32_t *way = c->path;
    double parts[2] = {0.0, 0.0};
    for (int side = 0; side < 2; ++side) parts[0] += lw_norm(f[side].linear), parts[1] += lw_norm(f[side].angular);
    for (int side = 0; side < 2; way += c->count[side++])
        size += spread_along(mb, way, c->count[side], &f[side], parts, spread);
    both.linear = lw_add(f[0].linear, f[1].linear);
    both.angular = lw_add(f[0].angular, f[1].angular);
    return size + spread_along(mb, way, c->count[2], &both, parts, spread);
}

static double product(const lw_multibody *mb, const lw_closure *c, int32_t i, int32_t j) {
    const double *a = mb->spread + (size_t)i * mb->nv, *b = mb->spread + (size_t)j * mb->nv;
    double sum = 0.0;
    for (int32_t p = 0; p < c->links; ++p) {
        const lw_link *l = &mb->link[c->path[p]];
        for (int k = 0; k < l->columns; ++k)
            sum += a[l->v + k] * b[l->v + k] * l->column[k].inverse;
    }
    return sum;
}

/* ---- J M⁻¹ Jᵀ, scaled, and its factors in the envelope ---- */

static void set_rows(lw_multibody *mb, const lw_closure *c) {
    for (int32_t i = c->row; i < c->row + c->rows; ++i) {
        double *own = mb->delassus + (size_t)i * mb->rows, size = spread_row(mb, c, i);
        double diagonal = product(mb, c, i, i);
        /* A row that moves nothing holds round-off only. */
        mb->row_scale[i] = diagonal > 1e-24 * size ? 1.0 / sqrt(diagonal) : 0.0;
        for (int32_t j = mb->row[i].envelope; j < i; ++j)
            own[j] = product(mb, c, i, j) * mb->row_scale[i] * mb->row_scale[j];
        own[i] = mb->row_scale[i] > 0.0 ? 1.0 : 0.0;
    }
}

/* L D Lᵀ of the matrix with the proximal term; 1/D on the diagonal. */
static void factor_row(lw_multibody *mb, int32_t i) {
    int32_t envelope = mb->row[i].envelope;
    double *row = mb->factor + (size_t)i * mb->rows, pivot = mb->delassus[(size_t)i * mb->rows + i] + proximal;
    for (int32_t j = envelope; j < i; ++j) {
        const double *other = mb->factor + (size_t)j * mb->rows;
        double sum = mb->delassus[(size_t)i * mb->rows + j];
        int32_t start = mb->row[j].envelope > envelope ? mb->row[j].envelope : envelope;
        for (int32_t k = start; k < j; ++k) sum -= row[k] * other[k];
        row[j] = sum; /* L D */
    }
    for (int32_t j = envelope; j < i; ++j) {
        double scaled = row[j] * mb->factor[(size_t)j * mb->rows + j];
        pivot -= scaled * row[j];
        row[j] = scaled;
    }
    row[i] = 1.0 / (pivot > proximal * 1e-3 ? pivot : proximal * 1e-3);
}

void lw_delassus_factor(lw_multibody *mb) {
    for (int32_t c = 0; c < mb->closures; ++c) set_rows(mb, &mb->closure[c]);
    for (int32_t i = 0; i < mb->rows; ++i) factor_row(mb, i);
}

/* ---- multipliers ---- */

/* correction = right - delassus * multiplier, all scaled; returns its largest element. */
static double residual(lw_multibody *mb) {
    double largest = 0.0, *r = mb->correction;
    const double *x = mb->multiplier;
    for (int32_t i = 0; i < mb->rows; ++i) {
        const double *row = mb->delassus + (size_t)i * mb->rows;
        r[i] = mb->right[i] - row[i] * x[i];
        for (int32_t j = mb->row[i].envelope; j < i; ++j) {
            r[i] -= row[j] * x[j];
            r[j] -= row[j] * x[i];
        }
    }
    for (int32_t i = 0; i < mb->rows; ++i)
        if (mb->row_scale[i] > 0.0) largest = fmax(largest, fabs(r[i]));
    return largest;
}

/* multiplier += factor⁻¹ correction */
static void correct(lw_multibody *mb) {
    double *r = mb->correction;
    for (int32_t i = 0; i < mb->rows; ++i)
        for (int32_t j = mb->row[i].envelope; j < i; ++j) r[i] -= mb->factor[(size_t)i * mb->rows + j] * r[j];
    for (int32_t i = 0; i < mb->rows; ++i) r[i] *= mb->factor[(size_t)i * mb->rows + i];
    for (int32_t i = mb->rows - 1; i >= 0; --i)
        for (int32_t j = mb->row[i].envelope; j < i; ++j) r[j] -= mb->factor[(size_t)i * mb->rows + j] * r[i];
    for (int32_t i = 0; i < mb->rows; ++i) mb->multiplier[i] += r[i];
}

/* Proximal iterations: each leaves of the error what the proximal term is to the eigenvalue, so that rows which
 * say the same, and are right together, come out as if one of them were there. */
void lw_delassus_solve(lw_multibody *mb) {
    double last = HUGE_VAL, size = 0.0;
    for (int32_t i = 0; i < mb->rows; ++i) {
        mb->right[i] *= mb->row_scale[i];
        mb->multiplier[i] = 0.0;
        size = fmax(size, fabs(mb->right[i]));
    }
    for (int k = 0; k < LW_PROXIMAL_ITERATIONS; ++k) {
        double now = residual(mb);
        if (!(now > 1e-15 * size) || now > 0.5 * last) break;
        correct(mb);
        last = now;
    }
    for (int32_t i = 0; i < mb->rows; ++i) mb->multiplier[i] *= mb->row_scale[i];
}

/* ---- what they do ---- */

static void load_columns(lw_multibody *mb) {
    for (int32_t i = 0; i < mb->closures; ++i) {
        const lw_closure *c = &mb->closure[i];
        for (int32_t p = 0; p < c->links; ++p) {
            lw_link *l = &mb->link[c->path[p]];
            for (int32_t r = c->row; r < c->row + c->rows; ++r)
                for (int k = 0; k < l->columns; ++k)
                    l->column[k].force += mb->multiplier[r] * mb->spread[(size_t)r * mb->nv + l->v + k];
        }
    }
}

void lw_delassus_respond(lw_multibody *mb, double *joint_velocity) {
    for (int i = 0; i < mb->n; ++i)
        for (int k = 0; k < mb->link[i].columns; ++k) mb->link[i].column[k].force = 0.0;
    load_columns(mb);
    lw_outward(mb, 0, joint_velocity);
}

/* `on` of a row times the twists or accelerations of its bodies. */
static double seen(const lw_multibody *mb, const lw_closure *c, const lw_row *r) {
    double sum = 0.0;
    for (int side = 0; side < 2; ++side) {
        if (c->link[side] < 0) continue;
        lw_spatial a = mb->link[c->link[side]].acceleration;
        sum += lw_dot(r->on[side].linear, a.linear) + lw_dot(r->on[side].angular, a.angular);
    }
    return sum;
}

void lw_delassus_close(lw_multibody *mb, double *joint_acceleration) {
    lw_closure_equations(mb);
    lw_delassus_factor(mb);
    for (int32_t i = 0; i < mb->closures; ++i) {
        const lw_closure *c = &mb->closure[i];
        for (int32_t k = c->row; k < c->row + c->rows; ++k)
            mb->right[k] = -(seen(mb, c, &mb->row[k]) + mb->row[k].drift);
    }
    lw_delassus_solve(mb);
    load_columns(mb);
    lw_outward(mb, 1, joint_acceleration);
}
