/* A macro step under a wrench that is affine in the twist at its end: README, section Affine wrench. */
#include "lw_model.h"
#include "lw_polynomial.h"

#include <string.h>

enum { LW_AFFINE_ITERATIONS = 10 };
static const double affine_tolerance = 1e-12; /* of the sizes that a residual is the difference of */

/* The caller's memory, cut into arrays; m = 6n. */
typedef struct {
    int m;
    double *wrenches;                           /* (count,m) */
    double *unit, *bias, *start, *twist, *residual, *pivots; /* (m) */
    double *cross, *compliance, *jacobian; /* (m,m); the last one as its factors */
} lw_work;

size_t lw_affine_size(int32_t n) {
    size_t m = 6 * (size_t)n;
    return LW_MAX_NODES * m + 6 * m + 3 * m * m;
}

static lw_work lay_out(double *memory, int n) {
    int m = 6 * n;
    double *vector = memory + LW_MAX_NODES * m, *matrix = vector + 6 * m;
    lw_work work = {m, memory, vector, vector + m, vector + 2 * m, vector + 3 * m, vector + 4 * m,
                    vector + 5 * m, matrix, matrix + (size_t)m * m, matrix + 2 * (size_t)m * m};
    return work;
}

static void twists(lw_multibody *mb, const double *state, double *twist) {
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_kinematics(mb, state, state + mb->nq);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_store3(twist + 6 * l->body, l->velocity.linear);
        lw_store3(twist + 6 * l->body + 3, l->velocity.angular);
    }
}

/* ---- a body's own block as added inertia ---- */

/* Body axes to world axes as they are half a step later. */
static lw_mat3 halfway(const lw_link *l, double h) {
    lw_vec3 turn = lw_scale(0.25 * h, l->velocity.angular); /* half the angle of half a step */
    lw_quat step = lw_quat_unit(lw_quat_of(1.0, turn.x, turn.y, turn.z));
    return lw_quat_matrix(lw_quat_mul(step, l->orientation));
}

/* The 3x3 block of the symmetric part of a 6x6 one. */
static lw_mat3 block(const double *own, int m, int row, int column) {
    double e[9];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            e[3 * i + j] = 0.5 * (own[(row + i) * m + column + j] + own[(column + j) * m + row + i]);
    return lw_load9(e);
}

static void store_block(double *inertia, int row, int column, double h, lw_mat3 b) {
    const double e[9] = {b.xx, b.xy, b.xz, b.yx, b.yy, b.yz, b.zx, b.zy, b.zz};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
            inertia[6 * (row + i) + column + j] += h * e[3 * i + j];
            if (row != column) inertia[6 * (column + j) + row + i] += h * e[3 * i + j];
        }
}

/* Over a step, -G (v_end - v_start) is what -h G a is on average. */
static void add_own_inertia(lw_multibody *mb, const double *response, double h, double *inertia) {
    int m = 6 * mb->n;
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        const double *own = response + (size_t)(m + 1) * (6 * l->body);
        lw_mat3 r = halfway(l, h), t = lw_mat_transpose(r);
        for (int row = 0; row < 6; row += 3)
            for (int column = row; column < 6; column += 3)
                store_block(inertia + 36 * l->body, row, column, h,
                            lw_mat_mul(lw_mat_mul(t, block(own, m, row, column)), r));
    }
}

static void copy_inertia(const lw_multibody *mb, const double *added, double *inertia) {
    if (added) memcpy(inertia, added, 36 * (size_t)mb->n * sizeof(double));
    else memset(inertia, 0, 36 * (size_t)mb->n * sizeof(double));
}

void lw_affine_inertia(lw_multibody *mb, const double *state, const double *added_inertia,
                       const double *response, double h, double *inertia) {
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_kinematics(mb, state, state + mb->nq);
    copy_inertia(mb, added_inertia, inertia);
    add_own_inertia(mb, response, h, inertia);
}

/* What of the response is not in the inertia: all of it, or without the bodies' own symmetric parts. */
static void split(const lw_work *w, const double *response, int own_apart) {
    int m = w->m;
    memcpy(w->cross, response, (size_t)m * m * sizeof(double));
    if (!own_apart) return;
    for (int i = 0; i < m; ++i)
        for (int j = i / 6 * 6; j < i / 6 * 6 + 6; ++j)
            w->cross[i * m + j] -= 0.5 * (response[i * m + j] + response[j * m + i]);
}

/* ---- the linear correction ---- */

/* Accelerations of the bodies by the wrenches on them: a column for each. */
static int compliance(lw_multibody *mb, const lw_macro_step *step, const double *inertia, lw_work *w) {
    int m = w->m;
    const double *q = step->state, *v = q + mb->nq;
    lw_modes(mb, v + mb->nv + 1);
    lw_bind_added(mb, inertia);
    for (int column = -1; column < m; ++column) { /* the first: without any wrench */
        if (column >= 0) w->unit[column] = 1.0;
        int status = lw_accelerations(mb, q, v, w->unit, mb->trial, step->fault);
        if (column >= 0) w->unit[column] = 0.0;
        if (status) return status;
        for (int i = 0; i < mb->n; ++i) {
            const lw_link *l = &mb->link[i];
            double a[6];
            lw_store3(a, l->acceleration.linear);
            lw_store3(a + 3, l->acceleration.angular);
            for (int k = 0; k < 6; ++k) {
                int row = 6 * l->body + k;
                if (column < 0) w->bias[row] = a[k];
                else w->compliance[row * m + column] = a[k] - w->bias[row];
            }
        }
    }
    return LW_OK;
}

