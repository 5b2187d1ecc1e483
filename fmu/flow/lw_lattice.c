#include "lw_lattice.h"

enum {
    ROWS = 16, /* in one part of the job */
    LANES = 16 /* rows are worked on from and up to multiples of it: no remainders, aligned writes */
};

/* Populations of a cell by their direction. */
typedef struct { float rest, e, n, w, s, ne, nw, sw, se; } cell;

typedef struct {
    const lw_lattice *lattice;
    int32_t shift_x, shift_y;
    int32_t begin, end; /* columns that have a source */
    int32_t down;       /* rows come from the last to the first */
    float stream[LW_DIRECTIONS];
} step_job;

/* Collide: second central moments relax by `keep` = 1 - omega towards equilibrium, their trace and all higher
 * ones are set to it. Momentum goes from j to j + F; q = j + F/2 = rho u. Of the raw moments m20 and m02 are
 * kept less 1/3, m22 less 1/9: their values at rest. Terms in the force come last: without them the result
 * has the bits of a force of zero. */
LW_INLINE cell collide(cell f, float keep, float fx, float fy, int forced) {
    const float third = 1.0f / 3.0f, ninth = 1.0f / 9.0f;
    const float along_x = f.e + f.w, along_y = f.n + f.s, up = f.ne + f.sw, down = f.nw + f.se;
    const float right = f.ne - f.sw, left = f.nw - f.se;
    const float density = f.rest + (along_x + along_y) + (up + down); /* less 1 */
    const float jx = (f.e - f.w) + (right - left), jy = (f.n - f.s) + (right + left);
    const float qx = forced ? jx + 0.5f * fx : jx, qy = forced ? jy + 0.5f * fy : jy;
    const float inverse = 1.0f / (1.0f + density), ux = qx * inverse, uy = qy * inverse;
    const float uxqx = ux * qx, uyqy = uy * qy, uxqy = ux * qy, pressure = third * density;
    float difference = (along_x - along_y) - (uxqx - uyqy), shear = (up - down) - uxqy;
    const float wx = ux * fx, wy = uy * fy, cross = 0.5f * (ux * fy + uy * fx);
    if (forced) {
        difference += wx - wy;
        shear += cross;
    }
    const float half = 0.5f * keep * difference, k11 = keep * shear, twice = 2.0f * k11;
    float m20 = pressure + uxqx + half, m02 = pressure + uyqy - half, m11 = k11 + uxqy;
    const float part = twice * uy + ux * ((third + pressure) - half);
    float m21 = twice * ux + uy * (third + m20), m12 = part + ux * uyqy;
    float m22 = ninth * density + uy * m21 + ux * part;
    if (forced) {
        m21 += 0.5f * fy * (third + ux * ux) + uy * wx;
        m12 += 0.5f * fx * (third + uy * uy) + ux * wy;
        m22 += wx * (third + uy * uy) + wy * (third + ux * ux);
        m20 += wx;
        m02 += wy;
        m11 += cross;
    }
    const float m10 = forced ? jx + fx : jx, m01 = forced ? jy + fy : jy;
    const float ax = 0.5f * (m20 - m22), bx = 0.5f * (m10 - m12);
    const float ay = 0.5f * (m02 - m22), by = 0.5f * (m01 - m21);
    const float c = 0.25f * (m22 + m11), d = 0.25f * (m21 + m12);
    const float g = 0.25f * (m22 - m11), h = 0.25f * (m21 - m12);
    const cell out = {(density - m20) - (m02 - m22), ax + bx, ay + by, ax - bx, ay - by,
                      c + d, g + h, c - d, g - h};
    return out;
}

/* Pull the populations of the columns from `begin` to `end` of row j, collide, and write them. */
LW_INLINE void collide_row(const step_job *job, int32_t j, int32_t begin, int32_t end, int forced) {
    const lw_lattice *lattice = job->lattice;
    const int64_t plane = lattice->plane, nx = lattice->nx, source = (j + job->shift_y) * nx + job->shift_x;
    const float *in = lattice->populations + source;
    const float *fx = lattice->force + source, *fy = fx + nx * lattice->ny;
    const float *in1 = in + plane - 1, *in2 = in + 2 * plane - nx, *in3 = in + 3 * plane + 1;
    const float *in4 = in + 4 * plane + nx, *in5 = in + 5 * plane - nx - 1, *in6 = in + 6 * plane - nx + 1;
    const float *in7 = in + 7 * plane + nx + 1, *in8 = in + 8 * plane + nx - 1;
    float *out = lattice->next + j * nx, *out1 = out + plane, *out2 = out1 + plane, *out3 = out2 + plane;
    float *out4 = out3 + plane, *out5 = out4 + plane, *out6 = out5 + plane, *out7 = out6 + plane;
    float *out8 = out7 + plane;
    const float keep = 1.0f - lattice->shear_rate;
    LW_INDEPENDENT
    for (int64_t i = begin; i < end; ++i) {
        const cell pulled = {in[i], in1[i], in2[i], in3[i], in4[i], in5[i], in6[i], in7[i], in8[i]};
        const cell f = collide(pulled, keep, forced ? fx[i] : 0.0f, forced ? fy[i] : 0.0f, forced);
        out[i] = f.rest;
        out1[i] = f.e;
        out2[i] = f.n;
        out3[i] = f.w;
        out4[i] = f.s;
        out5[i] = f.ne;
        out6[i] = f.nw;
        out7[i] = f.sw;
        out8[i] = f.se;
    }
}

