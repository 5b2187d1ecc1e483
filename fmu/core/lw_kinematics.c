/* Where the bodies are and how they move: README, section Kinematics. */
#include "lw_model.h"

static const lw_quat no_rotation = {1.0, 0.0, 0.0, 0.0};
static const lw_mat3 identity = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
static const lw_vec3 zero = {0.0, 0.0, 0.0};

/* Joint frame on the parent: its axes in W. */
LW_INLINE lw_mat3 parent_frame(const lw_link *l, const lw_link *parent) {
    if (!parent) return l->parent_matrix;
    return l->parent_rotated ? lw_mat_mul(parent->rotation, l->parent_matrix) : parent->rotation;
}

LW_INLINE lw_vec3 parent_frame_z(const lw_link *l, const lw_link *parent) {
    return parent ? lw_mat_vec(parent->rotation, l->axis) : l->axis;
}

LW_INLINE lw_quat parent_frame_quat(const lw_link *l, const lw_link *parent) {
    if (!parent) return l->parent_rotated ? l->parent_quat : no_rotation;
    return l->parent_rotated ? lw_quat_mul(parent->orientation, l->parent_quat) : parent->orientation;
}

LW_INLINE void set_translations(lw_link *l, lw_mat3 frame) {
    l->column[0].s.linear = lw_column_x(frame);
    l->column[1].s.linear = lw_column_y(frame);
    if (l->translations == 3) l->column[2].s.linear = lw_column_z(frame);
}

/* Rotation axes of spherical and free joints are those of the child-side joint frame. */
LW_INLINE void set_rotations(lw_link *l) {
    lw_mat3 frame = l->child_rotated ? lw_mat_mul(l->rotation, l->child_matrix) : l->rotation;
    lw_column *c = l->column + l->translations;
    c[0].s.angular = lw_column_x(frame);
    c[1].s.angular = lw_column_y(frame);
    c[2].s.angular = lw_column_z(frame);
}

LW_INLINE void orient(lw_link *l, lw_quat joint_frame) {
    l->orientation = l->child_rotated ? lw_quat_mul(joint_frame, l->child_quat_inverse) : joint_frame;
    l->rotation = lw_quat_matrix(l->orientation);
}

/* Set the rotation and the motion vectors (but for the lever arms); return the joint's translation. */
LW_INLINE lw_vec3 turn(lw_link *l, const lw_link *parent, const double *q) {
    lw_quat frame = parent_frame_quat(l, parent);
    lw_mat3 axes;
    switch (l->type) {
    case LW_REVOLUTE:
        orient(l, lw_quat_mul_z(frame, cos(0.5 * q[0]), sin(0.5 * q[0])));
        l->column[0].s.angular = parent_frame_z(l, parent);
        return zero;
    case LW_PRISMATIC:
        orient(l, frame);
        l->column[0].s.linear = parent_frame_z(l, parent);
        return lw_scale(q[0], l->column[0].s.linear);
    case LW_PLANAR:
        orient(l, lw_quat_mul_z(frame, cos(0.5 * q[2]), sin(0.5 * q[2])));
        axes = parent_frame(l, parent);
        set_translations(l, axes);
        l->column[2].s.angular = lw_column_z(axes);
        return lw_mat_vec(axes, lw_vec(q[0], q[1], 0.0));
    case LW_SPHERICAL:
        orient(l, lw_quat_mul(frame, lw_quat_unit(lw_load4(q))));
        set_rotations(l);
        return zero;
    case LW_FREE:
        orient(l, lw_quat_mul(frame, lw_quat_unit(lw_load4(q + 3))));
        axes = parent_frame(l, parent);
        set_translations(l, axes);
        set_rotations(l);
        return lw_mat_vec(axes, lw_load3(q));
    default: /* LW_FIXED */
        orient(l, frame);
        return zero;
    }
}

/* Set pose and motion vectors from the joint's coordinates. */
LW_INLINE void place(lw_link *l, const lw_link *parent, const double *q) {
    lw_vec3 slide = turn(l, parent, q);
    lw_vec3 hold = parent ? lw_mat_vec(parent->rotation, l->parent_point) : l->parent_point;
    l->arm = lw_neg(lw_mat_vec(l->rotation, l->child_point));
    l->offset = lw_add(lw_add(hold, slide), l->arm);
    l->position = parent ? lw_add(parent->position, l->offset) : l->offset;
    for (int k = l->translations; k < l->columns; ++k)
        l->column[k].s.linear = lw_cross(l->column[k].s.angular, l->arm);
}

