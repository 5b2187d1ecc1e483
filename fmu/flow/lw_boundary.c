#include "lw_boundary.h"

#include <math.h>

/* Share of its own mobility that a marker is softer by, so that the factor exists where markers come close. */
static const double softness = 1e-5;

/* Outlines that cross have markers nearer to each other than this [cells]: those on one are 1.1 apart. */
static const double nearest = 0.8;

/* Function of A. M. Roma, C. S. Peskin, M. J. Berger 1999, doi:10.1006/jcph.1999.6293: three cells wide. */
static double delta(double r) {
    double a = fabs(r);
    if (a <= 0.5) return (1.0 + sqrt(1.0 - 3.0 * a * a)) / 3.0;
    if (a >= 1.5) return 0.0;
    return (5.0 - 3.0 * a - sqrt(1.0 - 3.0 * (1.0 - a) * (1.0 - a))) / 6.0;
}

/* ---- where the markers are ---- */

static void locate(lw_boundary *b, const double *pose, int k) {
    double sum[2] = {0.0, 0.0};
    int carriers = b->body[2 * k + 1] < 0 ? 1 : 2;
    for (int c = 0; c < carriers; ++c) {
        const double *p = pose + 4 * b->body[2 * k + c], *point = b->point + 4 * k + 2 * c;
        double *arm = b->arm + 4 * k + 2 * c;
        arm[0] = p[2] * point[0] - p[3] * point[1];
        arm[1] = p[3] * point[0] + p[2] * point[1];
        sum[0] += p[0] + arm[0];
        sum[1] += p[1] + arm[1];
    }
    for (int axis = 0; axis < 2; ++axis) {
        b->at[2 * k + axis] = sum[axis] / carriers;
        b->cell[2 * k + axis] = (int32_t)floor(b->at[2 * k + axis] + 0.5);
    }
}

static int is_outside(const lw_lattice *l, const int32_t *cell) {
    int margin = l->fringe + 2;
    return cell[0] < margin || cell[0] >= l->nx - margin || cell[1] < margin || cell[1] >= l->ny - margin;
}

static void weigh(const double *at, const int32_t *cell, double *weight) {
    double x[3], y[3];
    for (int i = 0; i < 3; ++i) {
        x[i] = delta(at[0] - (cell[0] + i - 1));
        y[i] = delta(at[1] - (cell[1] + i - 1));
    }
    for (int q = 0; q < LW_STENCIL; ++q) weight[q] = x[q % 3] * y[q / 3];
}

/* Velocity and 1 / (2 density) of a cell after it has streamed, without force. */
static double streamed(const lw_lattice *l, int64_t cell, double velocity[2]) {
    const int64_t nx = l->nx;
    const int64_t from[LW_DIRECTIONS] = {0, -1, -nx, 1, nx, -nx - 1, -nx + 1, nx + 1, nx - 1};
    double f[LW_DIRECTIONS], density = 1.0;
    for (int q = 0; q < LW_DIRECTIONS; ++q) {
        f[q] = (double)l->populations[q * l->plane + cell + from[q]];
        density += f[q];
    }
    double inverse = 1.0 / density;
    velocity[0] = (f[1] - f[3] + f[5] - f[6] - f[7] + f[8]) * inverse;
    velocity[1] = (f[2] - f[4] + f[5] + f[6] - f[7] - f[8]) * inverse;
    return 0.5 * inverse;
}

static int64_t stencil_cell(const lw_lattice *l, const int32_t *middle, int q) {
    return (int64_t)(middle[1] + q / 3 - 1) * l->nx + middle[0] + q % 3 - 1;
}

static void sample(lw_boundary *b, const lw_lattice *l, int k) {
    double *mean = b->velocity + 2 * k;
    mean[0] = mean[1] = 0.0;
    for (int q = 0; q < LW_STENCIL; ++q) {
        double velocity[2], weight = b->weight[LW_STENCIL * k + q];
        int64_t cell = stencil_cell(l, b->cell + 2 * k, q);
        b->lightness[LW_STENCIL * k + q] = streamed(l, cell, velocity);
        mean[0] += weight * velocity[0];
        mean[1] += weight * velocity[1];
    }
}

/* ---- mobility: the velocity at marker k by a unit force at marker m ---- */

/* Are the stencils apart? Else their mobility, over the cells that both have. */
static int apart(const lw_boundary *b, int k, int m) {
    const int32_t *a = b->cell + 2 * k, *c = b->cell + 2 * m;
    int x = a[0] - c[0], y = a[1] - c[1];
    return x > 2 || x < -2 || y > 2 || y < -2;
}

