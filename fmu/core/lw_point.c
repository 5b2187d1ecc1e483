/* What is written of an accepted state: all of it in one call. */
#include "lw_model.h"

#include <string.h>

static const double *happened(const lw_multibody *mb, const double *state) { return state + mb->nq + mb->nv + 1; }

static void twists(lw_multibody *mb, const double *state, double *twist) {
    lw_modes(mb, happened(mb, state));
    lw_kinematics(mb, state, state + mb->nq);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_store3(twist + 6 * l->body, l->velocity.linear);
        lw_store3(twist + 6 * l->body + 3, l->velocity.angular);
    }
}

static double dot3(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* How far the accepted twists are from the trial ones, and what the wrench does on the way between them. */
static void compare(const lw_multibody *mb, const lw_point *p) {
    double *difference = p->difference;
    p->measures->missed = p->measures->lost = 0.0;
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        const double *wrench = p->wrench + 6 * l->body;
        double *d = difference + 6 * l->body;
        lw_vec3 linear = lw_sub(l->velocity.linear, lw_load3(d)), angular = lw_sub(l->velocity.angular, lw_load3(d + 3));
        double inertia = (l->inertia.xx + l->inertia.yy + l->inertia.zz) / 3.0;
        lw_store3(d, linear);
        lw_store3(d + 3, angular);
        p->measures->missed += l->mass * lw_dot(linear, linear) + inertia * lw_dot(angular, angular);
        p->measures->lost += dot3(wrench, d) + dot3(wrench + 3, d + 3);
    }
}

static double largest_force(const lw_multibody *mb, const double *total_wrench) {
    double squared = 0.0;
    for (int i = 0; i < mb->n; ++i) {
        double own = dot3(total_wrench + 6 * i, total_wrench + 6 * i);
        if (!(own <= squared)) squared = own;
    }
    return sqrt(squared);
}

static void coordinates(lw_multibody *mb, const lw_point *p) {
    if (mb->formulation && mb->formulation->coordinates) {
        mb->formulation->coordinates(mb, p->state, p->q, p->v);
        return;
    }
    memcpy(p->q, p->state, (size_t)mb->nq * sizeof(double));
    memcpy(p->v, p->state + mb->nq, (size_t)mb->nv * sizeof(double));
}

int lw_multibody_point(lw_multibody *mb, const lw_point *p) {
    const lw_evaluation *e = &p->evaluation;
    size_t six = 6 * (size_t)mb->n * sizeof(double), forces = (size_t)mb->forces * sizeof(double);
    twists(mb, p->trial, p->difference);
    lw_multibody_motion(mb, p->state, p->position, p->orientation, p->linear, p->angular);
    compare(mb, p);
    int status = lw_multibody_evaluate(mb, p->state, p->time, p->wrench, p->added_inertia, e, p->fault);
    if (status) return status;
    memcpy(p->acceleration, e->acceleration, six);
    memcpy(p->reaction, e->reaction, six);
    memcpy(p->total_wrench, e->total_wrench, six);
    memcpy(p->closure_reaction, e->closure_reaction, 6 * (size_t)p->closures * sizeof(double));
    memcpy(p->effort, e->effort, forces);
    memcpy(p->power, e->power, forces);
    memcpy(p->event_time, happened(mb, p->state), (size_t)mb->events * sizeof(double));
    lw_multibody_energy(mb, p->state, &p->measures->kinetic, &p->measures->potential);
    coordinates(mb, p);
    p->measures->gap = lw_multibody_joint_gap(mb, p->position, p->orientation);
    p->measures->force = largest_force(mb, e->total_wrench);
    return LW_OK;
}
