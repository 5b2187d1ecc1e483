/* The matrix J M^-1 JT of the constraints: how a force along one row moves another. Constraints that share no
 * body do not meet; the columns before the first that a row meets are left out, and stay zero in the factor. */
#include "lw_constraints.h"

/* Added to the diagonal, relative to it, where rows may say the same twice. */
static const double proximal = 1e-11;
enum { LW_PROXIMAL_STEPS = 3 };

void lw_envelope_build(lw_maximal *m) {
    size_t start = 0;
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        int32_t first = c->row;
        for (int side = 0; side < 2; ++side)
            for (int32_t j = 0; j < i && c->link[side] >= 0; ++j) {
                const lw_constraint *other = &m->constraint[j];
                int meet = other->link[0] == c->link[side] || other->link[1] == c->link[side];
                if (meet && other->row < first) first = other->row;
            }
        for (int32_t r = c->row; r < c->row + c->rows; ++r) {
            m->row[r].first = first;
            m->row[r].start = start - (size_t)first;
            start += (size_t)(r + 1 - first);
        }
    }
}

/* Add what constraint `c` does to `other`, one of those before it, through a body that both touch. */
static void meet(lw_maximal *m, const lw_constraint *c, int side, const lw_constraint *other, int other_side) {
    for (int32_t i = c->row; i < c->row + c->rows; ++i) {
        const lw_constraint_row *r = &m->row[i];
        int32_t end = other->row + other->rows <= i ? other->row + other->rows : i + 1;
        for (int32_t j = other->row; j < end; ++j)
            m->matrix[r->start + (size_t)j] += lw_spatial_dot(r->moved[side], m->row[j].on[other_side]);
    }
}

void lw_envelope_assemble(lw_maximal *m) {
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        for (int32_t k = c->row; k < c->row + c->rows; ++k) {
            lw_constraint_row *r = &m->row[k];
            for (int32_t j = r->first; j <= k; ++j) m->matrix[r->start + (size_t)j] = 0.0;
            for (int side = 0; side < 2; ++side)
                if (c->link[side] >= 0) r->moved[side] = lw_spatial_times(&m->inverse[c->link[side]], r->on[side]);
        }
        for (int side = 0; side < 2; ++side) {
            int32_t link = c->link[side];
            for (int32_t t = link < 0 ? 0 : m->touching[link]; t < (link < 0 ? 0 : m->touching[link + 1]); ++t)
                if (m->touch[t] / 2 <= i) meet(m, c, side, &m->constraint[m->touch[t] / 2], m->touch[t] % 2);
        }
        for (int32_t k = c->row; k < c->row + c->rows && !lw_constraint_acts(m, c); ++k)
            m->matrix[m->row[k].start + (size_t)k] = 1.0; /* a multiplier of zero */
    }
}

/* A row of Cholesky's factor; the diagonal is kept inverted. */
static int factor_row(lw_maximal *m, int32_t i) {
    const lw_constraint_row *r = &m->row[i];
    double *own = m->factor + r->start, pivot = m->matrix[r->start + (size_t)i];
    if (m->redundant) pivot += proximal * pivot;
    for (int32_t j = r->first; j < i; ++j) {
        const lw_constraint_row *s = &m->row[j];
        const double *other = m->factor + s->start;
        double rest = m->matrix[r->start + (size_t)j];
        for (int32_t k = s->first > r->first ? s->first : r->first; k < j; ++k) rest -= own[k] * other[k];
        own[j] = rest * other[j];
        pivot -= own[j] * own[j];
    }
    if (!isfinite(pivot)) return LW_NOT_FINITE;
    if (!(pivot > 0.0)) return LW_SINGULAR;
    own[i] = 1.0 / sqrt(pivot);
    return LW_OK;
}

int lw_envelope_factor(lw_maximal *m, lw_fault *fault) {
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        for (int32_t r = c->row; r < c->row + c->rows; ++r) {
            int status = factor_row(m, r);
            if (!status) continue;
            fault->item = m->tree->link[c->link[c->link[1] < 0 ? 0 : 1]].body;
            return status;
        }
    }
    return LW_OK;
}

/* residual = right - matrix multiplier */
static void find_residual(lw_maximal *m) {
    for (int32_t i = 0; i < m->rows; ++i) m->residual[i] = m->right[i];
    for (int32_t i = 0; i < m->rows; ++i) {
        const double *own = m->matrix + m->row[i].start;
        for (int32_t j = m->row[i].first; j < i; ++j) {
            m->residual[i] -= own[j] * m->multiplier[j];
            m->residual[j] -= own[j] * m->multiplier[i];
        }
        m->residual[i] -= own[i] * m->multiplier[i];
    }
}

/* multiplier += factor^-T factor^-1 residual */
static void correct(lw_maximal *m) {
    double *x = m->residual;
    for (int32_t i = 0; i < m->rows; ++i) {
        const double *own = m->factor + m->row[i].start;
        for (int32_t j = m->row[i].first; j < i; ++j) x[i] -= own[j] * x[j];
        x[i] *= own[i];
    }
    for (int32_t i = m->rows - 1; i >= 0; --i) {
        const double *own = m->factor + m->row[i].start;
        x[i] *= own[i];
        for (int32_t j = m->row[i].first; j < i; ++j) x[j] -= own[j] * x[i];
        m->multiplier[i] += x[i];
    }
}

/* With rows that say the same twice, proximal steps: what they agree on is met, none gets more than its share. */
void lw_envelope_solve(lw_maximal *m) {
    for (int32_t i = 0; i < m->rows; ++i) m->residual[i] = m->right[i], m->multiplier[i] = 0.0;
    correct(m);
    for (int k = 1; k < LW_PROXIMAL_STEPS && m->redundant; ++k) {
        find_residual(m);
        correct(m);
    }
}
