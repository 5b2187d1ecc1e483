/* What is done after a substep: the equations of motion keep only the second derivative of each constraint. */
#include "lw_constraints.h"

enum { LW_CLOSINGS = 10 };
static const double closed = 4e-15; /* of the size of positions, of speeds: round-off */

/* Let the multipliers push each body by a velocity, or by a small displacement. */
static lw_spatial push(const lw_maximal *m, int32_t link) {
    lw_spatial moved = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int32_t t = m->touching[link]; t < m->touching[link + 1]; ++t) {
        const lw_constraint *c = &m->constraint[m->touch[t] / 2];
        for (int32_t r = c->row; r < c->row + c->rows; ++r)
            moved = lw_spatial_axpy(m->multiplier[r], m->row[r].moved[m->touch[t] % 2], moved);
    }
    return moved;
}

static void displace(const lw_maximal *m, const lw_multibody *mb, double *q) {
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_spatial d = push(m, i);
        lw_quat turn = lw_quat_of(1.0, 0.5 * d.angular.x, 0.5 * d.angular.y, 0.5 * d.angular.z);
        lw_store3(q + l->q, lw_add(l->position, d.linear));
        lw_store4(q + l->q + 3, lw_quat_unit(lw_quat_mul(turn, l->orientation)));
    }
}

static void accelerate(const lw_maximal *m, const lw_multibody *mb, double *v) {
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_spatial d = push(m, i);
        lw_store3(v + l->v, lw_add(l->velocity.linear, d.linear));
        lw_store3(v + l->v + 3, lw_mat_tvec(l->rotation, lw_add(l->velocity.angular, d.angular)));
    }
}

/* Largest violation of the rows, in units of what is round-off; `right` is what would undo it. */
static double violation(lw_maximal *m, const lw_multibody *mb, int of_rate, int32_t *worst) {
    double largest = 0.0, size = 1.0;
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *l = &mb->link[i];
        size = fmax(size, of_rate ? lw_norm(l->velocity.linear) : lw_norm(l->position));
        if (of_rate) size = fmax(size, lw_norm(l->velocity.angular));
    }
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        for (int32_t r = c->row; r < c->row + c->rows; ++r) {
            m->right[r] = -(of_rate ? m->row[r].rate : m->row[r].value);
            if (!(fabs(m->right[r]) <= largest)) largest = fabs(m->right[r]), *worst = i;
        }
    }
    return largest / (closed * size);
}

static int prepare(lw_maximal *m, lw_multibody *mb, const double *q, const double *v, lw_fault *fault) {
    lw_kinematics(mb, q, v);
    int status = lw_inverse_inertias(m, mb, fault);
    if (status) return status;
    lw_constraint_equations(m, mb);
    lw_envelope_assemble(m);
    return LW_OK;
}

/* Newton's method along the joints' forces, with one factor for all steps, until what is left is round-off or
 * does not get less. */
static int undo(lw_maximal *m, lw_multibody *mb, double *q, double *v, int of_rate, lw_fault *fault) {
    double last = HUGE_VAL;
    int32_t worst = 0;
    for (int k = 0; k < LW_CLOSINGS; ++k) {
        double now = violation(m, mb, of_rate, &worst);
        if (now <= 1.0 || (now < 1e4 && !(now < 0.1 * last))) return LW_OK;
        if (!isfinite(now)) break;
        last = now;
        lw_envelope_solve(m);
        if (of_rate) accelerate(m, mb, v);
        else displace(m, mb, q);
        int status = prepare(m, mb, q, v, fault);
        if (status) return status;
    }
    fault->item = m->constraint[worst].item;
    return m->constraint[worst].carries ? LW_JOINT_OPEN : LW_OPEN;
}

static int project(lw_maximal *m, lw_multibody *mb, double *q, double *v, lw_fault *fault) {
    int status = prepare(m, mb, q, v, fault);
    if (!status) status = lw_envelope_factor(m, fault);
    if (!status) status = undo(m, mb, q, v, 0, fault);
    return status ? status : undo(m, mb, q, v, 1, fault);
}

int lw_maximal_settle(lw_multibody *mb, double *q, double *v, lw_fault *fault) {
    lw_maximal *m = (lw_maximal *)mb->formulation;
    lw_maximal_follow(m, mb);
    if (m->stabilisation == LW_PROJECTION && m->rows) {
        int status = project(m, mb, q, v, fault);
        if (status) return status;
    } else {
        lw_kinematics(mb, q, v);
    }
    lw_joint_coordinates(m, mb, q);
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *joint = &m->tree->link[i];
        if (m->turn[i] >= 0 && joint->type == joint->built)
            q[m->turn[i]] = m->q[joint->q + (joint->type == LW_PLANAR ? 2 : 0)];
    }
    return LW_OK;
}
