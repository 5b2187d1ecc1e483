/* Joint coordinates from the poses of two bodies; springs and dampers, which are given in them. */
#include "lw_constraints.h"

static const lw_vec3 zero = {0.0, 0.0, 0.0};
static const lw_quat no_rotation = {1.0, 0.0, 0.0, 0.0};

/* The parent's side of the joint of link i in W; the world does not move. */
typedef struct {
    lw_vec3 com, point, linear, angular;
    lw_mat3 frame;
    lw_quat orientation;
} lw_base;

static lw_base base_of(const lw_multibody *mb, const lw_link *joint) {
    lw_base b = {zero, joint->parent_point, zero, zero, joint->parent_matrix, no_rotation};
    if (joint->parent >= 0) {
        const lw_link *l = &mb->link[joint->parent];
        b.com = l->position;
        b.point = lw_add(l->position, lw_mat_vec(l->rotation, joint->parent_point));
        b.linear = l->velocity.linear;
        b.angular = l->velocity.angular;
        b.frame = lw_mat_mul(l->rotation, joint->parent_matrix);
        b.orientation = l->orientation;
    }
    b.orientation = lw_quat_mul(b.orientation, joint->parent_quat);
    return b;
}

static lw_vec3 joint_arm(const lw_link *joint, const lw_link *child) {
    return lw_mat_vec(child->rotation, joint->child_point);
}

/* Angle about z of a turn, next to what it was: a turn says it up to 2 pi. */
static double unwrapped(lw_quat turn, double before) {
    return before + remainder(2.0 * atan2(turn.z, turn.w) - before, 8.0 * atan(1.0));
}

static void coordinates(lw_maximal *m, const lw_multibody *mb, int32_t i, const double *state_q) {
    const lw_link *joint = &m->tree->link[i], *child = &mb->link[i];
    lw_base b = base_of(mb, joint);
    lw_vec3 point = lw_add(child->position, joint_arm(joint, child));
    lw_vec3 velocity = lw_add(child->velocity.linear, lw_cross(child->velocity.angular, joint_arm(joint, child)));
    lw_vec3 carried = lw_add(b.linear, lw_cross(b.angular, lw_sub(point, b.com)));
    lw_vec3 slide = lw_mat_tvec(b.frame, lw_sub(point, b.point));
    lw_vec3 speed = lw_mat_tvec(b.frame, lw_sub(velocity, carried));
    lw_vec3 turning = lw_sub(child->velocity.angular, b.angular);
    lw_quat frame = lw_quat_mul(child->orientation, lw_quat_conj(joint->child_quat_inverse));
    lw_quat turn = lw_quat_mul(lw_quat_conj(b.orientation), frame);
    double *q = m->q + joint->q, *v = m->v + joint->v;
    switch (joint->type) {
    case LW_REVOLUTE:
        q[0] = unwrapped(turn, state_q[m->turn[i]]), v[0] = lw_dot(lw_column_z(b.frame), turning);
        return;
    case LW_PRISMATIC:
        q[0] = slide.z, v[0] = speed.z;
        return;
    case LW_PLANAR:
        q[0] = slide.x, v[0] = speed.x;
        q[1] = slide.y, v[1] = speed.y;
        q[2] = unwrapped(turn, state_q[m->turn[i]]), v[2] = lw_dot(lw_column_z(b.frame), turning);
        return;
    case LW_FREE:
        lw_store3(q, slide), q += 3;
        lw_store3(v, speed), v += 3;
        /* fall through */
    case LW_SPHERICAL:
        lw_store4(q, turn);
        lw_store3(v, lw_mat_tvec(lw_quat_matrix(frame), turning));
        return;
    default: return; /* LW_FIXED */
    }
}

void lw_joint_coordinates(lw_maximal *m, const lw_multibody *mb, const double *q) {
    for (int32_t i = 0; i < m->n; ++i) coordinates(m, mb, i, q);
}

/* Force and torque of springs and dampers on the child, at its point: translations along the axes of the parent's
 * frame, turns about those of the parent's, or of the child's if there are three. */
static lw_spatial load_of(lw_maximal *m, const lw_link *joint, const lw_link *child, lw_mat3 frame) {
    double f[6];
    lw_spatial load = {zero, zero};
    lw_mat3 axes = frame;
    lw_joint_force(m->tree, joint, m->q, m->v, f);
    if (joint->type == LW_PRISMATIC) load.linear = lw_scale(f[0], lw_column_z(frame));
    if (joint->type == LW_REVOLUTE) load.angular = lw_scale(f[0], lw_column_z(frame));
    if (joint->type == LW_PLANAR) load.angular = lw_scale(f[2], lw_column_z(frame));
    if (joint->type == LW_PLANAR) load.linear = lw_mat_vec(frame, lw_vec(f[0], f[1], 0.0));
    if (joint->type == LW_FREE) load.linear = lw_mat_vec(frame, lw_load3(f));
    if (joint->type == LW_SPHERICAL || joint->type == LW_FREE) {
        axes = lw_mat_mul(child->rotation, joint->child_matrix);
        load.angular = lw_mat_vec(axes, lw_load3(f + joint->translations));
    }
    return load;
}

void lw_joint_loads(lw_maximal *m, const lw_multibody *mb, const double *q) {
    for (int32_t i = 0; i < m->n; ++i) {
        const lw_link *joint = &m->tree->link[i], *child = &mb->link[i];
        m->load[i].linear = m->load[i].angular = zero;
        if (!joint->sprung && !joint->damped && !joint->driven) continue;
        coordinates(m, mb, i, q);
        lw_base b = base_of(mb, joint);
        lw_vec3 arm = joint_arm(joint, child);
        lw_spatial load = load_of(m, joint, child, b.frame);
        m->load[i] = load;
        m->force[i].linear = lw_add(m->force[i].linear, load.linear);
        m->force[i].angular = lw_add(m->force[i].angular, lw_add(load.angular, lw_cross(arm, load.linear)));
        if (joint->parent < 0) continue;
        lw_spatial *back = &m->force[joint->parent];
        arm = lw_sub(lw_add(child->position, arm), b.com);
        back->linear = lw_sub(back->linear, load.linear);
        back->angular = lw_sub(back->angular, lw_add(load.angular, lw_cross(arm, load.linear)));
    }
}
