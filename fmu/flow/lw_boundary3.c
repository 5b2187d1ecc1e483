#include "lw_boundary3.h"

#include <math.h>
#include <string.h>

/* Share of its own mobility that a marker is softer by, so that the factor exists where markers come close. */
static const double softness = 1e-5;

/* Surfaces that cross have markers nearer to each other than this [cells]: those on one are 1.1 apart. */
static const double nearest = 0.8;

enum { REACH = 2, WIDE = 3 + 2 * REACH }; /* cells between the middles of stencils that meet; what they cover */

/* Function of A. M. Roma, C. S. Peskin, M. J. Berger 1999, doi:10.1006/jcph.1999.6293: three cells wide. */
static double delta(double r) {
    double a = fabs(r);
    if (a <= 0.5) return (1.0 + sqrt(1.0 - 3.0 * a * a)) / 3.0;
    if (a >= 1.5) return 0.0;
    return (5.0 - 3.0 * a - sqrt(1.0 - 3.0 * (1.0 - a) * (1.0 - a))) / 6.0;
}

/* ---- where the markers are ---- */

static void middle_of(const double *at, int32_t *cell) {
    for (int axis = 0; axis < 3; ++axis) cell[axis] = (int32_t)floor(at[axis] + 0.5);
}

static void locate(lw_boundary3 *b, const lw_mat3 *axes, const double *pose, int k) {
    const lw_vec3 arm = lw_mat_vec(axes[0], lw_load3(b->point + 3 * k));
    lw_store3(b->arm + 3 * k, arm);
    lw_store3(b->at + 3 * k, lw_add(lw_load3(pose), arm));
    middle_of(b->at + 3 * k, b->cell + 3 * k);
}

static int is_outside(const lw_lattice3 *l, const int32_t *cell) {
    const int32_t size[3] = {l->nx, l->ny, l->nz}, margin = l->fringe + 2;
    for (int axis = 0; axis < 3; ++axis)
        if (cell[axis] < margin || cell[axis] >= size[axis] - margin) return 1;
    return 0;
}

static void weigh(const double *at, const int32_t *cell, double *weight) {
    double of[3][3];
    for (int axis = 0; axis < 3; ++axis)
        for (int i = 0; i < 3; ++i) of[axis][i] = delta(at[axis] - (cell[axis] + i - 1));
    for (int r = 0; r < LW_ROWS3; ++r)
        for (int i = 0; i < 4; ++i) weight[4 * r + i] = i < 3 ? of[0][i] * of[1][r % 3] * of[2][r / 3] : 0.0;
}

/* The first cell of a row of the stencil. */
static int64_t row_of(const lw_lattice3 *l, const int32_t *middle, int r) {
    return ((int64_t)(middle[2] + r / 3 - 1) * l->ny + middle[1] + r % 3 - 1) * l->nx + middle[0] - 1;
}

typedef struct { double x[4], y[4], z[4], lightness[4]; } row;

/* Velocity and 1 / (2 density) of four cells along x after they have streamed, without force. */
static row streamed(const lw_lattice3 *l, int64_t cell) {
    const int64_t nx = l->nx, layer = nx * l->ny;
    const int64_t step[3] = {1, nx, layer};
    static const int axes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    double density[4] = {1.0, 1.0, 1.0, 1.0}, momentum[3][4] = {{0.0}};
    row out;
    const float *from = l->populations + cell;
    for (int i = 0; i < 4; ++i) density[i] += (double)from[i];
    for (int a = 0; a < 3; ++a) {
        const float *plus = from + (1 + 2 * a) * l->volume - step[a];
        const float *minus = from + (2 + 2 * a) * l->volume + step[a];
        for (int i = 0; i < 4; ++i) {
            density[i] += (double)plus[i] + (double)minus[i];
            momentum[a][i] += (double)plus[i] - (double)minus[i];
        }
    }
    for (int p = 0; p < 3; ++p) {
        const int64_t sum = step[axes[p][0]] + step[axes[p][1]];
        const int64_t difference = step[axes[p][0]] - step[axes[p][1]];
        const float *of = from + (7 + 4 * p) * l->volume;
        const float *both = of - sum, *none = of + l->volume + sum;
        const float *first = of + 2 * l->volume - difference, *second = of + 3 * l->volume + difference;
        double *one = momentum[axes[p][0]], *other = momentum[axes[p][1]];
        for (int i = 0; i < 4; ++i) {
            const double alike = (double)both[i] - (double)none[i];
            const double unlike = (double)first[i] - (double)second[i];
            density[i] += ((double)both[i] + (double)none[i]) + ((double)first[i] + (double)second[i]);
            one[i] += alike + unlike;
            other[i] += alike - unlike;
        }
    }
    for (int i = 0; i < 4; ++i) {
        const double inverse = 1.0 / density[i];
        out.x[i] = momentum[0][i] * inverse;
        out.y[i] = momentum[1][i] * inverse;
        out.z[i] = momentum[2][i] * inverse;
        out.lightness[i] = 0.5 * inverse;
    }
    return out;
}