/* Set velocity and bias acceleration. */
LW_INLINE void move(lw_link *l, const lw_link *parent, const double *v) {
    lw_vec3 slide = zero, turning = zero;
    for (int k = 0; k < l->translations; ++k)
        slide = lw_add(slide, lw_scale(v[k], l->column[k].s.linear));
    for (int k = l->translations; k < l->columns; ++k)
        turning = lw_add(turning, lw_scale(v[k], l->column[k].s.angular));
    if (!parent) {
        lw_vec3 swing = lw_cross(turning, l->arm);
        l->velocity.angular = turning;
        l->velocity.linear = lw_add(slide, swing);
        l->bias.angular = zero;
        l->bias.linear = lw_cross(turning, swing);
        return;
    }
    lw_vec3 base = parent->velocity.angular, w = lw_add(base, turning);
    lw_vec3 carried = lw_cross(base, lw_sub(l->offset, l->arm)); /* the joint's point, fixed on the parent */
    lw_vec3 swing = lw_cross(w, l->arm);
    l->velocity.angular = w;
    l->velocity.linear = lw_add(lw_add(parent->velocity.linear, carried), lw_add(slide, swing));
    l->bias.angular = lw_cross(base, turning);
    l->bias.linear = lw_add(lw_cross(base, lw_add(carried, lw_scale(2.0, slide))),
                            lw_add(lw_cross(l->bias.angular, l->arm), lw_cross(w, swing)));
}

void lw_kinematics(lw_multibody *mb, const double *q, const double *v) {
    for (int i = 0; i < mb->n; ++i) {
        lw_link *l = &mb->link[i];
        const lw_link *parent = l->parent < 0 ? NULL : &mb->link[l->parent];
        place(l, parent, q + l->q);
        move(l, parent, v + l->v);
    }
}

void lw_multibody_motion(lw_multibody *mb, const double *state, lw_unaligned *position,
                         lw_unaligned *orientation, lw_unaligned *linear, lw_unaligned *angular) {
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_kinematics(mb, state, state + mb->nq);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_store3(position + 3 * l->body, l->position);
        lw_store4(orientation + 4 * l->body, l->orientation);
        lw_store3(linear + 3 * l->body, l->velocity.linear);
        lw_store3(angular + 3 * l->body, l->velocity.angular);
    }
}

/* Distance of the joint's two points, without the directions in which the joint lets them part. */
static double gap(const lw_link *l, int32_t parent_body, const lw_unaligned *position,
                  const lw_unaligned *orientation) {
    lw_mat3 child = lw_quat_matrix(lw_load4(orientation + 4 * l->body)), parent = identity;
    lw_vec3 hold = l->parent_point;
    if (parent_body >= 0) {
        parent = lw_quat_matrix(lw_load4(orientation + 4 * parent_body));
        hold = lw_add(lw_load3(position + 3 * parent_body), lw_mat_vec(parent, l->parent_point));
    }
    lw_vec3 held = lw_add(lw_load3(position + 3 * l->body), lw_mat_vec(child, l->child_point));
    lw_vec3 parted = lw_sub(held, hold), axis = lw_mat_vec(parent, l->axis);
    double along = lw_dot(axis, parted);
    if (l->type == LW_FREE) return 0.0;
    if (l->type == LW_PLANAR) return fabs(along);
    if (l->type == LW_PRISMATIC) return lw_norm(lw_sub(parted, lw_scale(along, axis)));
    return lw_norm(parted);
}

double lw_multibody_joint_gap(const lw_multibody *mb, const lw_unaligned *position,
                              const lw_unaligned *orientation) {
    double largest = 0.0;
    if (mb->formulation && mb->formulation->tree) mb = mb->formulation->tree;
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        double own = gap(l, l->parent < 0 ? -1 : mb->link[l->parent].body, position, orientation);
        if (!(own <= largest)) largest = own; /* not a number stays visible */
    }
    for (int32_t i = 0; i < mb->closures; ++i) {
        double own = lw_closure_gap(mb, &mb->closure[i], position, orientation);
        if (!(own <= largest)) largest = own;
    }
    return largest;
}
