/* Articulated-body algorithm in world axes at the centres of mass: README, section Dynamics.
 *
 * A joint with several degrees of freedom is eliminated one column at a time, as a sequence of joints
 * with one degree of freedom each and massless bodies at the same place between them.
 */
#include "lw_model.h"

#include <string.h>

/* A pivot below this fraction of the terms it is the difference of holds round-off only. */
static const double pivot_tolerance = 1.5e-14;

static const lw_mat3 no_coupling = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};

LW_INLINE lw_spatial inertia_times(const lw_inertia6 *i, lw_spatial a) {
    lw_spatial f = {lw_add(lw_sym_vec(i->m, a.linear), lw_mat_vec(i->h, a.angular)),
                    lw_add(lw_mat_tvec(i->h, a.linear), lw_sym_vec(i->j, a.angular))};
    return f;
}

LW_INLINE double power(lw_spatial f, lw_spatial v) {
    return lw_dot(f.linear, v.linear) + lw_dot(f.angular, v.angular);
}

LW_INLINE lw_spatial spatial_axpy(double s, lw_spatial a, lw_spatial b) {
    lw_spatial sum = {lw_add(lw_scale(s, a.linear), b.linear), lw_add(lw_scale(s, a.angular), b.angular)};
    return sum;
}

/* ---- the body itself ---- */

LW_INLINE lw_sym3 sym_add(lw_sym3 a, lw_sym3 b) {
    lw_sym3 s = {a.xx + b.xx, a.yy + b.yy, a.zz + b.zz, a.xy + b.xy, a.xz + b.xz, a.yz + b.yz};
    return s;
}

/* The added inertia as blocks in the body frame; of the diagonal blocks the upper half is read. */
static lw_inertia6 added_blocks(const double *a) {
    lw_inertia6 i = {{a[0], a[7], a[14], a[1], a[2], a[8]},
                     {a[21], a[28], a[35], a[22], a[23], a[29]},
                     {a[3], a[4], a[5], a[9], a[10], a[11], a[15], a[16], a[17]}};
    return i;
}

static lw_inertia6 rotate_inertia(lw_mat3 r, lw_inertia6 body) {
    lw_inertia6 world = {lw_rotate_sym(r, body.m), lw_rotate_sym(r, body.j),
                         lw_mat_mul(lw_mat_mul(r, body.h), lw_mat_transpose(r))};
    return world;
}

/* Start from the body's own inertia and the forces that do not depend on acceleration. */
static void start(lw_link *l, lw_vec3 gravity, const double *wrench) {
    lw_sym3 inertia = lw_rotate_sym(l->rotation, l->inertia);
    lw_vec3 w = l->velocity.angular;
    lw_inertia6 own = {{l->mass, l->mass, l->mass, 0.0, 0.0, 0.0}, inertia, no_coupling};
    if (l->added) {
        lw_inertia6 added = rotate_inertia(l->rotation, added_blocks(l->added));
        own.m = sym_add(own.m, added.m);
        own.j = sym_add(own.j, added.j);
        own.h = added.h;
    }
    l->articulated = own;
    l->bias_force.linear = lw_neg(lw_add(lw_scale(l->mass, gravity), lw_load3(wrench)));
    l->bias_force.angular = lw_sub(lw_cross(w, lw_sym_vec(inertia, w)), lw_load3(wrench + 3));
    l->mass_scale = own.m.xx + own.m.yy + own.m.zz;
    l->inertia_scale = own.j.xx + own.j.yy + own.j.zz;
}

/* ---- from the leaves to the roots ---- */

/* i minus u uᵀ / d: what is left to move once the joint gives way along one column. */
LW_INLINE void give_way(lw_inertia6 *i, lw_spatial u, double inverse) {
    lw_vec3 f = lw_scale(inverse, u.linear), n = lw_scale(inverse, u.angular);
    lw_vec3 a = u.linear, b = u.angular;
    i->m.xx -= f.x * a.x, i->m.yy -= f.y * a.y, i->m.zz -= f.z * a.z;
    i->m.xy -= f.x * a.y, i->m.xz -= f.x * a.z, i->m.yz -= f.y * a.z;
    i->j.xx -= n.x * b.x, i->j.yy -= n.y * b.y, i->j.zz -= n.z * b.z;
    i->j.xy -= n.x * b.y, i->j.xz -= n.x * b.z, i->j.yz -= n.y * b.z;
    i->h.xx -= f.x * b.x, i->h.xy -= f.x * b.y, i->h.xz -= f.x * b.z;
    i->h.yx -= f.y * b.x, i->h.yy -= f.y * b.y, i->h.yz -= f.y * b.z;
    i->h.zx -= f.z * b.x, i->h.zy -= f.z * b.y, i->h.zz -= f.z * b.z;
}

