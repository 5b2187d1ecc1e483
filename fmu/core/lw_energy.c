/* Kinetic and potential energy. */
#include "lw_model.h"

void lw_multibody_energy(lw_multibody *mb, const double *state, double *kinetic, double *potential) {
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_kinematics(mb, state, state + mb->nq);
    *kinetic = 0.0;
    *potential = lw_spring_energy(mb, state) + lw_elements_energy(mb);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_vec3 w = lw_mat_tvec(l->rotation, l->velocity.angular);
        *kinetic += 0.5 * (l->mass * lw_dot(l->velocity.linear, l->velocity.linear) +
                           lw_dot(w, lw_sym_vec(l->inertia, w)));
        *potential -= l->mass * lw_dot(mb->gravity, l->position);
    }
}