/* Relax columns towards the stream. Where two fringes overlap, one follows the other. */
LW_INLINE void relax(const step_job *job, int32_t j, int32_t begin, int32_t end, float of_row) {
    const lw_lattice *lattice = job->lattice;
    const float *blend = lattice->blend;
    for (int q = 0; q < LW_DIRECTIONS; ++q) {
        float *row = lattice->next + q * lattice->plane + (int64_t)j * lattice->nx;
        const float stream = job->stream[q];
        LW_INDEPENDENT
        for (int32_t i = begin; i < end; ++i) {
            row[i] += (blend[i] + of_row * (1.0f - blend[i])) * (stream - row[i]);
        }
    }
}

LW_INLINE void fill(const step_job *job, int32_t j, int32_t begin, int32_t end) {
    for (int q = 0; q < LW_DIRECTIONS; ++q) {
        float *row = job->lattice->next + q * job->lattice->plane + (int64_t)j * job->lattice->nx;
        for (int32_t i = begin; i < end; ++i) {
            row[i] = job->stream[q];
        }
    }
}

LW_INLINE int32_t smaller(int32_t a, int32_t b) { return a < b ? a : b; }
LW_INLINE int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }

/* Up to whole vectors, within a row. */
LW_INLINE int32_t rounded(int32_t end, int32_t nx) { return smaller(nx, (end + LANES - 1) / LANES * LANES); }

/* A row from the old window to the new one. Rounded to whole vectors, some cells are computed from what
 * happens to lie beside the source's row, and are overwritten. */
LW_INLINE void advance_row(const step_job *job, int32_t j) {
    const lw_lattice *lattice = job->lattice;
    const int32_t nx = lattice->nx, ny = lattice->ny, source = j + job->shift_y;
    if (j == 0 || j == ny - 1 || source < 1 || source > ny - 2) {
        fill(job, j, 0, nx);
        return;
    }
    const int32_t begin = job->begin - job->begin % LANES;
    const int32_t end = rounded(job->end, nx);
    if (source >= lattice->force_begin && source < lattice->force_end) {
        collide_row(job, j, begin, end, 1);
    } else {
        collide_row(job, j, begin, end, 0);
    }
    const int32_t distance = smaller(j, ny - 1 - j);
    if (distance < lattice->fringe) {
        relax(job, j, 0, nx, lw_lattice_blend(lattice, distance));
    } else {
        const int32_t inner = nx - lattice->fringe, left = rounded(lattice->fringe, nx);
        relax(job, j, 0, left, 0.0f);
        relax(job, j, larger(left, inner - inner % LANES), nx, 0.0f);
    }
    fill(job, j, 0, job->begin);
    fill(job, j, job->end, nx);
}

LW_INLINE void advance_rows(const step_job *step, int32_t part) {
    const int32_t ny = step->lattice->ny, end = smaller(ny, (part + 1) * ROWS);
    for (int32_t k = part * ROWS; k < end; ++k) {
        advance_row(step, step->down ? ny - 1 - k : k);
    }
}

LW_VERSIONS(advance, advance_rows, (const step_job *step, int32_t part), (step, part), step->lattice->instructions)

static void advance_part(const void *job, int32_t part) {
    const unsigned mode = lw_flush_small();
    advance(job, part);
    lw_restore_small(mode);
}

/* In the same memory, a row is written LW_APART rows from its place, on that side from which the rows come: over
 * rows that none of those to come reads, whose neighbours are two rows away at most in a window that moves. */
void lw_lattice_step(lw_lattice *lattice, int32_t shift_x, int32_t shift_y) {
    const int32_t nx = lattice->nx, ny = lattice->ny;
    step_job job = {.lattice = lattice, .shift_x = shift_x, .shift_y = shift_y};
    job.begin = larger(1, 1 - shift_x);
    job.end = smaller(nx - 1, nx - 1 - shift_x);
    job.down = lattice->next > lattice->populations;
    lw_lattice_stream(lattice, job.stream);
    lw_threads_run(lattice->threads, advance_part, &job, (ny + ROWS - 1) / ROWS);
    float *const done = lattice->next;
    lattice->next = lattice->populations;
    lattice->populations = done;
}
