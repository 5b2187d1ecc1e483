/* Accelerations of bodies that are free but for the forces of their joints. */
#include "lw_maximal.h"

#include <string.h>

#include "lw_constraints.h"

static const lw_spatial none = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
static const lw_inertia6 no_inertia;

/* ---- accelerations ---- */

static lw_spatial own_force(const lw_multibody *mb, const lw_link *l, const double *wrench) {
    lw_vec3 w = l->velocity.angular;
    lw_vec3 momentum = lw_sym_vec(lw_rotate_sym(l->rotation, l->inertia), w);
    lw_spatial f = {lw_add(lw_scale(l->mass, mb->gravity), lw_load3(wrench + 6 * l->body)),
                    lw_sub(lw_load3(wrench + 6 * l->body + 3), lw_cross(w, momentum))};
    return f;
}

/* How much each row is to change: it stays as it is, or goes back to zero as a critically damped oscillator. */
static void want(lw_maximal *m, const lw_multibody *mb) {
    double rate = m->stabilisation == LW_BAUMGARTE ? 1.0 / m->time : 0.0;
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        for (int32_t k = c->row; k < c->row + c->rows; ++k) {
            const lw_constraint_row *r = &m->row[k];
            m->right[k] = -r->drift - rate * (2.0 * r->rate + rate * r->value);
            for (int side = 0; side < 2; ++side)
                if (c->link[side] >= 0)
                    m->right[k] -= lw_spatial_dot(r->on[side], mb->link[c->link[side]].acceleration);
        }
    }
}

/* Add what the multipliers do to the bodies. `bias_force` takes the force of the joint that carries the body, at
 * its point: where lw_multibody_evaluate looks for it, with nothing to add. */
static void join(const lw_maximal *m, lw_multibody *mb) {
    for (int32_t i = 0; i < m->constraints; ++i) {
        const lw_constraint *c = &m->constraint[i];
        for (int32_t k = c->row; k < c->row + c->rows; ++k)
            for (int side = 0; side < 2; ++side) {
                if (c->link[side] < 0) continue;
                lw_link *l = &mb->link[c->link[side]];
                l->acceleration = lw_spatial_axpy(m->multiplier[k], m->row[k].moved[side], l->acceleration);
                if (side == 1 && c->carries)
                    l->bias_force = lw_spatial_axpy(m->multiplier[k], m->row[k].on[1], l->bias_force);
            }
    }
}

static void set_reactions(const lw_maximal *m, lw_multibody *mb) {
    for (int32_t i = 0; i < m->n; ++i) {
        lw_link *l = &mb->link[i];
        lw_vec3 arm = lw_mat_vec(l->rotation, m->tree->link[i].child_point);
        l->bias_force.angular = lw_sub(l->bias_force.angular, lw_cross(arm, l->bias_force.linear));
        l->bias_force = lw_spatial_axpy(1.0, m->load[i], l->bias_force);
    }
}

/* Those on bodies here; actuators go with the joints. */
static int load_elements(lw_maximal *m, lw_multibody *mb, const double *q, lw_fault *fault) {
    if (!mb->forces) return LW_OK;
    m->tree->time = mb->time;
    lw_joint_coordinates(m, mb, q);
    return lw_elements_load(mb, m->tree, m->q, fault);
}

static int accelerations(lw_multibody *mb, const double *q, const double *v, const double *wrench,
                         double *joint_acceleration, lw_fault *fault) {
    lw_maximal *m = (lw_maximal *)mb->formulation;
    lw_maximal_follow(m, mb);
    lw_kinematics(mb, q, v);
    int status = lw_inverse_inertias(m, mb, fault);
    if (status || (status = load_elements(m, mb, q, fault))) return status;
    for (int32_t i = 0; i < m->n; ++i) {
        m->force[i] = own_force(mb, &mb->link[i], wrench);
        if (mb->forces) m->force[i] = lw_spatial_axpy(1.0, mb->load[i], m->force[i]);
        mb->link[i].bias_force = none;
    }
    lw_joint_loads(m, mb, q);
    if ((status = lw_elements_check(m->tree, fault))) return status;
    for (int32_t i = 0; i < m->n; ++i)
        mb->link[i].acceleration = lw_spatial_times(&m->inverse[i], m->force[i]);
    lw_constraint_equations(m, mb);
    lw_envelope_assemble(m);
    if ((status = lw_envelope_factor(m, fault))) return status;
    want(m, mb);
    lw_envelope_solve(m);
    join(m, mb);
    set_reactions(m, mb);
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_store3(joint_acceleration + l->v, l->acceleration.linear);
        lw_store3(joint_acceleration + l->v + 3, lw_mat_tvec(l->rotation, l->acceleration.angular));
    }
    return LW_OK;
}

