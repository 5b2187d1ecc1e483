/* Joints as equations between free bodies, for the files of this folder. */
#ifndef LW_CONSTRAINTS_H
#define LW_CONSTRAINTS_H

#include "lw_maximal.h"
#include "lw_model.h"

/* What a joint keeps: translations along, and turns about, the axes of its frame. */
enum { LW_KEPT_TURN = 8, LW_KEPT_ALL = 63, LW_KEPT_DISTANCE = 64 };

typedef struct {
    int32_t kept;    /* bits: x, y, z, turns about x, y, z; or the distance */
    int32_t link[2]; /* -1 = world */
    int32_t row, rows;
    int32_t item;    /* the body that it carries, or the closure that it is */
    int32_t carries; /* it is the joint of link[1] in the tree */
    lw_vec3 point[2];
    lw_mat3 rotation[2];
    double length;
} lw_constraint;

/* value(poses) = 0, rate = on . twists = 0, rate' = on . accelerations + drift = 0. */
typedef struct {
    lw_spatial on[2];    /* force and torque at the COMs for a multiplier of 1 */
    lw_spatial moved[2]; /* accelerations that they cause */
    double value, rate, drift;
    int32_t first;       /* column with which the row begins in the matrix */
    size_t start;        /* where column 0 would be in memory */
} lw_constraint_row;

typedef struct {
    lw_formulation formulation; /* must be the first */
    lw_multibody *tree;
    int32_t n, constraints, rows, redundant, stabilisation;
    double time;
    lw_constraint *constraint;
    lw_constraint_row *row;
    lw_sym3 *inverse_inertia; /* (n) of the body alone, body frame; zero if there is none */
    lw_inertia6 *inverse;     /* (n) of body and added inertia, W */
    lw_spatial *force;        /* (n) on the COMs, but for the constraints */
    lw_spatial *load;         /* (n) of springs and dampers on the child of joint i at its point */
    double *matrix, *factor;  /* envelopes: lower halves by rows, from the first column that is not zero */
    double *right, *multiplier, *residual; /* (rows) */
    double *q, *v;                         /* coordinates of the tree */
    int32_t *turn;                         /* (n) where q has the angle of a joint, -1: it has none */
    int32_t *touching, *touch; /* (n + 1), (2 constraints): 2 constraint + side, grouped by link */
} lw_maximal;

LW_INLINE double lw_spatial_dot(lw_spatial a, lw_spatial b) {
    return lw_dot(a.linear, b.linear) + lw_dot(a.angular, b.angular);
}
LW_INLINE lw_spatial lw_spatial_axpy(double s, lw_spatial a, lw_spatial b) {
    lw_spatial sum = {lw_add(lw_scale(s, a.linear), b.linear), lw_add(lw_scale(s, a.angular), b.angular)};
    return sum;
}
LW_INLINE lw_spatial lw_spatial_times(const lw_inertia6 *i, lw_spatial a) {
    lw_spatial f = {lw_add(lw_sym_vec(i->m, a.linear), lw_mat_vec(i->h, a.angular)),
                    lw_add(lw_mat_tvec(i->h, a.linear), lw_sym_vec(i->j, a.angular))};
    return f;
}

/* lw_maximal.c: force and torque of a closure at its point on the second body. */
lw_spatial lw_maximal_closure_reaction(const lw_maximal *maximal, const lw_multibody *bodies, int32_t closure);
/* lw_release.c: let the tree's joints be what the events of the bodies have made of them; what an event of the
 * tree compares with its threshold. */
void lw_maximal_follow(lw_maximal *maximal, const lw_multibody *bodies);
double lw_maximal_occasion(lw_multibody *bodies, int32_t event, const double *y, double time);
/* Does a joint act, or has it been released? */
LW_INLINE int lw_constraint_acts(const lw_maximal *m, const lw_constraint *c) {
    if (!c->carries) return !m->tree->closure[c->item].released;
    return m->tree->link[c->link[1]].type == m->tree->link[c->link[1]].built;
}

/* lw_constraints.c: what a joint type keeps; all rows, after lw_kinematics. */
int32_t lw_constraint_kept(int joint_type);
int32_t lw_constraint_count(int32_t kept);
void lw_constraint_equations(lw_maximal *maximal, const lw_multibody *bodies);
/* lw_masses.c: inverse inertias of all bodies; of a 3x3 matrix, 0 if it is singular. */
int lw_inverse_sym3(lw_sym3 s, lw_sym3 *inverse);
int lw_inverse_inertias(lw_maximal *maximal, const lw_multibody *bodies, lw_fault *fault);
/* lw_envelope.c: where rows meet; the matrix on . M^-1 on, and its factor; multipliers for `right`. */
void lw_envelope_build(lw_maximal *maximal);
void lw_envelope_assemble(lw_maximal *maximal);
int lw_envelope_factor(lw_maximal *maximal, lw_fault *fault);
void lw_envelope_solve(lw_maximal *maximal);
/* lw_joints.c: coordinates of the joints; springs and dampers as loads, and as forces on the bodies. */
void lw_joint_coordinates(lw_maximal *maximal, const lw_multibody *bodies, const double *q);
void lw_joint_loads(lw_maximal *maximal, const lw_multibody *bodies, const double *q);
/* lw_stabilise.c: the joints' angles, and, of projection, the joints closed, after a substep. */
int lw_maximal_settle(lw_multibody *bodies, double *q, double *v, lw_fault *fault);

#endif
