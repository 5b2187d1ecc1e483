/* The state of a lattice as a whole: at the start, its moments, in other units of time. */
#include "lw_lattice.h"

/* Moments of a cell: density less 1, velocity, and the second central moments less those at equilibrium. */
typedef struct { double density, ux, uy, k20, k02, k11; } moments;

static moments of_cell(const float *f, int64_t plane) {
    const double e = f[plane], n = f[2 * plane], w = f[3 * plane], s = f[4 * plane];
    const double ne = f[5 * plane], nw = f[6 * plane], sw = f[7 * plane], se = f[8 * plane];
    const double diagonal = ne + nw + sw + se, density = f[0] + e + n + w + s + diagonal;
    const double jx = e - w + ne - nw - sw + se, jy = n - s + ne + nw - sw - se, mass = 1.0 + density;
    const moments m = {density,
                       jx / mass,
                       jy / mass,
                       e + w + diagonal - density / 3.0 - jx * jx / mass,
                       n + s + diagonal - density / 3.0 - jy * jy / mass,
                       ne - nw + sw - se - jx * jy / mass};
    return m;
}

/* Populations whose third and fourth central moments are at equilibrium. Raw moments less what they are at
 * rest (1, 1/3, 1/9), so that a fluid at rest is exactly zero. */
static void to_cell(float *f, int64_t plane, const moments *m) {
    const double mass = 1.0 + m->density, ux = m->ux, uy = m->uy, pressure = m->density / 3.0;
    const double m10 = mass * ux, m01 = mass * uy, m11 = m->k11 + m10 * uy;
    const double m20 = pressure + m10 * ux + m->k20, m02 = pressure + m01 * uy + m->k02;
    const double m21 = uy * (1.0 / 3.0 + m20) + 2.0 * ux * m->k11;
    const double m12 = ux * (1.0 / 3.0 + m02) + 2.0 * uy * m->k11;
    const double m22 = m->density / 9.0 + uy * m21 + ux * (m12 - uy * uy * m10);
    f[0] = (float)(m->density - m20 - m02 + m22);
    f[plane] = (float)(0.5 * (m10 + m20 - m12 - m22));
    f[2 * plane] = (float)(0.5 * (m01 + m02 - m21 - m22));
    f[3 * plane] = (float)(0.5 * (-m10 + m20 + m12 - m22));
    f[4 * plane] = (float)(0.5 * (-m01 + m02 + m21 - m22));
    f[5 * plane] = (float)(0.25 * (m11 + m21 + m12 + m22));
    f[6 * plane] = (float)(0.25 * (-m11 + m21 - m12 + m22));
    f[7 * plane] = (float)(0.25 * (m11 - m21 - m12 + m22));
    f[8 * plane] = (float)(0.25 * (-m11 - m21 + m12 + m22));
}

void lw_lattice_stream(const lw_lattice *lattice, float populations[LW_DIRECTIONS]) {
    const moments m = {.ux = lattice->stream[0], .uy = lattice->stream[1]};
    to_cell(populations, 1, &m);
}

float lw_lattice_blend(const lw_lattice *lattice, int32_t distance) {
    const float depth = (float)(lattice->fringe - distance) / (float)lattice->fringe;
    return distance < lattice->fringe ? 0.3f * depth * depth * depth : 0.0f;
}

void lw_lattice_init(lw_lattice *lattice) {
    lattice->instructions = lw_instructions_here();
    float stream[LW_DIRECTIONS];
    lw_lattice_stream(lattice, stream);
    for (int q = 0; q < LW_DIRECTIONS; ++q) {
        for (int64_t i = 0; i < (int64_t)lattice->nx * lattice->ny + LW_PLANE_PADDING; ++i) {
            lattice->populations[q * lattice->plane + i] = lattice->next[q * lattice->plane + i] = stream[q];
        }
    }
    for (int32_t i = 0; i < lattice->nx; ++i) {
        const int32_t to_end = lattice->nx - 1 - i;
        lattice->blend[i] = lw_lattice_blend(lattice, i < to_end ? i : to_end);
    }
}