static void sample(lw_boundary3 *b, const lw_lattice3 *l, int k) {
    double x = 0.0, y = 0.0, z = 0.0;
    for (int r = 0; r < LW_ROWS3; ++r) {
        const double *weight = b->weight + LW_STENCIL3 * k + 4 * r;
        const row of = streamed(l, row_of(l, b->cell + 3 * k, r));
        for (int i = 0; i < 3; ++i) {
            x += weight[i] * of.x[i];
            y += weight[i] * of.y[i];
            z += weight[i] * of.z[i];
        }
        memcpy(b->lightness + LW_STENCIL3 * k + 4 * r, of.lightness, sizeof of.lightness);
    }
    b->velocity[3 * k] = x;
    b->velocity[3 * k + 1] = y;
    b->velocity[3 * k + 2] = z;
}

/* ---- mobility: the velocity at marker k by a unit force at marker m ---- */

/* Are stencils of these middles apart? */
static int apart(const int32_t *a, const int32_t *b) {
    for (int axis = 0; axis < 3; ++axis)
        if (a[axis] - b[axis] > REACH || b[axis] - a[axis] > REACH) return 1;
    return 0;
}

static int box_apart(const int32_t *box, const int32_t *low, const int32_t *high) {
    for (int axis = 0; axis < 3; ++axis)
        if (low[axis] - box[3 + axis] > REACH || box[axis] - high[axis] > REACH) return 1;
    return 0;
}

/* The marker at a place of the order, and its cell; and the place after the last one of a block. */
static int marker_at(const lw_boundary3 *b, int p) { return b->order[p].point; }
static const int32_t *cell_at(const lw_boundary3 *b, int p) { return b->cell + 3 * marker_at(b, p); }
static int last_of(const lw_boundary3 *b, int block) {
    const int last = (block + 1) * LW_TILE;
    return last < b->count ? last : b->count;
}

static void enclose(lw_boundary3 *b, int block) {
    int32_t *box = b->box + 6 * block;
    for (int p = block * LW_TILE; p < last_of(b, block); ++p)
        for (int axis = 0; axis < 3; ++axis) {
            const int32_t at = cell_at(b, p)[axis];
            if (p == block * LW_TILE || at < box[axis]) box[axis] = at;
            if (p == block * LW_TILE || at > box[3 + axis]) box[3 + axis] = at;
        }
}

static int blocks_apart(const lw_boundary3 *b, int i, int j) {
    const int32_t *box = b->box + 6 * i;
    if (box_apart(b->box + 6 * j, box, box + 3)) return 1;
    for (int p = i * LW_TILE; p < last_of(b, i); ++p)
        for (int q = j * LW_TILE; q < last_of(b, j); ++q)
            if (!apart(cell_at(b, p), cell_at(b, q))) return 0;
    return 1;
}

/* How far every row of tiles reaches. */
static void lay_out(lw_boundary3 *b) {
    lw_tiles *e = &b->mobility;
    int64_t start = 0;
    for (int32_t i = 0; i < e->blocks; ++i) enclose(b, i);
    for (int32_t i = 0; i < e->blocks; ++i) {
        const int32_t least = i > 0 && e->end[i - 1] > i + 1 ? e->end[i - 1] : i + 1;
        int32_t end = e->blocks;
        while (end > least && blocks_apart(b, i, end - 1)) --end;
        e->end[i] = end;
        e->start[i] = start;
        start += end - i;
    }
}

/* Do two markers belong to bodies that touch and should not? */
static int touch(const lw_boundary3 *b, int k, int m) {
    const int32_t one = b->body[k], other = b->body[m];
    if (one == other || b->joined[one * b->bodies + other]) return 0;
    const lw_vec3 gap = lw_sub(lw_load3(b->at + 3 * k), lw_load3(b->at + 3 * m));
    return lw_dot(gap, gap) <= nearest * nearest;
}

/* What a force at a marker does, where stencils that meet its own can see it: rows along x, none outside. */
typedef struct { double of[WIDE][WIDE][WIDE + 1]; } surroundings;

static void surround(const lw_boundary3 *b, int k, surroundings *s) {
    for (int r = 0; r < LW_ROWS3; ++r)
        for (int i = 0; i < 3; ++i) {
            const int c = LW_STENCIL3 * k + 4 * r + i;
            s->of[REACH + r / 3][REACH + r % 3][REACH + i] = b->weight[c] * b->lightness[c];
        }
}