LW_INLINE lw_spatial translation_force(const lw_inertia6 *i, lw_vec3 direction) {
    lw_spatial f = {lw_sym_vec(i->m, direction), lw_mat_tvec(i->h, direction)};
    return f;
}

/* Eliminate the joint's columns from inertia and force. */
LW_INLINE int eliminate(lw_link *l, lw_inertia6 *i, lw_spatial *f, const double *joint_force) {
    for (int k = 0; k < l->columns; ++k) {
        lw_column *c = &l->column[k];
        int slides = k < l->translations;
        c->u = slides ? translation_force(i, c->s.linear) : inertia_times(i, c->s);
        double pivot = slides ? lw_dot(c->s.linear, c->u.linear) : power(c->u, c->s);
        double scale = lw_dot(c->s.linear, c->s.linear) * l->mass_scale + (slides ? 0.0 : l->inertia_scale);
        if (isnan(pivot)) return LW_NOT_FINITE;
        int given = l->prescribed >> k & 1;
        if (!given && !(pivot > pivot_tolerance * scale)) return LW_SINGULAR;
        c->inverse = given ? 0.0 : 1.0 / pivot;
        c->force = joint_force[k] - (slides ? lw_dot(c->s.linear, f->linear) : power(*f, c->s));
        if (l->parent < 0 && k + 1 == l->columns) return LW_OK; /* the world takes the rest */
        if (!given) give_way(i, c->u, c->inverse);
        *f = spatial_axpy(given ? c->given : c->force * c->inverse, c->u, *f);
    }
    return LW_OK;
}

/* Add inertia and force to the parent, moved from the child's COM to the parent's: the child's
 * acceleration is a + α x r, its force has the moment r x f. */
LW_INLINE void add_to_parent(lw_link *parent, const lw_inertia6 *i, lw_spatial f, lw_vec3 r) {
    lw_inertia6 *p = &parent->articulated;
    lw_vec3 hx = lw_add(lw_row_x(i->h), lw_cross(r, lw_vec(i->m.xx, i->m.xy, i->m.xz)));
    lw_vec3 hy = lw_add(lw_row_y(i->h), lw_cross(r, lw_vec(i->m.xy, i->m.yy, i->m.yz)));
    lw_vec3 hz = lw_add(lw_row_z(i->h), lw_cross(r, lw_vec(i->m.xz, i->m.yz, i->m.zz)));
    lw_mat3 h = {hx.x, hx.y, hx.z, hy.x, hy.y, hy.z, hz.x, hz.y, hz.z};
    lw_vec3 ax = lw_cross(r, lw_column_x(i->h)), bx = lw_cross(r, lw_column_x(h));
    lw_vec3 ay = lw_cross(r, lw_column_y(i->h)), by = lw_cross(r, lw_column_y(h));
    lw_vec3 az = lw_cross(r, lw_column_z(i->h)), bz = lw_cross(r, lw_column_z(h));
    lw_sym3 j = {i->j.xx + (bx.x + ax.x), i->j.yy + (by.y + ay.y), i->j.zz + (bz.z + az.z),
                 i->j.xy + (by.x + ax.y), i->j.xz + (bz.x + ax.z), i->j.yz + (bz.y + ay.z)};
    p->m = sym_add(p->m, i->m);
    p->j = sym_add(p->j, j);
    p->h.xx += h.xx, p->h.xy += h.xy, p->h.xz += h.xz;
    p->h.yx += h.yx, p->h.yy += h.yy, p->h.yz += h.yz;
    p->h.zx += h.zx, p->h.zy += h.zy, p->h.zz += h.zz;
    parent->bias_force.linear = lw_add(parent->bias_force.linear, f.linear);
    parent->bias_force.angular = lw_add(parent->bias_force.angular,
                                        lw_add(f.angular, lw_cross(r, f.linear)));
}