static double mobility(const lw_boundary *b, int k, int m) {
    const double *wk = b->weight + LW_STENCIL * k, *wm = b->weight + LW_STENCIL * m;
    const double *lightness = b->lightness + LW_STENCIL * k;
    int x = b->cell[2 * k] - b->cell[2 * m], y = b->cell[2 * k + 1] - b->cell[2 * m + 1];
    double sum = 0.0;
    for (int j = 0; j < 3; ++j) {
        if (j + y < 0 || j + y > 2) continue;
        for (int i = 0; i < 3; ++i)
            if (i + x >= 0 && i + x <= 2)
                sum += wk[3 * j + i] * lightness[3 * j + i] * wm[3 * (j + y) + i + x];
    }
    return sum;
}

/* Do two markers belong to bodies that touch and should not? */
static int touch(const lw_boundary *b, int k, int m) {
    const double x = b->at[2 * k] - b->at[2 * m], y = b->at[2 * k + 1] - b->at[2 * m + 1];
    if (x * x + y * y > nearest * nearest) return 0;
    for (int c = 0; c < 4; ++c) {
        const int32_t one = b->body[2 * k + c / 2], other = b->body[2 * m + c % 2];
        if (one >= 0 && other >= 0 && one != other && !b->joined[one * b->bodies + other]) return 1;
    }
    return 0;
}

/* Row by row, within the envelope that begins at the first marker whose stencil meets this one's. */
static int factorise(lw_boundary *b, int32_t *marker) {
    int n = b->count;
    for (int k = 0; k < n; ++k) {
        double *row = b->factor + (int64_t)k * n;
        int first = 0;
        while (first < k && apart(b, k, first)) ++first;
        b->first[k] = first;
        for (int m = first; m < k; ++m) {
            const double *other = b->factor + (int64_t)m * n;
            *marker = k;
            if (touch(b, k, m)) return LW_OVERLAP;
            double sum = apart(b, k, m) ? 0.0 : mobility(b, k, m);
            for (int p = first > b->first[m] ? first : b->first[m]; p < m; ++p) sum -= row[p] * other[p];
            row[m] = sum / other[m];
        }
        double own = mobility(b, k, k), pivot = (1.0 + softness) * own;
        for (int p = first; p < k; ++p) pivot -= row[p] * row[p];
        *marker = k;
        if (!(pivot > 0.1 * softness * own)) return LW_OVERLAP;
        row[k] = sqrt(pivot);
    }
    return LW_PLACED;
}

int lw_boundary_place(lw_boundary *b, const lw_lattice *l, const double *pose, int32_t *marker) {
    for (int k = 0; k < b->count; ++k) {
        locate(b, pose, k);
        *marker = k;
        if (is_outside(l, b->cell + 2 * k)) return LW_OUTSIDE;
        weigh(b->at + 2 * k, b->cell + 2 * k, b->weight + LW_STENCIL * k);
        sample(b, l, k);
    }
    return factorise(b, marker);
}

/* ---- forces ---- */

/* Solve L x = x for `width` right-hand sides side by side. */
static void forward(const lw_boundary *b, int width, double *x) {
    for (int k = 0; k < b->count; ++k) {
        const double *row = b->factor + (int64_t)k * b->count;
        double *mine = x + (int64_t)k * width;
        for (int p = b->first[k]; p < k; ++p)
            for (int c = 0; c < width; ++c) mine[c] -= row[p] * x[(int64_t)p * width + c];
        for (int c = 0; c < width; ++c) mine[c] /= row[k];
    }
}

static void backward(const lw_boundary *b, int width, double *x) {
    for (int k = b->count - 1; k >= 0; --k) {
        const double *row = b->factor + (int64_t)k * b->count, *mine = x + (int64_t)k * width;
        for (int c = 0; c < width; ++c) x[(int64_t)k * width + c] /= row[k];
        for (int p = b->first[k]; p < k; ++p)
            for (int c = 0; c < width; ++c) x[(int64_t)p * width + c] -= row[p] * mine[c];
    }
}

/* Velocity of the outline at a marker: of both bodies, half each, at a hinge. */
static void wall_velocity(const lw_boundary *b, int k, const double *twist, double velocity[2]) {
    int carriers = b->body[2 * k + 1] < 0 ? 1 : 2;
    velocity[0] = velocity[1] = 0.0;
    for (int c = 0; c < carriers; ++c) {
        const double *v = twist + 3 * b->body[2 * k + c], *arm = b->arm + 4 * k + 2 * c;
        velocity[0] += (v[0] - v[2] * arm[1]) / carriers;
        velocity[1] += (v[1] + v[2] * arm[0]) / carriers;
    }
}

/* A row of the velocities at the markers: x by every twist, y by every twist, then what x and y lack. */
static void fill_row(const lw_boundary *b, int k, const double *twist, double *row) {
    int m = 3 * b->bodies, carriers = b->body[2 * k + 1] < 0 ? 1 : 2;
    double wall[2];
    for (int c = 0; c < 2 * m; ++c) row[c] = 0.0;
    for (int c = 0; c < carriers; ++c) {
        const double *arm = b->arm + 4 * k + 2 * c;
        int at = 3 * b->body[2 * k + c];
        row[at] = row[m + at + 1] = 1.0 / carriers;
        row[at + 2] = -arm[1] / carriers;
        row[m + at + 2] = arm[0] / carriers;
    }
    wall_velocity(b, k, twist, wall);
    row[2 * m] = wall[0] - b->velocity[2 * k];
    row[2 * m + 1] = wall[1] - b->velocity[2 * k + 1];
}

