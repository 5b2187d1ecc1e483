#include "lw_incremental.h"

#include <string.h>

#include "lw_model.h"

/* The unknowns are those of the paper, at the places that v has for the joints: X, Y and angle of each root, then
 * the angle of each hinged link, all in the world. */
typedef struct {
    lw_formulation formulation; /* must be the first */
    double *mass;               /* (nv,nv) M(y), then its factor */
    double *right;              /* (nv) R - C - G, then the unknowns' second derivatives */
    double *along;              /* (3,nv) of one body: what x, y and angle change by with each unknown */
    double *rate;               /* (nv) of the unknowns */
} lw_incremental;

/* A body's mass, with its added inertia, in the plane: x, y, angle. */
typedef struct { double element[3][3]; } lw_plane;

static int angle_of(const lw_link *l) { return l->parent < 0 ? l->v + 2 : l->v; }

/* ---- Eqs. 6-9: M(y) y'' + C(y, y') + G(y) = R ---- */

static lw_plane mass_of(const lw_link *l) {
    static const int planar[3] = {0, 1, 5};
    lw_plane m = {{{l->mass, 0.0, 0.0}, {0.0, l->mass, 0.0}, {0.0, 0.0, l->inertia.zz}}};
    if (!l->added) return m;
    double c = l->rotation.xx, s = l->rotation.yx, turn[3][3] = {{c, -s, 0.0}, {s, c, 0.0}, {0.0, 0.0, 1.0}};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
            for (int p = 0; p < 3; ++p)
                for (int q = 0; q < 3; ++q)
                    m.element[i][j] += turn[i][p] * turn[j][q] * l->added[6 * planar[p] + planar[q]];
    return m;
}

/* A lever (x, y) fixed on a link that turns: it adds (-y, x) times its angle's second derivative to the
 * acceleration of what it leads to, and - (x, y) times the square of the first. */
static void lead(const lw_incremental *p, int nv, int angle, lw_vec3 lever, double *leftover) {
    double square = p->rate[angle] * p->rate[angle];
    p->along[angle] -= lever.y;
    p->along[nv + angle] += lever.x;
    leftover[0] -= lever.x * square;
    leftover[1] -= lever.y * square;
}

/* From the COM of the root to the COM of `l`: each hinge is reached from a link and leaves to the next. */
static void describe(const lw_multibody *mb, const lw_incremental *p, const lw_link *l, double *leftover) {
    int nv = mb->nv;
    memset(p->along, 0, 3 * (size_t)nv * sizeof(double));
    leftover[0] = leftover[1] = leftover[2] = 0.0;
    p->along[2 * nv + angle_of(l)] = 1.0;
    for (; l->parent >= 0; l = &mb->link[l->parent]) {
        lead(p, nv, angle_of(l), l->arm, leftover);
        lead(p, nv, angle_of(&mb->link[l->parent]), lw_sub(l->offset, l->arm), leftover);
    }
    p->along[l->v] = p->along[nv + l->v + 1] = 1.0;
}

/* Add to each equation what the body brings in: mass times acceleration, less the force. */
static void add_body(const lw_multibody *mb, const lw_incremental *p, const lw_link *l, const double *wrench) {
    int nv = mb->nv;
    double leftover[3];
    lw_plane m = mass_of(l);
    describe(mb, p, l, leftover);
    const double *f = wrench + 6 * l->body;
    double force[3] = {f[0] + l->mass * mb->gravity.x, f[1] + l->mass * mb->gravity.y, f[5]};
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) force[i] -= m.element[i][j] * leftover[j];
    for (int r = 0; r < nv; ++r) {
        double row[3] = {0.0, 0.0, 0.0};
        for (int i = 0; i < 3; ++i) {
            double share = p->along[i * nv + r];
            p->right[r] += share * force[i];
            for (int j = 0; j < 3; ++j) row[j] += share * m.element[i][j];
        }
        for (int c = 0; c <= r; ++c)
            p->mass[r * nv + c] += row[0] * p->along[c] + row[1] * p->along[nv + c] + row[2] * p->along[2 * nv + c];
    }
}

/* Cholesky; returns the unknown that nothing moves, or -1. */
static int solve(int n, double *a, double *x) {
    for (int i = 0; i < n; ++i) {
        double *row = a + i * n, whole = row[i];
        for (int j = 0; j <= i; ++j) {
            const double *other = a + j * n;
            for (int k = 0; k < j; ++k) row[j] -= row[k] * other[k];
            if (j < i) row[j] /= other[j];
        }
        if (!(row[i] > 1.5e-14 * whole)) return i;
        row[i] = sqrt(row[i]);
        for (int k = 0; k < i; ++k) x[i] -= row[k] * x[k];
        x[i] /= row[i];
    }
    for (int i = n - 1; i >= 0; --i) {
        x[i] /= a[i * n + i];
        for (int k = 0; k < i; ++k) x[k] -= a[i * n + k] * x[i];
    }
    return -1;
}

/* ---- what they come to for bodies and joints ---- */