/* Add mass less 1 and momentum of one cell of each of `count` blocks, which follow each other in a row. */
static void add_up(const float *f, int64_t plane, int32_t stride, int32_t count, double (*sum)[3]) {
    for (int32_t k = 0; k < count; ++k, f += stride) {
        const double e = f[plane], n = f[2 * plane], w = f[3 * plane], s = f[4 * plane];
        const double ne = f[5 * plane], nw = f[6 * plane], sw = f[7 * plane], se = f[8 * plane];
        sum[k][0] += f[0] + (e + w) + (n + s) + (ne + sw) + (nw + se);
        sum[k][1] += (e - w) + (ne - sw) - (nw - se);
        sum[k][2] += (n - s) + (ne - sw) + (nw - se);
    }
}

/* Means over `count` blocks whose first cell is at `f`. */
static void blocks(const lw_lattice *lattice, const float *f, int32_t stride, int32_t count, double (*mean)[3]) {
    const double share = 1.0 / ((double)stride * stride);
    for (int32_t k = 0; k < count; ++k) {
        mean[k][0] = mean[k][1] = mean[k][2] = 0.0;
    }
    for (int32_t b = 0; b < stride; ++b) {
        for (int32_t a = 0; a < stride; ++a) {
            add_up(f + (int64_t)b * lattice->nx + a, lattice->plane, stride, count, mean);
        }
    }
    for (int32_t k = 0; k < count; ++k) {
        for (int c = 0; c < 3; ++c) {
            mean[k][c] *= share;
        }
    }
}

void lw_lattice_moments(const lw_lattice *lattice, int32_t stride, float *velocity, float *density) {
    enum { TOGETHER = 64 };
    const int32_t columns = lattice->nx / stride, rows = lattice->ny / stride;
    double mean[TOGETHER][3];
    for (int32_t j = 0; j < rows; ++j) {
        for (int32_t i = 0; i < columns; i += TOGETHER) {
            const int32_t count = columns - i < TOGETHER ? columns - i : TOGETHER;
            const float *first = lattice->populations + (int64_t)stride * ((int64_t)j * lattice->nx + i);
            blocks(lattice, first, stride, count, mean);
            for (int32_t k = 0; k < count; ++k) {
                const int64_t to = (int64_t)j * columns + i + k;
                density[to] = (float)mean[k][0];
                velocity[to] = (float)(mean[k][1] / (1.0 + mean[k][0]));
                velocity[to + (int64_t)rows * columns] = (float)(mean[k][2] / (1.0 + mean[k][0]));
            }
        }
    }
}

/* After the collision a second moment K' is (1 - omega) K, and K = -2 rho S / (3 omega) with S the rate of
 * strain per step, which becomes half. The trace is at equilibrium but for the fringe, whose part in K is
 * treated alike. */
int lw_lattice_halve_step(lw_lattice *lattice, float shear_rate) {
    const double old = lattice->shear_rate, rate = shear_rate;
    if (old == 1.0) {
        return 1;
    }
    const double factor = 0.5 * (old / rate) * (1.0 - rate) / (1.0 - old);
    for (int64_t i = 0; i < (int64_t)lattice->nx * lattice->ny; ++i) {
        moments m = of_cell(lattice->populations + i, lattice->plane);
        m.density *= 0.25;
        m.ux *= 0.5;
        m.uy *= 0.5;
        m.k20 *= factor;
        m.k02 *= factor;
        m.k11 *= factor;
        to_cell(lattice->populations + i, lattice->plane, &m);
    }
    lattice->shear_rate = shear_rate;
    lattice->stream[0] *= 0.5f;
    lattice->stream[1] *= 0.5f;
    return 0;
}
