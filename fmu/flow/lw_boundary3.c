#include "lw_boundary3.h"

#include <math.h>
#include <string.h>

#include "lw_mobility3.h"
#include "lw_stencil3.h"

/* ---- where the markers are ---- */

static void locate(lw_boundary3 *b, const lw_mat3 *axes, const double *pose, int k) {
    const lw_vec3 arm = lw_mat_vec(axes[0], lw_load3(b->point + 3 * k));
    lw_store3(b->arm + 3 * k, arm);
    lw_store3(b->at + 3 * k, lw_add(lw_load3(pose), arm));
    lw_middle3(b->at + 3 * k, b->cell + 3 * k);
}

static int is_outside(const lw_lattice3 *l, const int32_t *cell) {
    const int32_t size[3] = {l->nx, l->ny, l->nz}, margin = l->fringe + 2;
    for (int axis = 0; axis < 3; ++axis)
        if (cell[axis] < margin || cell[axis] >= size[axis] - margin) return 1;
    return 0;
}

int lw_boundary3_place(lw_boundary3 *b, const lw_lattice3 *l, const double *pose, int32_t *marker) {
    b->mobility.instructions = l->instructions;
    for (int k = 0; k < b->count; ++k) {
        const double *of = pose + 7 * b->body[k];
        const lw_mat3 axes = lw_quat_matrix(lw_load4(of + 3));
        locate(b, &axes, of, k);
        *marker = k;
        if (is_outside(l, b->cell + 3 * k)) return LW_OUTSIDE;
    }
    return lw_mobility3(b, l, marker);
}

/* ---- forces ---- */

/* The velocity at a marker along each axis by each part of the twist: 1 or a component x, y, z of the arm, and a
 * sign. */
typedef struct { int of; double sign; } share;
static const share by_twist[3][6] = {
    {{0, 1.0}, {0, 0.0}, {0, 0.0}, {0, 0.0}, {3, 1.0}, {2, -1.0}},
    {{0, 0.0}, {0, 1.0}, {0, 0.0}, {3, -1.0}, {0, 0.0}, {1, 1.0}},
    {{0, 0.0}, {0, 0.0}, {0, 1.0}, {2, 1.0}, {1, -1.0}, {0, 0.0}},
};

static lw_vec3 wall_velocity(const lw_boundary3 *b, int k, const double *twist) {
    const double *of = twist + 6 * b->body[k];
    return lw_add(lw_load3(of), lw_cross(lw_load3(of + 3), lw_load3(b->arm + 3 * k)));
}

static lw_vec3 lacking(const lw_boundary3 *b, int k, const double *twist) {
    return lw_sub(wall_velocity(b, k, twist), lw_load3(b->velocity + 3 * k));
}

static int width_of(const lw_boundary3 *b) {
    return (4 * b->bodies + 3 + LW_TILE - 1) / LW_TILE * LW_TILE;
}

/* Columns 1, x, y, z of the arms of every body, then what the velocity lacks. */
static void fill_columns(lw_boundary3 *b, const double *twist) {
    const int width = width_of(b);
    memset(b->solution, 0, sizeof(double) * (size_t)b->mobility.blocks * LW_TILE * (size_t)width);
    for (int p = 0; p < b->count; ++p) {
        const int k = b->order[p].point;
        double *of = b->solution + (int64_t)p * width;
        of[4 * b->body[k]] = 1.0;
        memcpy(of + 4 * b->body[k] + 1, b->arm + 3 * k, 3 * sizeof(double));
        lw_store3(of + 4 * b->bodies, lacking(b, k, twist));
    }
}

/* A part of `response` or `wrench` out of products of columns: of two bodies, or of a body and what lacks. */
static double response_of(const double *products, int width, int d, int e) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const share one = by_twist[axis][d], other = by_twist[axis][e];
        const double sign = one.sign * other.sign;
        if (sign != 0.0) sum -= sign * products[one.of * width + other.of];
    }
    return sum;
}

static double wrench_of(const double *products, int width, int d) {
    double sum = 0.0;
    for (int axis = 0; axis < 3; ++axis) {
        const share one = by_twist[axis][d];
        if (one.sign != 0.0) sum += one.sign * products[one.of * width + axis];
    }
    return sum;
}

/* With y = U^-T (velocity by twist) and s = U^-T (velocity that lacks), G = y^T y and the wrench is -y^T s. Of a
 * body's 18 columns of y, six parts of the twist by three axes, only four differ: those of 1 and of the arm. */