static void set_accelerations(lw_multibody *mb, const lw_incremental *p, double *joint_acceleration) {
    static const lw_spatial none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int i = 0; i < mb->n; ++i) {
        lw_link *l = &mb->link[i];
        double leftover[3], a[3];
        describe(mb, p, l, leftover);
        for (int k = 0; k < 3; ++k) {
            a[k] = leftover[k];
            for (int c = 0; c < mb->nv; ++c) a[k] += p->along[k * mb->nv + c] * p->right[c];
        }
        l->acceleration = none;
        l->acceleration.linear = lw_vec(a[0], a[1], 0.0);
        l->acceleration.angular.z = a[2];
        if (l->parent < 0) {
            memcpy(joint_acceleration + l->v, a, sizeof a);
        } else {
            double base = mb->link[l->parent].acceleration.angular.z;
            joint_acceleration[l->v] = l->axis.z > 0.0 ? a[2] - base : base - a[2];
        }
    }
}

/* Newton and Euler from the leaves to the roots: q1, q2 of the paper, and what keeps the bodies in the plane.
 * `bias_force` takes them at the COM, where lw_multibody_evaluate looks, with nothing to add. */
static void set_reactions(lw_multibody *mb, const double *wrench) {
    static const lw_inertia6 no_inertia;
    for (int i = 0; i < mb->n; ++i) {
        lw_link *l = &mb->link[i];
        lw_sym3 inertia = lw_rotate_sym(l->rotation, l->inertia);
        lw_vec3 w = l->velocity.angular;
        lw_spatial f = lw_total_wrench(l, wrench);
        lw_vec3 spin = lw_add(lw_sym_vec(inertia, l->acceleration.angular), lw_cross(w, lw_sym_vec(inertia, w)));
        l->bias_force.linear = lw_sub(lw_scale(l->mass, lw_sub(l->acceleration.linear, mb->gravity)), f.linear);
        l->bias_force.angular = lw_sub(spin, f.angular);
        l->articulated = no_inertia;
    }
    for (int i = mb->n - 1; i >= 0; --i) {
        const lw_link *l = &mb->link[i];
        if (l->parent < 0) continue;
        lw_spatial *base = &mb->link[l->parent].bias_force, f = l->bias_force;
        base->linear = lw_add(base->linear, f.linear);
        base->angular = lw_add(base->angular, lw_add(f.angular, lw_cross(l->offset, f.linear)));
    }
}

static int accelerations(lw_multibody *mb, const double *q, const double *v, const double *wrench,
                         double *joint_acceleration, lw_fault *fault) {
    lw_incremental *p = (lw_incremental *)mb->formulation;
    size_t nv = (size_t)mb->nv;
    lw_kinematics(mb, q, v);
    memset(p->mass, 0, nv * nv * sizeof(double));
    memset(p->right, 0, nv * sizeof(double));
    for (int i = 0; i < mb->n; ++i) p->rate[angle_of(&mb->link[i])] = mb->link[i].velocity.angular.z;
    for (int i = 0; i < mb->n; ++i) add_body(mb, p, &mb->link[i], wrench);
    int stuck = solve(mb->nv, p->mass, p->right);
    for (int i = 0; i < mb->n && stuck >= 0; ++i)
        if (mb->link[i].v <= stuck && stuck < mb->link[i].v + mb->link[i].columns) fault->item = mb->link[i].body;
    if (stuck >= 0) return LW_SINGULAR;
    set_accelerations(mb, p, joint_acceleration);
    set_reactions(mb, wrench);
    return LW_OK;
}

/* ---- in memory ---- */

static int settle(lw_multibody *mb, double *q, double *v, lw_fault *fault) {
    (void)mb, (void)q, (void)v, (void)fault;
    return LW_OK;
}

static double nothing(const lw_multibody *mb, const double *x) {
    (void)mb, (void)x;
    return 0.0;
}

/* Axis z of both frames of a hinge is that of the world, or both the opposite: no body is turned over. */
static int is_described(const lw_link *l) {
    const double upright = 1.0 - 1e-12;
    if (l->sprung || l->damped) return 0;
    if (l->parent >= 0) return l->type == LW_REVOLUTE && l->axis.z * l->child_matrix.zz > upright;
    return l->type == LW_PLANAR && !l->parent_rotated && !l->child_rotated && lw_norm(l->child_point) == 0.0;
}

size_t lw_incremental_size(const lw_multibody *mb) {
    size_t nv = (size_t)mb->nv;
    return sizeof(lw_incremental) + nv * (nv + 5) * sizeof(double);
}

int32_t lw_incremental_attach(void *memory, lw_multibody *mb) {
    lw_incremental *p = memory;
    size_t nv = (size_t)mb->nv;
    for (int i = 0; i < mb->n; ++i)
        if (!is_described(&mb->link[i])) return mb->link[i].body;
    p->formulation.accelerations = accelerations;
    p->formulation.settle = settle;
    p->formulation.spring_energy = p->formulation.damper_power = nothing;
    p->formulation.tree = NULL;
    p->formulation.occasion = NULL; /* there are no events */
    p->formulation.closure_reactions = NULL; /* no loops */
    p->formulation.coordinates = NULL; /* other than its own */
    p->mass = (double *)(p + 1);
    p->right = p->mass + nv * nv;
    p->along = p->right + nv;
    p->rate = p->along + 3 * nv;
    mb->formulation = &p->formulation;
    return -1;
}
