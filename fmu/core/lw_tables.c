/* Are the tables a mechanism? Each check answers with the field (as status) and the row (as fault). */
#include "lw_model.h"

static const int joint_nq[LW_JOINT_TYPES] = {0, 1, 1, 3, 4, 7};
static const int joint_nv[LW_JOINT_TYPES] = {0, 1, 1, 3, 3, 6};

int lw_joint_nq(int type) { return type >= 0 && type < LW_JOINT_TYPES ? joint_nq[type] : -1; }
int lw_joint_nv(int type) { return type >= 0 && type < LW_JOINT_TYPES ? joint_nv[type] : -1; }

static int all_finite(const double *values, int count) {
    for (int i = 0; i < count; ++i)
        if (!isfinite(values[i])) return 0;
    return 1;
}

static int is_rotation(const double *r) {
    lw_mat3 m = lw_load9(r);
    lw_vec3 x = lw_load3(r), y = lw_load3(r + 3), z = lw_load3(r + 6);
    double tolerance = 1e-9, determinant = lw_dot(lw_cross(x, y), z);
    return all_finite(r, 9) && fabs(m.xx * m.yx + m.xy * m.yy + m.xz * m.yz) < tolerance &&
           fabs(lw_dot(x, z)) < tolerance && fabs(lw_dot(y, z)) < tolerance &&
           fabs(lw_dot(x, x) - 1.0) < tolerance && fabs(lw_dot(y, y) - 1.0) < tolerance &&
           fabs(lw_dot(z, z) - 1.0) < tolerance && determinant > 0.0;
}

/* Position of body b in the order, -1 if it is not there. */
static int place(const lw_tables *t, int b) {
    for (int k = 0; k < t->n; ++k)
        if (t->order[k] == b) return k;
    return -1;
}

static int check_tree(const lw_tables *t, int i) {
    if (t->parent[i] < -1 || t->parent[i] >= t->n) return LW_BAD_PARENT;
    int own = place(t, i);
    if (own < 0) return LW_BAD_ORDER;
    if (t->parent[i] >= 0 && place(t, t->parent[i]) >= own) return LW_BAD_ORDER;
    return LW_OK;
}

static int overlap(int a, int size_a, int b, int size_b) { return a < b + size_b && b < a + size_a; }

/* The type whose coordinates a joint has room for: a free one if it may be released. */
static int roomy_type(const lw_tables *t, int i) {
    for (int e = 0; e < t->events; ++e)
        if (t->event_joint[e] == i && t->event_action[e] == LW_RELEASE) return LW_FREE;
    return t->joint_type[i];
}

static int check_coordinates(const lw_tables *t, int i) {
    if (lw_joint_nq(t->joint_type[i]) < 0) return LW_BAD_JOINT_TYPE;
    int nq = lw_joint_nq(roomy_type(t, i)), nv = lw_joint_nv(roomy_type(t, i));
    if (t->q_index[i] < 0 || t->q_index[i] > t->nq - nq) return LW_BAD_Q_INDEX;
    if (t->v_index[i] < 0 || t->v_index[i] > t->nv - nv) return LW_BAD_V_INDEX;
    for (int k = 0; k < i; ++k) {
        int other_nq = lw_joint_nq(roomy_type(t, k)), other_nv = lw_joint_nv(roomy_type(t, k));
        if (nq && other_nq && overlap(t->q_index[i], nq, t->q_index[k], other_nq)) return LW_BAD_Q_INDEX;
        if (nv && other_nv && overlap(t->v_index[i], nv, t->v_index[k], other_nv)) return LW_BAD_V_INDEX;
    }
    return LW_OK;
}

static int check_frames(const lw_tables *t, int i) {
    if (!all_finite(t->parent_point + 3 * i, 3)) return LW_BAD_PARENT_POINT;
    if (!is_rotation(t->parent_rotation + 9 * i)) return LW_BAD_PARENT_ROTATION;
    if (!all_finite(t->child_point + 3 * i, 3)) return LW_BAD_CHILD_POINT;
    if (!is_rotation(t->child_rotation + 9 * i)) return LW_BAD_CHILD_ROTATION;
    return LW_OK;
}

/* Zero is allowed for both: a massless body may move by its added inertia. */
static int check_mass(const lw_tables *t, int i) {
    const double *inertia = t->inertia + 6 * i;
    if (!isfinite(t->mass[i]) || t->mass[i] < 0.0) return LW_BAD_MASS;
    if (!all_finite(inertia, 6) || inertia[0] < 0.0 || inertia[1] < 0.0 || inertia[2] < 0.0)
        return LW_BAD_INERTIA;
    return LW_OK;
}

/* The rest of a rotation is a quaternion that must have a direction. */
static int check_rest(const lw_tables *t, int i) {
    int type = t->joint_type[i];
    if (type != LW_SPHERICAL && type != LW_FREE) return LW_OK;
    const double *quat = t->rest + t->q_index[i] + lw_joint_nq(type) - 4;
    double square = quat[0] * quat[0] + quat[1] * quat[1] + quat[2] * quat[2] + quat[3] * quat[3];
    return square > 0.0 ? LW_OK : LW_BAD_REST;
}

static int check_row(const lw_tables *t, int i) {
    int (*const checks[])(const lw_tables *, int) = {check_tree, check_coordinates, check_frames, check_mass,
                                                     check_rest};
    for (size_t k = 0; k < sizeof checks / sizeof checks[0]; ++k) {
        int status = checks[k](t, i);
        if (status) return status;
    }
    return LW_OK;
}