void lw_boundary3_wrench(lw_boundary3 *b, const double *twist, double *wrench, double *response) {
    const int n = b->bodies, width = width_of(b);
    fill_columns(b, twist);
    lw_tiles_forward(&b->mobility, width, b->solution);
    lw_tiles_products(&b->mobility, width, b->solution, b->products);
    for (int one = 0; one < n; ++one)
        for (int d = 0; d < 6; ++d) {
            const double *of = b->products + 4 * one * width;
            wrench[6 * one + d] = wrench_of(of + 4 * n, width, d);
            for (int e = 0; e < 6 * n; ++e)
                response[(6 * one + d) * 6 * n + e] = response_of(of + 4 * (e / 6), width, d, e % 6);
        }
}

static void spread(const lw_boundary3 *b, lw_lattice3 *l, int k, const double *push) {
    const int64_t window = (int64_t)l->nx * l->ny * l->nz;
    for (int r = 0; r < LW_ROWS3; ++r) {
        const int64_t cell = lw_row3_at(l, b->cell + 3 * k, r);
        const double *weight = b->weight + LW_STENCIL3 * k + LW_ROW3 * r;
        for (int axis = 0; axis < 3; ++axis) {
            float *force = l->force + axis * window + cell;
            for (int i = 0; i < 3; ++i) force[i] += (float)(weight[i] * push[axis]);
        }
        l->forced[cell / l->nx] = 1;
    }
}

void lw_boundary3_act(lw_boundary3 *b, lw_lattice3 *l, const double *twist) {
    double *x = b->solution;
    memset(x, 0, sizeof(double) * (size_t)b->mobility.blocks * LW_TILE * LW_TILE);
    for (int p = 0; p < b->count; ++p) lw_store3(x + LW_TILE * p, lacking(b, b->order[p].point, twist));
    lw_tiles_forward(&b->mobility, LW_TILE, x);
    lw_tiles_backward(&b->mobility, LW_TILE, x);
    for (int p = 0; p < b->count; ++p) spread(b, l, b->order[p].point, x + LW_TILE * p);
}

/* Velocity of the fluid at a point of the window, with the forces that act in this step. */
static lw_vec3 forced_velocity(const lw_lattice3 *l, const double *at) {
    const int64_t window = (int64_t)l->nx * l->ny * l->nz;
    int32_t middle[3];
    double weight[LW_STENCIL3];
    lw_vec3 mean = {0.0, 0.0, 0.0};
    lw_middle3(at, middle);
    lw_weigh3(at, middle, weight);
    for (int r = 0; r < LW_ROWS3; ++r) {
        const int64_t cell = lw_row3_at(l, middle, r);
        const float *force = l->force + cell;
        const lw_row3 of = lw_streamed3(l, cell);
        for (int i = 0; i < 3; ++i) {
            const double w = weight[LW_ROW3 * r + i], lightness = of.lightness[i];
            mean.x += w * (of.x[i] + lightness * (double)force[i]);
            mean.y += w * (of.y[i] + lightness * (double)force[window + i]);
            mean.z += w * (of.z[i] + lightness * (double)force[2 * window + i]);
        }
    }
    return mean;
}

double lw_boundary3_leak(const lw_boundary3 *b, const lw_lattice3 *l, const double *twist) {
    double largest = 0.0;
    for (int k = 0; k < b->faces; ++k) {
        lw_vec3 corner[4], sum = {0.0, 0.0, 0.0}, wall = {0.0, 0.0, 0.0};
        for (int c = 0; c < 4; ++c) {
            const int marker = b->face[4 * k + c];
            corner[c] = lw_load3(b->at + 3 * marker);
            sum = lw_add(sum, corner[c]);
            wall = lw_add(wall, wall_velocity(b, marker, twist));
        }
        const double at[3] = {0.25 * sum.x, 0.25 * sum.y, 0.25 * sum.z};
        const lw_vec3 normal = lw_cross(lw_sub(corner[2], corner[0]), lw_sub(corner[3], corner[1]));
        const lw_vec3 slip = lw_sub(forced_velocity(l, at), lw_scale(0.25, wall));
        const double through = fabs(lw_dot(slip, normal)) / lw_norm(normal);
        if (!(through <= largest)) largest = through;
    }
    return largest;
}

void lw_boundary3_clear(const lw_boundary3 *b, lw_lattice3 *l) {
    const int64_t window = (int64_t)l->nx * l->ny * l->nz;
    for (int k = 0; k < b->count; ++k)
        for (int r = 0; r < LW_ROWS3; ++r) {
            const int64_t cell = lw_row3_at(l, b->cell + 3 * k, r);
            for (int axis = 0; axis < 3; ++axis)
                for (int i = 0; i < 3; ++i) l->force[axis * window + cell + i] = 0.0f;
            l->forced[cell / l->nx] = 0;
        }
}
