/* Build the mechanism from its tables, in the caller's memory. */
#include "lw_model.h"

#include <string.h>

/* q, v, and two quadratures */
static size_t vector_length(int32_t nq, int32_t nv) { return (size_t)nq + (size_t)nv + 2; }

int32_t lw_closure_row_count(const lw_tables *t) {
    int32_t rows = 0;
    for (int32_t c = 0; c < t->closures; ++c)
        for (int bit = 0; bit < 7; ++bit) rows += t->closure_rows[c] >> bit & 1;
    return rows;
}

size_t lw_multibody_size(const lw_tables *t) {
    size_t n = (size_t)t->n, nv = (size_t)t->nv, closures = (size_t)t->closures;
    size_t rows = (size_t)lw_closure_row_count(t), paths = closures * n + 1; /* + 1: an even number */
    size_t events = (size_t)t->events, forces = (size_t)t->forces;
    size_t doubles = 12 * n + 2 * nv + (size_t)t->nq + (3 + LW_MAX_STAGES) * vector_length(t->nq, t->nv);
    doubles += rows * nv + 2 * rows * rows + 4 * rows + 6 * closures + 2 * events + 2 * (size_t)t->inputs;
    return sizeof(lw_multibody) + n * (sizeof(lw_link) + sizeof(lw_spatial)) + forces * sizeof(lw_element) +
           closures * sizeof(lw_closure) + rows * sizeof(lw_row) + events * sizeof(lw_event) +
           (doubles + (size_t)t->constants + (size_t)t->instructions) * sizeof(double) + paths / 2 * 2 * sizeof(int32_t);
}

/* Cut the block behind the struct into its arrays. */
static void lay_out(lw_multibody *mb, int32_t constants, int32_t instructions) {
    size_t n = (size_t)mb->n, length = vector_length(mb->nq, mb->nv), rows = (size_t)mb->rows;
    mb->link = (lw_link *)(mb + 1);
    mb->load = (lw_spatial *)(mb->link + n);
    mb->element = (lw_element *)(mb->load + n);
    mb->closure = (lw_closure *)(mb->element + mb->forces);
    mb->row = (lw_row *)(mb->closure + mb->closures);
    mb->event = (lw_event *)(mb->row + rows);
    double *next = (double *)(mb->event + mb->events);
    mb->happened = next, next += mb->events;
    mb->indicator = next, next += mb->events;
    mb->before = next, next += length;
    mb->loaded = next, next += 6 * n;
    mb->closure_load = next, next += 6 * mb->closures;
    mb->spread = next, next += rows * (size_t)mb->nv;
    mb->delassus = next, next += rows * rows;
    mb->factor = next, next += rows * rows;
    mb->row_scale = next, next += rows;
    mb->multiplier = next, next += rows;
    mb->right = next, next += rows;
    mb->correction = next, next += rows;
    mb->stiffness = next, next += mb->nv;
    mb->damping = next, next += mb->nv;
    mb->rest = next, next += mb->nq;
    mb->constants = next, next += constants;
    mb->code = (int32_t *)next, next += instructions; /* two to a double */
    mb->input = (int32_t *)next, next += mb->inputs;
    mb->given = next, next += mb->inputs;
    mb->wrench = next, next += 6 * n;
    mb->y = next, next += length;
    mb->trial = next, next += length;
    for (int s = 0; s < LW_MAX_STAGES; ++s, next += length) mb->rate[s] = next;
    for (int32_t c = 0; c < mb->closures; ++c) mb->closure[c].path = (int32_t *)next + (size_t)c * n;
    /* Coordinates that no joint uses stay as they are: their rates are never written again. */
    memset(mb->rate[0], 0, LW_MAX_STAGES * length * sizeof(double));
}

/* Unit quaternion of a rotation matrix, from its largest component. */
static lw_quat matrix_quat(lw_mat3 m) {
    double w = 1.0 + m.xx + m.yy + m.zz, x = 1.0 + m.xx - m.yy - m.zz;
    double y = 1.0 - m.xx + m.yy - m.zz, z = 1.0 - m.xx - m.yy + m.zz;
    if (w >= x && w >= y && w >= z) return lw_quat_unit(lw_quat_of(w, m.zy - m.yz, m.xz - m.zx, m.yx - m.xy));
    if (x >= y && x >= z) return lw_quat_unit(lw_quat_of(m.zy - m.yz, x, m.xy + m.yx, m.xz + m.zx));
    if (y >= z) return lw_quat_unit(lw_quat_of(m.xz - m.zx, m.xy + m.yx, y, m.yz + m.zy));
    return lw_quat_unit(lw_quat_of(m.yx - m.xy, m.xz + m.zx, m.yz + m.zy, z));
}