/* Share of the step that the newest wrench counts for: the integral of its Lagrange polynomial, by Gauss. */
static double newest_share(const lw_macro_step *step) {
    static const double at[4] = {0.06943184420297371, 0.33000947820757187, 0.6699905217924281, 0.9305681557970263};
    static const double weight[4] = {0.17392742256872692, 0.3260725774312731, 0.3260725774312731,
                                     0.17392742256872692};
    const double newest[LW_MAX_NODES] = {1.0};
    lw_polynomial polynomial;
    double share = 0.0;
    if (lw_polynomial_init(&polynomial, step->count, step->nodes)) return 1.0;
    for (int k = 0; k < 4; ++k) {
        double value;
        lw_polynomial_value(&polynomial, at[k], 1, newest, &value);
        share += weight[k] * value;
    }
    return share;
}

/* 1 + share h (G - own) C */
static int jacobian(lw_multibody *mb, const lw_macro_step *step, const double *inertia, lw_work *w) {
    int m = w->m, status = compliance(mb, step, inertia, w);
    double length = step->h * newest_share(step);
    for (int i = 0; i < m && !status; ++i)
        for (int j = 0; j < m; ++j) {
            double sum = 0.0;
            for (int k = 0; k < m; ++k) sum += w->cross[i * m + k] * w->compliance[k * m + j];
            w->jacobian[i * m + j] = (i == j ? 1.0 : 0.0) + length * sum;
        }
    return status;
}

/* ---- the step ---- */

/* What the newest wrench should be for the twist that came out, less what it was: `w->residual`. Returns
 * whether that is round-off; `w->start` holds own (about - v_start), zero where own is not apart. */
static int is_met(const lw_work *w, const double *wrench, const double *about, int *worst) {
    double largest = 0.0, scale = 0.0;
    for (int i = 0; i < w->m; ++i) {
        double target = wrench[i] + w->start[i], size = fabs(target);
        for (int j = 0; j < w->m; ++j) {
            double entry = w->cross[i * w->m + j];
            target -= entry * (w->twist[j] - about[j]);
            size += fabs(entry) * (fabs(w->twist[j]) + fabs(about[j]));
        }
        w->residual[i] = target - w->wrenches[i];
        if (!(fabs(w->residual[i]) <= largest)) largest = fabs(w->residual[i]), *worst = i / 6;
        scale = fmax(scale, size);
    }
    return largest <= affine_tolerance * scale;
}

/* own (about - v_start): the wrench that belongs to `about`, seen from the start of the step. */
static void shift_own(const lw_work *w, const lw_affine *affine, int own_apart) {
    int m = w->m;
    for (int i = 0; i < m; ++i) {
        double sum = 0.0;
        for (int j = i / 6 * 6; own_apart && j < i / 6 * 6 + 6; ++j)
            sum += (affine->response[i * m + j] - w->cross[i * m + j]) * (affine->about[j] - w->twist[j]);
        w->start[i] = sum;
    }
}

static void finish(const lw_work *w, const double *wrench, const lw_affine *affine) {
    int m = w->m;
    memcpy(affine->held, w->wrenches, (size_t)m * sizeof(double));
    for (int i = 0; i < m; ++i) {
        affine->wrench[i] = wrench[i];
        for (int j = 0; j < m; ++j)
            affine->wrench[i] -= affine->response[i * m + j] * (w->twist[j] - affine->about[j]);
    }
}

int lw_multibody_advance_affine(lw_multibody *mb, const lw_macro_step *step, const lw_affine *affine) {
    lw_work w = lay_out(affine->memory, mb->n);
    int own_apart = step->count == 1, m = w.m, row, status, worst = 0;
    if (step->count < 1 || step->count > LW_MAX_NODES) return LW_BAD_NODES;
    if ((row = lw_first_not_finite(affine->response, m * m)) >= 0) {
        step->fault->item = row / m / 6, step->fault->time = 0.0;
        return LW_RESPONSE_NOT_FINITE;
    }
    memset(w.unit, 0, (size_t)m * sizeof(double));
    split(&w, affine->response, own_apart);
    twists(mb, step->state, w.twist);
    copy_inertia(mb, step->added_inertia, affine->inertia);
    if (own_apart) add_own_inertia(mb, affine->response, step->h, affine->inertia);
    shift_own(&w, affine, own_apart);
    memcpy(w.wrenches, step->wrenches, (size_t)m * step->count * sizeof(double));
    for (int i = 0; i < m; ++i) w.wrenches[i] += w.start[i];
    lw_macro_step trial = *step;
    trial.wrenches = w.wrenches;
    trial.added_inertia = affine->inertia;
    for (int k = 0; k < LW_AFFINE_ITERATIONS; ++k) {
        if ((status = lw_multibody_advance(mb, &trial))) return status;
        twists(mb, step->next, w.twist);
        if (is_met(&w, step->wrenches, affine->about, &worst)) {
            finish(&w, step->wrenches, affine);
            return LW_OK;
        }
        if (k == 0 && (status = jacobian(mb, &trial, affine->inertia, &w))) return status;
        if (k == 0 && lw_factor(m, w.jacobian, w.pivots)) break;
        lw_substitute(m, w.jacobian, w.pivots, w.residual);
        for (int i = 0; i < m; ++i) w.wrenches[i] += w.residual[i];
    }
    step->fault->item = worst, step->fault->time = step->h;
    return LW_NOT_CONVERGED;
}