static int inward(lw_multibody *mb, lw_link *l, const double *joint_force) {
    lw_inertia6 inertia = l->articulated;
    lw_spatial force = l->bias_force;
    int status = eliminate(l, &inertia, &force, joint_force);
    if (status || l->parent < 0) return status;
    lw_link *parent = &mb->link[l->parent];
    lw_spatial moved = inertia_times(&inertia, l->bias);
    add_to_parent(parent, &inertia, spatial_axpy(1.0, moved, force), l->offset);
    parent->mass_scale += l->mass_scale;
    parent->inertia_scale += l->inertia_scale + 2.0 * l->mass_scale * lw_dot(l->offset, l->offset);
    return LW_OK;
}

/* ---- from the roots to the leaves ---- */

static void outward(const lw_multibody *mb, lw_link *l, lw_spatial a, int with_bias, double *joint_acceleration) {
    if (l->parent >= 0) {
        lw_spatial base = mb->link[l->parent].acceleration;
        a.angular = lw_add(a.angular, base.angular);
        a.linear = lw_add(a.linear, lw_add(base.linear, lw_cross(base.angular, l->offset)));
    }
    for (int k = l->columns; k < l->freedoms; ++k) joint_acceleration[l->v + k] = 0.0; /* locked */
    for (int k = l->columns - 1; k >= 0; --k) {
        lw_column *c = &l->column[k];
        int given = l->prescribed >> k & 1;
        double own = given ? (with_bias ? c->given : 0.0) : (c->force - power(c->u, a)) * c->inverse;
        joint_acceleration[l->v + k] = own;
        a = spatial_axpy(own, c->s, a);
        if (given) c->effort = power(c->u, a) - c->force;
    }
    l->acceleration = a;
}

void lw_outward(lw_multibody *mb, int with_bias, double *joint_acceleration) {
    static const lw_spatial none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int i = 0; i < mb->n; ++i)
        outward(mb, &mb->link[i], with_bias ? mb->link[i].bias : none, with_bias, joint_acceleration);
}