static int is_identity(const double *r) {
    for (int k = 0; k < 9; ++k)
        if (r[k] != (k % 4 == 0 ? 1.0 : 0.0)) return 0;
    return 1;
}

static int any_nonzero(const double *values, int count) {
    for (int k = 0; k < count; ++k)
        if (values[k] != 0.0) return 1;
    return 0;
}

int lw_joint_translations(int type) {
    return type == LW_PRISMATIC ? 1 : type == LW_PLANAR ? 2 : type == LW_FREE ? 3 : 0;
}

static void build_frames(lw_link *l, const lw_tables *t, int i) {
    l->parent_point = lw_load3(t->parent_point + 3 * i);
    l->child_point = lw_load3(t->child_point + 3 * i);
    l->parent_rotated = !is_identity(t->parent_rotation + 9 * i);
    l->child_rotated = !is_identity(t->child_rotation + 9 * i);
    l->parent_quat = matrix_quat(lw_load9(t->parent_rotation + 9 * i));
    l->parent_matrix = lw_quat_matrix(l->parent_quat);
    l->axis = lw_column_z(l->parent_matrix);
    lw_quat child = matrix_quat(lw_load9(t->child_rotation + 9 * i));
    l->child_quat_inverse = lw_quat_conj(child);
    l->child_matrix = lw_quat_matrix(child);
}

/* The link that carries `body`, among the first `count`; -1 for the world. */
static int32_t find(const lw_link *links, int32_t count, int32_t body) {
    while (--count >= 0 && links[count].body != body) {}
    return count;
}

static void build_link(lw_link *l, const lw_tables *t, int i) {
    memset(l, 0, sizeof *l);
    l->body = i;
    l->type = t->joint_type[i];
    l->q = t->q_index[i];
    l->v = t->v_index[i];
    l->built = l->type;
    l->freedoms = l->columns = lw_joint_nv(l->type);
    l->translations = lw_joint_translations(l->type);
    l->sprung = any_nonzero(t->stiffness + l->v, l->columns);
    l->damped = any_nonzero(t->damping + l->v, l->columns);
    l->built_sprung = l->sprung;
    l->built_damped = l->damped;
    l->mass = t->mass[i];
    l->inertia = lw_load_sym(t->inertia + 6 * i);
    build_frames(l, t, i);
}

int32_t lw_link_of(const lw_multibody *mb, int32_t body) {
    return body < 0 ? -1 : find(mb->link, mb->n, body);
}

int lw_multibody_init(lw_multibody *mb, const lw_tables *t, lw_fault *fault) {
    int status = lw_tables_check(t, fault);
    if (status) return status;
    mb->n = t->n;
    mb->nq = t->nq;
    mb->nv = t->nv;
    mb->formulation = NULL;
    mb->forces = t->forces;
    mb->inputs = t->inputs;
    mb->closures = t->closures;
    mb->events = t->events;
    mb->rows = lw_closure_row_count(t);
    mb->gravity = lw_load3(t->gravity);
    lay_out(mb, t->constants, t->instructions);
    mb->time = 0.0;
    memcpy(mb->stiffness, t->stiffness, (size_t)t->nv * sizeof(double));
    memcpy(mb->damping, t->damping, (size_t)t->nv * sizeof(double));
    memcpy(mb->rest, t->rest, (size_t)t->nq * sizeof(double));
    for (int32_t k = 0; k < t->n; ++k) {
        int32_t body = t->order[k];
        build_link(&mb->link[k], t, body);
        mb->link[k].parent = t->parent[body] < 0 ? -1 : find(mb->link, k, t->parent[body]);
    }
    lw_elements_build(mb, t);
    lw_closures_build(mb, t);
    lw_events_build(mb, t);
    return LW_OK;
}