/* With y = L⁻¹ (velocity by twist) and s = L⁻¹ (velocity that lacks), G = yᵀ y and the wrench is -yᵀ s. */
void lw_boundary_wrench(lw_boundary *b, const double *twist, double *wrench, double *response) {
    int m = 3 * b->bodies, width = 2 * m + 2;
    double *x = b->solution;
    for (int k = 0; k < b->count; ++k) fill_row(b, k, twist, x + (int64_t)k * width);
    forward(b, width, x);
    for (int i = 0; i < m; ++i) wrench[i] = 0.0;
    for (int i = 0; i < m * m; ++i) response[i] = 0.0;
    for (int k = 0; k < b->count; ++k) {
        const double *row = x + (int64_t)k * width, *lack = row + 2 * m;
        for (int i = 0; i < m; ++i) {
            wrench[i] -= row[i] * lack[0] + row[m + i] * lack[1];
            for (int j = 0; j < m; ++j) response[i * m + j] += row[i] * row[j] + row[m + i] * row[m + j];
        }
    }
}

/* Velocity of the fluid at a point of the window, with the forces that act in this step. */
static void forced_velocity(const lw_lattice *l, const float *force, const double *at, double mean[2]) {
    int32_t middle[2] = {(int32_t)floor(at[0] + 0.5), (int32_t)floor(at[1] + 0.5)};
    double weight[LW_STENCIL];
    weigh(at, middle, weight);
    mean[0] = mean[1] = 0.0;
    for (int q = 0; q < LW_STENCIL; ++q) {
        double velocity[2];
        int64_t cell = stencil_cell(l, middle, q), plane = (int64_t)l->nx * l->ny;
        double lightness = streamed(l, cell, velocity);
        mean[0] += weight[q] * (velocity[0] + lightness * (double)force[cell]);
        mean[1] += weight[q] * (velocity[1] + lightness * (double)force[plane + cell]);
    }
}

double lw_boundary_leak(const lw_boundary *b, const lw_lattice *l, const float *force, const double *twist) {
    double largest = 0.0;
    for (int k = 0; k < b->count; ++k) {
        int other = b->next[k];
        if (other < 0) continue;
        const double *p = b->at + 2 * k, *q = b->at + 2 * other;
        double middle[2] = {0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])}, fluid[2], one[2], two[2];
        double x = q[0] - p[0], y = q[1] - p[1];
        forced_velocity(l, force, middle, fluid);
        wall_velocity(b, k, twist, one);
        wall_velocity(b, other, twist, two);
        double through = ((fluid[1] - 0.5 * (one[1] + two[1])) * x - (fluid[0] - 0.5 * (one[0] + two[0])) * y) /
                         sqrt(x * x + y * y);
        if (!(fabs(through) <= largest)) largest = fabs(through);
    }
    return largest;
}

void lw_boundary_act(lw_boundary *b, lw_lattice *l, float *force, const double *twist) {
    double *x = b->solution;
    int64_t plane = (int64_t)l->nx * l->ny;
    int32_t low = l->ny, high = 0;
    for (int k = 0; k < b->count; ++k) {
        wall_velocity(b, k, twist, x + 2 * k);
        x[2 * k] -= b->velocity[2 * k];
        x[2 * k + 1] -= b->velocity[2 * k + 1];
    }
    forward(b, 2, x);
    backward(b, 2, x);
    for (int k = 0; k < b->count; ++k) {
        for (int q = 0; q < LW_STENCIL; ++q) {
            int64_t cell = stencil_cell(l, b->cell + 2 * k, q);
            force[cell] += (float)(b->weight[LW_STENCIL * k + q] * x[2 * k]);
            force[plane + cell] += (float)(b->weight[LW_STENCIL * k + q] * x[2 * k + 1]);
        }
        if (b->cell[2 * k + 1] - 1 < low) low = b->cell[2 * k + 1] - 1;
        if (b->cell[2 * k + 1] + 2 > high) high = b->cell[2 * k + 1] + 2;
    }
    l->force_begin = low < high ? low : 0;
    l->force_end = low < high ? high : 0;
}

void lw_boundary_clear(const lw_boundary *b, lw_lattice *l, float *force) {
    int64_t plane = (int64_t)l->nx * l->ny;
    for (int k = 0; k < b->count; ++k)
        for (int q = 0; q < LW_STENCIL; ++q) {
            int64_t cell = stencil_cell(l, b->cell + 2 * k, q);
            force[cell] = force[plane + cell] = 0.0f;
        }
    l->force_begin = l->force_end = 0;
}