int lw_tree_accelerations(lw_multibody *mb, const double *q, const double *v, const double *wrench,
                          double *joint_acceleration, lw_fault *fault) {
    lw_kinematics(mb, q, v);
    for (int i = 0; i < mb->n; ++i) start(&mb->link[i], mb->gravity, wrench + 6 * mb->link[i].body);
    if (mb->forces) {
        int status = lw_elements_load(mb, mb, q, fault);
        if (status) return status;
        lw_prescribe_accelerations(mb, 0);
        for (int i = 0; i < mb->n; ++i)
            mb->link[i].bias_force = spatial_axpy(-1.0, mb->load[i], mb->link[i].bias_force);
    }
    for (int i = mb->n - 1; i >= 0; --i) {
        lw_link *l = &mb->link[i];
        double joint_force[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        if (l->sprung || l->damped || l->driven) lw_joint_force(mb, l, q, v, joint_force);
        int status = inward(mb, l, joint_force);
        fault->item = l->body;
        if (status) return status;
    }
    lw_outward(mb, 1, joint_acceleration);
    return mb->forces ? lw_elements_check(mb, fault) : LW_OK;
}

int lw_accelerations(lw_multibody *mb, const double *q, const double *v, const double *wrench,
                     double *joint_acceleration, lw_fault *fault) {
    if (mb->formulation) return mb->formulation->accelerations(mb, q, v, wrench, joint_acceleration, fault);
    int status = lw_tree_accelerations(mb, q, v, wrench, joint_acceleration, fault);
    if (!status && mb->rows) lw_delassus_close(mb, joint_acceleration);
    return status;
}

/* ---- with the added inertia ---- */

void lw_bind_added(lw_multibody *mb, const double *added_inertia) {
    for (int i = 0; i < mb->n; ++i) {
        lw_link *l = &mb->link[i];
        l->added = NULL;
        for (int k = 0; added_inertia && k < 36; ++k)
            if (added_inertia[36 * l->body + k] != 0.0) l->added = added_inertia + 36 * l->body;
    }
}

lw_spatial lw_total_wrench(const lw_link *l, const double *wrench) {
    lw_spatial total = {lw_load3(wrench + 6 * l->body), lw_load3(wrench + 6 * l->body + 3)};
    if (!l->added) return total;
    lw_inertia6 added = added_blocks(l->added);
    lw_spatial a = {lw_mat_tvec(l->rotation, l->acceleration.linear),
                    lw_mat_tvec(l->rotation, l->acceleration.angular)};
    lw_spatial f = inertia_times(&added, a);
    total.linear = lw_sub(total.linear, lw_mat_vec(l->rotation, f.linear));
    total.angular = lw_sub(total.angular, lw_mat_vec(l->rotation, f.angular));
    return total;
}

double lw_wrench_power(const lw_multibody *mb, const double *wrench) {
    double sum = 0.0;
    for (int i = 0; i < mb->n; ++i)
        sum += power(lw_total_wrench(&mb->link[i], wrench), mb->link[i].velocity);
    return sum;
}

/* ---- for callers ---- */

static void store6(double *p, lw_spatial s) {
    lw_store3(p, s.linear);
    lw_store3(p + 3, s.angular);
}

lw_spatial lw_joint_reaction(const lw_link *l) {
    lw_spatial f = spatial_axpy(1.0, l->bias_force, inertia_times(&l->articulated, l->acceleration));
    f.angular = lw_add(f.angular, lw_cross(l->arm, f.linear));
    return f;
}

/* The closures' forces go among the wrenches, so that the joints of the tree are seen to transmit them. */
int lw_loaded_accelerations(lw_multibody *mb, const double *q, const double *v, const double *wrench,
                            double *joint_acceleration, double *closure_load, lw_fault *fault) {
    int status = lw_accelerations(mb, q, v, wrench, joint_acceleration, fault);
    if (status || !mb->rows) return status;
    memcpy(mb->loaded, wrench, 6 * (size_t)mb->n * sizeof(double));
    lw_closure_forces(mb, mb->loaded, closure_load);
    return lw_tree_accelerations(mb, q, v, mb->loaded, joint_acceleration, fault);
}

static void store_elements(lw_multibody *mb, const lw_evaluation *e) {
    double supplied = 0.0, dissipated = 0.0;
    lw_elements_power(mb, &supplied, &dissipated);
    for (int32_t i = 0; i < mb->forces; ++i) {
        const lw_multibody *joints = mb->formulation && mb->element[i].type == LW_ACTUATOR ? mb->formulation->tree : mb;
        e->effort[i] = joints->element[i].effort;
        e->power[i] = joints->element[i].power;
    }
}

int lw_multibody_evaluate(lw_multibody *mb, const double *state, double time, const double *wrench,
                          const double *added_inertia, const lw_evaluation *e, lw_fault *fault) {
    int status = lw_inputs_check(mb, state, 1, wrench, added_inertia, fault);
    if (status) return status;
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_bind_added(mb, added_inertia);
    if ((status = lw_take_time(mb, time, fault))) return status;
    for (int k = 0; k < mb->nv; ++k) e->joint_acceleration[k] = 0.0;
    status = lw_loaded_accelerations(mb, state, state + mb->nq, wrench, e->joint_acceleration,
                                     e->closure_reaction, fault);
    if (status) return status;
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        store6(e->acceleration + 6 * l->body, l->acceleration);
        store6(e->reaction + 6 * l->body, lw_joint_reaction(l));
        store6(e->total_wrench + 6 * l->body, lw_total_wrench(l, wrench));
    }
    store_elements(mb, e);
    if (mb->formulation && mb->formulation->closure_reactions)
        mb->formulation->closure_reactions(mb, e->closure_reaction);
    return LW_OK;
}

/* ---- impulses ---- */

/* Joint velocities that bodies at rest get from impulses (n,6) at their COMs; after lw_kinematics without velocity. */
int lw_impulse_response(lw_multibody *mb, const double *impulse, double *joint_velocity, lw_fault *fault) {
    static const lw_vec3 none = {0.0, 0.0, 0.0};
    static const double calm[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
    lw_prescribe_accelerations(mb, 1);
    for (int i = 0; i < mb->n; ++i) start(&mb->link[i], none, impulse + 6 * mb->link[i].body);
    for (int i = mb->n - 1; i >= 0; --i) {
        int status = inward(mb, &mb->link[i], calm);
        fault->item = mb->link[i].body;
        if (status) return status;
    }
    lw_outward(mb, 0, joint_velocity);
    return LW_OK;
}

int lw_multibody_repeat(lw_multibody *mb, const double *state, int32_t repeats) {
    lw_fault fault = {0, 0.0};
    int status = LW_OK;
    for (int k = 0; k < 6 * mb->n; ++k) mb->wrench[k] = 0.0;
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_bind_added(mb, NULL);
    status = lw_take_time(mb, 0.0, &fault);
    for (int32_t k = 0; k < repeats && !status; ++k)
        status = lw_accelerations(mb, state, state + mb->nq, mb->wrench, mb->trial, &fault);
    return status;
}