static int check_coordinate_values(const lw_tables *t, lw_fault *fault) {
    for (int k = 0; k < t->nv; ++k) {
        fault->item = k;
        if (!isfinite(t->stiffness[k])) return LW_BAD_STIFFNESS;
        if (!isfinite(t->damping[k])) return LW_BAD_DAMPING;
    }
    for (int k = 0; k < t->nq; ++k) {
        fault->item = k;
        if (!isfinite(t->rest[k])) return LW_BAD_REST;
    }
    return LW_OK;
}

/* A distance stands alone and is not zero; anything else keeps at least one direction. */
static int check_closure(const lw_tables *t, int i) {
    int32_t kept = t->closure_rows[i];
    const int32_t *body = t->closure_body + 2 * i;
    if (body[0] < -1 || body[0] >= t->n || body[1] < -1 || body[1] >= t->n || body[0] == body[1])
        return LW_BAD_CLOSURE_BODY;
    if (kept < 1 || kept > LW_DISTANCE) return LW_BAD_CLOSURE_ROWS;
    if (!all_finite(t->closure_point + 6 * i, 6)) return LW_BAD_CLOSURE_POINT;
    for (int side = 0; side < 2; ++side)
        if (!is_rotation(t->closure_rotation + 18 * i + 9 * side)) return LW_BAD_CLOSURE_ROTATION;
    if (kept == LW_DISTANCE && !(t->closure_length[i] > 0.0 && isfinite(t->closure_length[i])))
        return LW_BAD_CLOSURE_LENGTH;
    return LW_OK;
}

/* Position, speed and stops need a joint with one degree of freedom; a closure can only be released. */
static int check_event(const lw_tables *t, int i) {
    int32_t joint = t->event_joint[i], action = t->event_action[i], occasion = t->event_occasion[i];
    if (joint < 0 || joint >= t->n + t->closures) return LW_BAD_EVENT_JOINT;
    int single = joint < t->n && lw_joint_nv(t->joint_type[joint]) == 1;
    if (action < LW_RELEASE || action > LW_STOP || (joint >= t->n && action != LW_RELEASE) ||
        (action == LW_STOP && (!single || occasion != LW_ON_POSITION)))
        return LW_BAD_EVENT_ACTION;
    if (occasion < LW_ON_COMMAND || occasion > LW_ON_DISTANCE ||
        ((occasion == LW_ON_POSITION || occasion == LW_ON_SPEED) && !single))
        return LW_BAD_EVENT_OCCASION;
    if (t->event_side[i] != 1 && t->event_side[i] != -1) return LW_BAD_EVENT_SIDE;
    if (!isfinite(t->event_threshold[i])) return LW_BAD_EVENT_THRESHOLD;
    if (!(t->event_restitution[i] >= 0.0 && t->event_restitution[i] <= 1.0)) return LW_BAD_EVENT_RESTITUTION;
    return LW_OK;
}

static int force_bodies_fit(const lw_tables *t, int i) {
    int32_t type = t->force_type[i], first = t->force_body[2 * i], second = t->force_body[2 * i + 1];
    if (first < (type == LW_SPRING ? -1 : 0) || first >= t->n) return 0;
    if (type == LW_ACTUATOR || type == LW_MOTION) return second >= 0 && second < lw_joint_nv(t->joint_type[first]);
    return second >= -1 && second < t->n && first != second;
}

static int check_force(const lw_tables *t, int i) {
    if (t->force_type[i] < 0 || t->force_type[i] >= LW_FORCE_TYPES) return LW_BAD_FORCE_TYPE;
    if (!force_bodies_fit(t, i)) return LW_BAD_FORCE_BODY;
    if (!all_finite(t->force_point + 6 * i, 6)) return LW_BAD_FORCE_POINT;
    if (!all_finite(t->force_number + 3 * i, 3)) return LW_BAD_FORCE_NUMBER;
    int32_t start = t->force_start[i], end = t->force_start[i + 1];
    return start >= 0 && start <= end && end <= t->instructions ? LW_OK : LW_BAD_FORCE_START;
}

int lw_tables_check(const lw_tables *t, lw_fault *fault) {
    fault->item = 0;
    fault->time = 0.0;
    if (t->n < 1 || t->nq < 0 || t->nv < 0 || t->closures < 0 || t->events < 0 || t->forces < 0 ||
        t->instructions < 0 || t->constants < 0 || t->inputs < 0)
        return LW_BAD_COUNT;
    if (!all_finite(t->gravity, 3)) return LW_BAD_GRAVITY;
    int status = check_coordinate_values(t, fault);
    for (int i = 0; i < t->n && !status; ++i) {
        status = check_row(t, i);
        fault->item = status == LW_BAD_REST ? t->q_index[i] : i;
    }
    for (int i = 0; i < t->closures && !status; ++i) {
        status = check_closure(t, i);
        fault->item = i;
    }
    for (int i = 0; i < t->events && !status; ++i) {
        status = check_event(t, i);
        fault->item = i;
    }
    for (int i = 0; i < t->forces && !status; ++i) {
        status = check_force(t, i);
        fault->item = i;
    }
    for (int i = 0; i < t->inputs && !status; ++i) {
        if (t->force_input[i] < 0 || t->force_input[i] >= t->constants) status = LW_BAD_FORCE_INPUT;
        fault->item = i;
    }
    return status;
}