static double spring_energy(const lw_multibody *mb, const double *q) {
    lw_maximal *m = (lw_maximal *)mb->formulation;
    lw_maximal_follow(m, mb);
    lw_joint_coordinates(m, mb, q);
    return lw_spring_energy(m->tree, m->q);
}

/* Of the velocities that the accelerations were last found at. */
static double damper_power(const lw_multibody *mb, const double *v) {
    (void)v;
    lw_maximal *m = (lw_maximal *)mb->formulation;
    return lw_damper_power(m->tree, m->v);
}

/* ---- in memory ---- */

static int turns(const lw_link *joint) { return joint->type == LW_REVOLUTE || joint->type == LW_PLANAR; }

typedef struct { size_t constraints, rows; } lw_count;

static lw_count count(const lw_multibody *tree) {
    lw_count found = {0, 0};
    for (int32_t i = 0; i < tree->n; ++i) {
        int32_t rows = lw_constraint_count(lw_constraint_kept(tree->link[i].type));
        found.constraints += rows > 0;
        found.rows += (size_t)rows;
    }
    found.constraints += (size_t)tree->closures;
    found.rows += (size_t)tree->rows;
    return found;
}

/* The matrix has room to be full; memory that is never touched costs nothing. */
size_t lw_maximal_size(const lw_multibody *tree) {
    lw_count c = count(tree);
    size_t n = (size_t)tree->n, doubles = c.rows * (c.rows + 1) + 3 * c.rows + (size_t)tree->nq + (size_t)tree->nv;
    size_t integers = 2 * n + 1 + 2 * c.constraints;
    return sizeof(lw_maximal) + c.constraints * sizeof(lw_constraint) + c.rows * sizeof(lw_constraint_row) +
           n * (sizeof(lw_sym3) + sizeof(lw_inertia6) + 2 * sizeof(lw_spatial)) + doubles * sizeof(double) +
           integers * sizeof(int32_t);
}

static void lay_out(lw_maximal *m, lw_count c) {
    size_t n = (size_t)m->n, half = c.rows * (c.rows + 1) / 2;
    m->constraint = (lw_constraint *)(m + 1);
    m->row = (lw_constraint_row *)(m->constraint + c.constraints);
    m->inverse_inertia = (lw_sym3 *)(m->row + c.rows);
    m->inverse = (lw_inertia6 *)(m->inverse_inertia + n);
    m->force = (lw_spatial *)(m->inverse + n);
    m->load = m->force + n;
    double *next = (double *)(m->load + n);
    m->right = next, next += c.rows;
    m->multiplier = next, next += c.rows;
    m->residual = next, next += c.rows;
    m->q = next, next += m->tree->nq;
    m->v = next, next += m->tree->nv;
    m->matrix = next, next += half;
    m->factor = next, next += half;
    m->turn = (int32_t *)next;
    m->touching = m->turn + n;
    m->touch = m->touching + n + 1;
}

/* From the leaves to the roots: the factor of a chain then has no more elements than its matrix. What closes
 * loops comes last. */
static void set_constraints(lw_maximal *m) {
    lw_constraint *c = m->constraint;
    int32_t row = 0;
    for (int32_t i = m->n - 1; i >= 0; --i) {
        const lw_link *l = &m->tree->link[i];
        int32_t kept = lw_constraint_kept(l->type), rows = lw_constraint_count(kept);
        if (!rows) continue;
        lw_constraint own = {kept, {l->parent, i}, row, rows, l->body, 1, {l->parent_point, l->child_point},
                             {l->parent_matrix, l->child_matrix}, 0.0};
        *c++ = own;
        row += rows;
    }
    for (int32_t i = 0; i < m->tree->closures; ++i) {
        const lw_closure *l = &m->tree->closure[i];
        lw_constraint own = {l->kept, {l->link[0], l->link[1]}, row, l->rows, i, 0, {l->point[0], l->point[1]},
                             {l->rotation[0], l->rotation[1]}, l->length};
        *c++ = own;
        row += l->rows;
    }
}

static void set_touches(lw_maximal *m) {
    int32_t next = 0;
    for (int32_t link = 0; link < m->n; ++link) {
        m->touching[link] = next;
        for (int32_t i = 0; i < m->constraints; ++i)
            for (int side = 0; side < 2; ++side)
                if (m->constraint[i].link[side] == link) m->touch[next++] = 2 * i + side;
    }
    m->touching[m->n] = next;
}

