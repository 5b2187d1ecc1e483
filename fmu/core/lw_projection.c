/* States moved onto the closures: README, section Closures. */
#include "lw_model.h"

enum { LW_PROJECTIONS = 25 };
static const double closed = 1e-14;   /* of the positions' size: round-off */
static const double allowed = 1e-15;  /* of the velocities' size, which the first step leaves */
static const double accepted = 1e-10; /* of the same: where Newton's method may end */
static const double fast = 1e-3;      /* by which a step closes a loop for whose next one its matrices will do */

/* Largest violation, relative to the size of the positions, and the closure that has it. */
static double violation(const lw_multibody *mb, int32_t *worst) {
    double largest = 0.0, size = 1.0;
    for (int i = 0; i < mb->n; ++i) size = fmax(size, lw_norm(mb->link[i].position));
    for (int32_t i = 0; i < mb->closures; ++i)
        for (int32_t k = mb->closure[i].row; k < mb->closure[i].row + mb->closure[i].rows; ++k)
            if (!(fabs(mb->row[k].value) <= largest)) largest = fabs(mb->row[k].value), *worst = i;
    return largest / size;
}

static int prepare(lw_multibody *mb, const double *q, const double *v, lw_fault *fault) {
    int status = lw_tree_accelerations(mb, q, v, mb->wrench, mb->rate[1] + mb->nq, fault);
    if (status) return status;
    lw_closure_equations(mb);
    lw_delassus_factor(mb);
    return LW_OK;
}

/* Newton's method on q, along the forces of the closures; it leaves matrices from close by. */
static int project_q(lw_multibody *mb, double *q, const double *v, lw_fault *fault) {
    double last = HUGE_VAL, *turn = mb->rate[1] + mb->nq, *rate = mb->rate[1];
    int status = prepare(mb, q, v, fault);
    for (int k = 0; k < LW_PROJECTIONS; ++k) {
        if (status) return status;
        double now = violation(mb, &fault->item);
        int slow = !(now < 0.5 * last) && k > 5; /* far from closed, the first steps may overshoot */
        if (now <= closed || (now <= accepted && !(now < 0.5 * last))) return LW_OK;
        if (slow || !isfinite(now)) return LW_OPEN;
        for (int32_t r = 0; r < mb->rows; ++r) mb->right[r] = -mb->row[r].value;
        lw_delassus_solve(mb);
        lw_delassus_respond(mb, turn);
        lw_coordinate_rate(mb, q, turn, rate);
        for (int i = 0; i < mb->n; ++i) {
            const lw_link *l = &mb->link[i];
            for (int32_t m = l->q; m < l->q + lw_joint_nq(l->type); ++m) q[m] += rate[m];
        }
        lw_coordinate_normalise(mb, q);
        last = now;
        lw_kinematics(mb, q, v);
        lw_closure_equations(mb);
        now = violation(mb, &fault->item);
        if (now > closed && !(now < fast * last)) status = prepare(mb, q, v, fault);
    }
    return LW_OPEN;
}

/* v loses what the closures do not allow; the matrices are those of q, or from close by. */
static void project_v(lw_multibody *mb, const double *q, double *v) {
    double last = HUGE_VAL, size = 1.0, *change = mb->rate[1] + mb->nq;
    for (int i = 0; i < mb->n; ++i) size = fmax(size, lw_norm(mb->link[i].velocity.linear));
    for (int k = 0; k < 3; ++k) {
        double now = 0.0;
        for (int32_t r = 0; r < mb->rows; ++r) {
            mb->right[r] = -mb->row[r].rate;
            now = fmax(now, fabs(mb->right[r]));
        }
        if (now == 0.0 || (k > 0 && now <= allowed * size) || !(now < 0.5 * last)) return;
        lw_delassus_solve(mb);
        lw_delassus_respond(mb, change);
        for (int i = 0; i < mb->n; ++i)
            for (int m = 0; m < mb->link[i].columns; ++m) v[mb->link[i].v + m] += change[mb->link[i].v + m];
        lw_kinematics(mb, q, v);
        lw_closure_equations(mb);
        last = now;
    }
}

int lw_project(lw_multibody *mb, double *q, double *v, lw_fault *fault) {
    int status = project_q(mb, q, v, fault);
    if (!status) project_v(mb, q, v);
    return status;
}

int lw_allow(lw_multibody *mb, const double *q, double *v, lw_fault *fault) {
    int status = prepare(mb, q, v, fault);
    if (!status) project_v(mb, q, v);
    return status;
}

int lw_multibody_close(lw_multibody *mb, double *state, lw_fault *fault) {
    int row = lw_first_not_finite(state, mb->nq + mb->nv + 1);
    fault->item = row;
    fault->time = 0.0;
    if (row >= 0) return LW_STATE_NOT_FINITE;
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_bind_added(mb, NULL);
    for (int k = 0; k < 6 * mb->n; ++k) mb->wrench[k] = 0.0;
    return mb->rows ? lw_project(mb, state, state + mb->nq, fault) : LW_OK;
}
