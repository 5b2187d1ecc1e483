/* Springs and dampers of the joints: README, section Springs and dampers. */
#include "lw_model.h"

/* Turn of a spherical or free joint from its rest. */
static lw_vec3 turned(const lw_multibody *mb, const lw_link *l, const double *q) {
    int first = l->q + l->translations;
    return lw_rotation_vector(lw_quat_mul(lw_quat_conj(lw_load4(mb->rest + first)), lw_load4(q + first)));
}

/* (1 - x cot x) / (4 x x) with x half of the angle: the second-order term of the inverse of the
 * differential of the rotation vector. */
static double second_order(double angle) {
    double x = 0.5 * angle;
    if (x < 1e-2) return (1.0 + x * x * (1.0 / 15.0)) / 12.0;
    return (1.0 - x * cos(x) / sin(x)) / (angle * angle);
}

/* Minus the gradient of the energy 1/2 phi K phi; equals -K phi where the three stiffnesses are equal. */
static void rotation_spring(const lw_multibody *mb, const lw_link *l, const double *q, double *force) {
    const double *k = mb->stiffness + l->v + l->translations;
    lw_vec3 phi = turned(mb, l, q), pull = lw_vec(k[0] * phi.x, k[1] * phi.y, k[2] * phi.z);
    lw_vec3 across = lw_cross(phi, pull);
    lw_vec3 torque = lw_sub(lw_scale(0.5, across), pull);
    torque = lw_sub(torque, lw_scale(second_order(lw_norm(phi)), lw_cross(phi, across)));
    lw_store3(force, torque);
}

void lw_joint_force(const lw_multibody *mb, const lw_link *l, const double *q, const double *v,
                    double *force) {
    for (int k = 0; k < l->columns; ++k) force[k] = 0.0;
    if (l->sprung) {
        int rotation = l->type == LW_SPHERICAL || l->type == LW_FREE;
        for (int k = 0; k < (rotation ? l->translations : l->columns); ++k)
            force[k] = -mb->stiffness[l->v + k] * (q[l->q + k] - mb->rest[l->q + k]);
        if (rotation) rotation_spring(mb, l, q, force + l->translations);
    }
    if (l->damped)
        for (int k = 0; k < l->columns; ++k) force[k] -= mb->damping[l->v + k] * v[l->v + k];
    if (l->driven) lw_elements_drive(mb, l, q, v, force);
}

static double link_energy(const lw_multibody *mb, const lw_link *l, const double *q) {
    const double *k = mb->stiffness + l->v;
    int rotation = l->type == LW_SPHERICAL || l->type == LW_FREE;
    double energy = 0.0;
    for (int i = 0; i < (rotation ? l->translations : l->freedoms); ++i) {
        double stretch = q[l->q + i] - mb->rest[l->q + i];
        energy += 0.5 * k[i] * stretch * stretch;
    }
    if (!rotation) return energy;
    lw_vec3 phi = turned(mb, l, q);
    k += l->translations;
    return energy + 0.5 * (k[0] * phi.x * phi.x + k[1] * phi.y * phi.y + k[2] * phi.z * phi.z);
}

double lw_spring_energy(const lw_multibody *mb, const double *q) {
    double energy = 0.0;
    if (mb->formulation) return mb->formulation->spring_energy(mb, q);
    for (int i = 0; i < mb->n; ++i)
        if (mb->link[i].sprung) energy += link_energy(mb, &mb->link[i], q);
    return energy;
}

double lw_damper_power(const lw_multibody *mb, const double *v) {
    double power = 0.0;
    if (mb->formulation) return mb->formulation->damper_power(mb, v);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        if (!l->damped) continue;
        for (int k = l->v; k < l->v + l->columns; ++k) power += mb->damping[k] * v[k] * v[k];
    }
    return power;
}