static double mobility(const lw_boundary3 *b, const surroundings *s, int k, int m) {
    const int32_t *from = b->cell + 3 * k, *to = b->cell + 3 * m;
    const int x = to[0] - from[0] + REACH, y = to[1] - from[1] + REACH, z = to[2] - from[2] + REACH;
    double sum[4] = {0.0, 0.0, 0.0, 0.0};
    for (int r = 0; r < LW_ROWS3; ++r) {
        const double *weight = b->weight + LW_STENCIL3 * m + 4 * r, *seen = &s->of[z + r / 3][y + r % 3][x];
        for (int i = 0; i < 4; ++i) sum[i] += weight[i] * seen[i];
    }
    return (sum[0] + sum[1]) + (sum[2] + sum[3]);
}

/* A row of the matrix, from its diagonal on. Returns -1, or a marker that the row's must not touch. */
static int fill_row(lw_boundary3 *b, surroundings *s, int p) {
    const lw_tiles *t = &b->mobility;
    const int i = p / LW_TILE, k = marker_at(b, p);
    const int32_t *cell = b->cell + 3 * k;
    surround(b, k, s);
    for (int j = i; j < t->end[i]; ++j) {
        double *to = lw_tile_at(t, i, j) + p % LW_TILE * LW_TILE;
        for (int q = 0; q < LW_TILE; ++q) to[q] = 0.0;
        if (box_apart(b->box + 6 * j, cell, cell)) continue;
        for (int q = j > i ? j * LW_TILE : p; q < last_of(b, j); ++q) {
            const int m = marker_at(b, q);
            if (apart(cell, b->cell + 3 * m)) continue;
            if (touch(b, k, m)) return m;
            to[q % LW_TILE] = mobility(b, s, k, m);
        }
    }
    lw_tile_at(t, i, i)[p % LW_TILE * (LW_TILE + 1)] *= 1.0 + softness;
    return -1;
}

static int factorise(lw_boundary3 *b, int32_t *marker) {
    const lw_tiles *t = &b->mobility;
    surroundings s = {{{{0.0}}}};
    for (int p = 0; p < b->count; ++p) {
        *marker = fill_row(b, &s, p);
        if (*marker >= 0) return LW_OVERLAP;
    }
    for (int p = b->count; p < t->blocks * LW_TILE; ++p) /* no markers */
        for (int q = 0; q < LW_TILE; ++q)
            lw_tile_at(t, p / LW_TILE, p / LW_TILE)[p % LW_TILE * LW_TILE + q] = q == p % LW_TILE;
    const int bad = lw_tiles_factorise(t, 0.1 * softness);
    *marker = bad < 0 ? -1 : marker_at(b, bad);
    return bad < 0 ? LW_PLACED : LW_OVERLAP;
}

int lw_boundary3_place(lw_boundary3 *b, const lw_lattice3 *l, const double *pose, int32_t *marker) {
    b->mobility.instructions = l->instructions;
    for (int k = 0; k < b->count; ++k) {
        const double *of = pose + 7 * b->body[k];
        const lw_mat3 axes = lw_quat_matrix(lw_load4(of + 3));
        locate(b, &axes, of, k);
        *marker = k;
        if (is_outside(l, b->cell + 3 * k)) return LW_OUTSIDE;
        weigh(b->at + 3 * k, b->cell + 3 * k, b->weight + LW_STENCIL3 * k);
        sample(b, l, k);
    }
    lw_order(b->count, b->at, b->order);
    lay_out(b);
    return factorise(b, marker);
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
        const int k = marker_at(b, p);
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
        const int64_t cell = row_of(l, b->cell + 3 * k, r);
        const double *weight = b->weight + LW_STENCIL3 * k + 4 * r;
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
    for (int p = 0; p < b->count; ++p) lw_store3(x + LW_TILE * p, lacking(b, marker_at(b, p), twist));
    lw_tiles_forward(&b->mobility, LW_TILE, x);
    lw_tiles_backward(&b->mobility, LW_TILE, x);
    for (int p = 0; p < b->count; ++p) spread(b, l, marker_at(b, p), x + LW_TILE * p);
}

/* Velocity of the fluid at a point of the window, with the forces that act in this step. */
static lw_vec3 forced_velocity(const lw_lattice3 *l, const double *at) {
    const int64_t window = (int64_t)l->nx * l->ny * l->nz;
    int32_t middle[3];
    double weight[LW_STENCIL3];
    lw_vec3 mean = {0.0, 0.0, 0.0};
    middle_of(at, middle);
    weigh(at, middle, weight);
    for (int r = 0; r < LW_ROWS3; ++r) {
        const int64_t cell = row_of(l, middle, r);
        const float *force = l->force + cell;
        const row of = streamed(l, cell);
        for (int i = 0; i < 3; ++i) {
            const double w = weight[4 * r + i], lightness = of.lightness[i];
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
            const int64_t cell = row_of(l, b->cell + 3 * k, r);
            for (int axis = 0; axis < 3; ++axis)
                for (int i = 0; i < 3; ++i) l->force[axis * window + cell + i] = 0.0f;
            l->forced[cell / l->nx] = 0;
        }
}
