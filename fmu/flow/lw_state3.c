/* The state of a lattice in space as a whole: at the start, its moments, in other units of time. */
#include "lw_lattice3.h"

/* Moments of a cell: density less 1, velocity, and the second central moments less those at equilibrium: along
 * the axes, and of the planes of x and y, x and z, y and z. */
typedef struct { double density, u[3], along[3], shear[3]; } moments;

/* Axes of the three planes. */
static const int first[3] = {0, 0, 1}, second[3] = {1, 2, 2};

static moments of_cell(const float *f, int64_t volume) {
    double density = f[0], j[3], m2[3], m11[3];
    for (int a = 0; a < 3; ++a) {
        const double plus = f[(1 + 2 * a) * volume], minus = f[(2 + 2 * a) * volume];
        j[a] = plus - minus;
        m2[a] = plus + minus;
        density += m2[a];
    }
    for (int p = 0; p < 3; ++p) {
        const float *of = f + (7 + 4 * p) * volume;
        const double pp = of[0], mm = of[volume], pm = of[2 * volume], mp = of[3 * volume];
        const double all = (pp + mm) + (pm + mp);
        density += all;
        m2[first[p]] += all;
        m2[second[p]] += all;
        m11[p] = (pp + mm) - (pm + mp);
        j[first[p]] += (pp - mm) + (pm - mp);
        j[second[p]] += (pp - mm) - (pm - mp);
    }
    moments m = {.density = density};
    const double mass = 1.0 + density;
    for (int a = 0; a < 3; ++a) {
        m.u[a] = j[a] / mass;
        m.along[a] = m2[a] - density / 3.0 - j[a] * m.u[a];
        m.shear[a] = m11[a] - j[first[a]] * m.u[second[a]];
    }
    return m;
}

/* Populations whose third and fourth central moments are as the collision leaves them. Raw moments less what they are at
 * rest (1, 1/3, 1/9), so that a fluid at rest is exactly zero. */
static void to_cell(float *f, int64_t volume, const moments *m) {
    const double mass = 1.0 + m->density, pressure = m->density / 3.0;
    double rest = m->density, even[3], odd[3]; /* what is left for the axes */
    for (int a = 0; a < 3; ++a) {
        odd[a] = mass * m->u[a];
        even[a] = pressure + odd[a] * m->u[a] + m->along[a];
        rest -= even[a];
    }
    const double m2[3] = {even[0], even[1], even[2]};
    for (int p = 0; p < 3; ++p) {
        const int a = first[p], b = second[p];
        const double ux = m->u[a], uy = m->u[b], m11 = m->shear[p] + mass * ux * uy;
        const double m21 = uy * (1.0 / 3.0 + m2[a]) + 2.0 * ux * m->shear[p];
        const double m12 = ux * (1.0 / 3.0 + m2[b]) + 2.0 * uy * m->shear[p];
        const double k22 = m->density / 9.0 - 0.5 * m->along[3 - a - b];
        const double m22 = k22 + uy * m21 + ux * (m12 - mass * ux * uy * uy);
        float *of = f + (7 + 4 * p) * volume;
        of[0] = (float)(0.25 * (m22 + m11 + m21 + m12));
        of[volume] = (float)(0.25 * (m22 + m11 - m21 - m12));
        of[2 * volume] = (float)(0.25 * (m22 - m11 - m21 + m12));
        of[3 * volume] = (float)(0.25 * (m22 - m11 + m21 - m12));
        even[a] -= m22;
        even[b] -= m22;
        odd[a] -= m12;
        odd[b] -= m21;
        rest += m22;
    }
    f[0] = (float)rest;
    for (int a = 0; a < 3; ++a) {
        f[(1 + 2 * a) * volume] = (float)(0.5 * (even[a] + odd[a]));
        f[(2 + 2 * a) * volume] = (float)(0.5 * (even[a] - odd[a]));
    }
}

void lw_lattice3_stream(const lw_lattice3 *lattice, float populations[LW_DIRECTIONS3]) {
    const float *u = lattice->stream;
    const moments m = {.u = {u[0], u[1], u[2]}};
    to_cell(populations, 1, &m);
}

float lw_lattice3_blend(const lw_lattice3 *lattice, int32_t distance) {
    const float depth = (float)(lattice->fringe - distance) / (float)lattice->fringe;
    return distance < lattice->fringe ? 0.3f * depth * depth * depth : 0.0f;
}