void lw_maximal_attach(void *memory, lw_multibody *bodies, lw_multibody *tree, int32_t stabilisation,
                       double time) {
    lw_maximal *m = memory;
    lw_count c = count(tree);
    memset(m, 0, sizeof *m);
    m->formulation.accelerations = accelerations;
    m->formulation.settle = lw_maximal_settle;
    m->formulation.spring_energy = spring_energy;
    m->formulation.damper_power = damper_power;
    m->formulation.tree = tree;
    m->formulation.occasion = lw_maximal_occasion;
    m->formulation.closure_reactions = lw_maximal_closure_reactions;
    m->formulation.coordinates = lw_maximal_coordinates;
    m->tree = tree;
    m->n = tree->n;
    m->constraints = (int32_t)c.constraints;
    m->rows = (int32_t)c.rows;
    m->redundant = tree->closures > 0;
    m->stabilisation = stabilisation;
    m->time = time;
    lay_out(m, c);
    set_constraints(m);
    set_touches(m);
    lw_envelope_build(m);
    for (int32_t i = 0, angle = 7 * m->n; i < m->n; ++i) {
        lw_sym3 singular = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        if (!lw_inverse_sym3(bodies->link[i].inertia, &m->inverse_inertia[i])) m->inverse_inertia[i] = singular;
        m->turn[i] = turns(&tree->link[i]) ? angle++ : -1;
        bodies->link[i].articulated = no_inertia;
    }
    bodies->formulation = &m->formulation;
}

lw_spatial lw_maximal_closure_reaction(const lw_maximal *m, const lw_multibody *bodies, int32_t closure) {
    const lw_constraint *c = &m->constraint[m->constraints - m->tree->closures + closure];
    lw_spatial f = none;
    for (int32_t r = c->row; r < c->row + c->rows; ++r) f = lw_spatial_axpy(m->multiplier[r], m->row[r].on[1], f);
    lw_vec3 arm = c->point[1];
    if (c->link[1] >= 0) arm = lw_mat_vec(bodies->link[c->link[1]].rotation, arm);
    f.angular = lw_sub(f.angular, lw_cross(arm, f.linear));
    return f;
}

void lw_maximal_closure_reactions(const lw_multibody *bodies, double *reaction) {
    const lw_maximal *m = (const lw_maximal *)bodies->formulation;
    for (int32_t i = 0; i < m->tree->closures; ++i) {
        lw_spatial f = lw_maximal_closure_reaction(m, bodies, i);
        lw_store3(reaction + 6 * i, f.linear);
        lw_store3(reaction + 6 * i + 3, f.angular);
    }
}

/* ---- between the coordinates of the tree and those of the bodies ---- */

void lw_maximal_start(lw_multibody *bodies, const double *tree_state, double *state) {
    const lw_maximal *m = (const lw_maximal *)bodies->formulation;
    lw_multibody *tree = m->tree;
    lw_modes(tree, tree_state + tree->nq + tree->nv + 1);
    lw_kinematics(tree, tree_state, tree_state + tree->nq);
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *from = &tree->link[i], *to = &bodies->link[i];
        double *v = state + bodies->nq + to->v;
        lw_store3(state + to->q, from->position);
        lw_store4(state + to->q + 3, from->orientation);
        lw_store3(v, from->velocity.linear);
        lw_store3(v + 3, lw_mat_tvec(from->rotation, from->velocity.angular));
        if (m->turn[i] >= 0) state[m->turn[i]] = tree_state[from->q + (from->type == LW_PLANAR ? 2 : 0)];
    }
    int memory = bodies->nq + bodies->nv, tree_memory = tree->nq + tree->nv;
    state[memory] = 0.0;
    memcpy(state + memory + 1, tree_state + tree_memory + 1, (size_t)tree->events * sizeof(double));
}

void lw_maximal_coordinates(lw_multibody *bodies, const double *state, lw_unaligned *q, lw_unaligned *v) {
    lw_maximal *m = (lw_maximal *)bodies->formulation;
    lw_modes(bodies, state + bodies->nq + bodies->nv + 1);
    lw_maximal_follow(m, bodies);
    lw_kinematics(bodies, state, state + bodies->nq);
    memset(m->q, 0, (size_t)(m->tree->nq + m->tree->nv) * sizeof(double)); /* v follows: none is left from others */
    lw_joint_coordinates(m, bodies, state);
    memcpy(q, m->q, (size_t)m->tree->nq * sizeof(double));
    memcpy(v, m->v, (size_t)m->tree->nv * sizeof(double));
}
