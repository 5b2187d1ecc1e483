/* Velocities that change at once: README, section Events. */
#include "lw_model.h"

#include <string.h>

/* (M + A) times the twist of a body, in W. */
static void momentum(const lw_link *l, double *p) {
    lw_vec3 v = l->velocity.linear, w = l->velocity.angular;
    lw_vec3 linear = lw_scale(l->mass, v), angular = lw_sym_vec(lw_rotate_sym(l->rotation, l->inertia), w);
    if (l->added) {
        lw_vec3 own[2] = {lw_mat_tvec(l->rotation, v), lw_mat_tvec(l->rotation, w)};
        double six[6], sum[6];
        lw_store3(six, own[0]), lw_store3(six + 3, own[1]);
        for (int i = 0; i < 6; ++i) {
            sum[i] = 0.0;
            for (int j = 0; j < 6; ++j) sum[i] += l->added[6 * i + j] * six[j];
        }
        linear = lw_add(linear, lw_mat_vec(l->rotation, lw_load3(sum)));
        angular = lw_add(angular, lw_mat_vec(l->rotation, lw_load3(sum + 3)));
    }
    lw_store3(p, linear);
    lw_store3(p + 3, angular);
}

/* The nearest motion by kinetic energy in which the joint stands still: bodies at rest, given the momentum that
 * they had, with the joint locked. Leaves the joint locked. */
int lw_stop_joint(lw_multibody *mb, const double *q, double *v, lw_link *stopped, lw_fault *fault) {
    double *calm = mb->rate[2], *answer = mb->rate[3];
    size_t bytes = (size_t)mb->nv * sizeof(double);
    lw_kinematics(mb, q, v);
    for (int i = 0; i < mb->n; ++i) momentum(&mb->link[i], mb->loaded + 6 * mb->link[i].body);
    stopped->columns = 0;
    memset(calm, 0, bytes);
    memcpy(answer, v, bytes);
    lw_kinematics(mb, q, calm);
    int status = lw_impulse_response(mb, mb->loaded, answer, fault);
    memcpy(v, answer, bytes);
    memset(answer, 0, bytes);
    if (!status && mb->rows) {
        memcpy(calm, q, (size_t)mb->nq * sizeof(double)); /* closed already: v alone changes */
        status = lw_project(mb, calm, v, fault);
        memset(calm, 0, (size_t)(mb->nq + mb->nv) * sizeof(double));
    }
    return status;
}