void lw_lattice3_init(lw_lattice3 *lattice) {
    lattice->instructions = lw_instructions_here();
    float stream[LW_DIRECTIONS3];
    lw_lattice3_stream(lattice, stream);
    const int64_t cells = (int64_t)lattice->nx * lattice->ny * lattice->nz;
    for (int q = 0; q < LW_DIRECTIONS3; ++q) {
        float *here = lattice->populations + q * lattice->volume, *there = lattice->next + q * lattice->volume;
        for (int64_t i = 0; i < cells + LW_VOLUME_PADDING; ++i) {
            here[i] = there[i] = stream[q];
        }
    }
    for (int32_t i = 0; i < lattice->nx; ++i) {
        const int32_t to_end = lattice->nx - 1 - i;
        lattice->blend[i] = lw_lattice3_blend(lattice, i < to_end ? i : to_end);
    }
}

/* Add mass less 1 and momentum of one cell of each of `count` blocks, which follow each other in a row. */
static void add_up(const float *f, int64_t volume, int32_t stride, int32_t count, double (*sum)[4]) {
    for (int32_t b = 0; b < count; ++b, f += stride) {
        const moments m = of_cell(f, volume);
        sum[b][0] += m.density;
        for (int a = 0; a < 3; ++a) {
            sum[b][1 + a] += (1.0 + m.density) * m.u[a];
        }
    }
}

/* Means over `count` blocks whose first cell is at `f`. */
static void blocks(const lw_lattice3 *lattice, const float *f, int32_t stride, int32_t count,
                   double (*mean)[4]) {
    const double share = 1.0 / ((double)stride * stride * stride);
    const int64_t nx = lattice->nx, slab = nx * lattice->ny;
    for (int32_t b = 0; b < count; ++b) {
        mean[b][0] = mean[b][1] = mean[b][2] = mean[b][3] = 0.0;
    }
    for (int32_t k = 0; k < stride; ++k) {
        for (int32_t j = 0; j < stride; ++j) {
            for (int32_t i = 0; i < stride; ++i) {
                add_up(f + k * slab + j * nx + i, lattice->volume, stride, count, mean);
            }
        }
    }
    for (int32_t b = 0; b < count; ++b) {
        for (int c = 0; c < 4; ++c) {
            mean[b][c] *= share;
        }
    }
}

void lw_lattice3_moments(const lw_lattice3 *lattice, int32_t stride, float *velocity, float *density) {
    enum { TOGETHER = 64 };
    const int32_t columns = lattice->nx / stride, rows = lattice->ny / stride, slabs = lattice->nz / stride;
    const int64_t all = (int64_t)columns * rows * slabs;
    double mean[TOGETHER][4];
    for (int32_t row = 0; row < rows * slabs; ++row) {
        const int64_t j = row % rows, k = row / rows;
        const float *first_cell =
            lattice->populations + stride * ((k * lattice->ny + j) * lattice->nx);
        for (int32_t i = 0; i < columns; i += TOGETHER) {
            const int32_t count = columns - i < TOGETHER ? columns - i : TOGETHER;
            blocks(lattice, first_cell + (int64_t)i * stride, stride, count, mean);
            for (int32_t b = 0; b < count; ++b) {
                const int64_t to = (int64_t)row * columns + i + b;
                density[to] = (float)mean[b][0];
                for (int a = 0; a < 3; ++a) {
                    velocity[to + a * all] = (float)(mean[b][1 + a] / (1.0 + mean[b][0]));
                }
            }
        }
    }
}

/* After the collision a second moment K' is (1 - omega) K, and K = -2 rho S / (3 omega) with S the rate of
 * strain per step, which becomes half. The trace is at equilibrium but for the fringe, whose part in K is
 * treated alike. */
int lw_lattice3_halve_step(lw_lattice3 *lattice, float shear_rate) {
    const double old = lattice->shear_rate, rate = shear_rate;
    if (old == 1.0) {
        return 1;
    }
    const double factor = 0.5 * (old / rate) * (1.0 - rate) / (1.0 - old);
    const int64_t cells = (int64_t)lattice->nx * lattice->ny * lattice->nz;
    for (int64_t i = 0; i < cells; ++i) {
        moments m = of_cell(lattice->populations + i, lattice->volume);
        m.density *= 0.25;
        for (int a = 0; a < 3; ++a) {
            m.u[a] *= 0.5;
            m.along[a] *= factor;
            m.shear[a] *= factor;
        }
        to_cell(lattice->populations + i, lattice->volume, &m);
    }
    lattice->shear_rate = shear_rate;
    for (int a = 0; a < 3; ++a) {
        lattice->stream[a] *= 0.5f;
    }
    return 0;
}
