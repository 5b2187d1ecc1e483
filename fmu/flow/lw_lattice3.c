#include "lw_lattice3.h"

enum {
    ROWS = 16,  /* in one part of the job */
    LANES = 16, /* rows are worked on from and up to multiples of it: no remainders, aligned writes */
    AHEAD = 96  /* cells from those in work to those that memory is asked for */
};

/* Populations of a cell by their direction; the diagonals of a plane by the signs along its two axes. */
typedef struct { float pp, mm, pm, mp; } diagonals;
typedef struct { float rest, px, mx, py, my, pz, mz; diagonals xy, xz, yz; } cell;

typedef struct { float x, y, z; } vector;

typedef struct {
    const lw_lattice3 *lattice;
    int32_t shift[3];
    int32_t begin, end;               /* columns that have a source */
    int32_t down;                     /* rows come from the last to the first */
    int64_t upstream[LW_DIRECTIONS3]; /* from a cell of the first volume to what streams into it */
    float stream[LW_DIRECTIONS3];
} step_job;

/* What a collision knows of an axis: velocity, momentum q with half the force, their product, second central
 * moment, raw second moment less 1/3 (without terms in the force), force, its power. */
typedef struct { float u, q, uq, k2, m2, f, w; } axis;

/* Raw moments of a plane after the collision, m22 less 1/9. */
typedef struct { float m11, m21, m12, m22; } plane;

/* With third central moments zero they follow from the second ones and K22 (less 1/9). */
LW_INLINE plane in_plane(axis a, axis b, float k11, float k22, int forced) {
    const float third = 1.0f / 3.0f, twice = 2.0f * k11;
    const float part = twice * b.u + a.u * b.k2;
    plane m = {.m11 = k11 + a.u * b.q, .m21 = twice * a.u + b.u * (third + a.m2), .m12 = part + a.u * b.uq};
    m.m22 = k22 + b.u * m.m21 + a.u * part;
    if (forced) {
        m.m11 += 0.5f * (a.u * b.f + b.u * a.f);
        m.m21 += 0.5f * b.f * (third + a.u * a.u) + b.u * a.w;
        m.m12 += 0.5f * a.f * (third + b.u * b.u) + a.u * b.w;
        m.m22 += a.w * (third + b.u * b.u) + b.w * (third + a.u * a.u);
    }
    return m;
}

LW_INLINE diagonals of_plane(plane m) {
    const float c = 0.25f * (m.m22 + m.m11), d = 0.25f * (m.m21 + m.m12);
    const float g = 0.25f * (m.m22 - m.m11), h = 0.25f * (m.m21 - m.m12);
    const diagonals out = {c + d, c - d, g - h, g + h};
    return out;
}

LW_INLINE axis an_axis(float momentum, float inverse, float force, int forced) {
    axis a = {.q = forced ? momentum + 0.5f * force : momentum, .f = force};
    a.u = a.q * inverse;
    a.uq = a.u * a.q;
    a.w = a.u * force;
    return a;
}

/* Collide: the part of the second central moments without trace relaxes by `keep` = 1 - omega towards zero, their
 * trace and all higher ones are set to equilibrium, the fourth ones as they are with that part: less half of it along
 * the third axis, for the populations of the second ones alone have that. At K22 = rho/9 noise grows in a fluid at
 * rest, by 5e-3 a step. Momentum goes from j to j + F; q = j + F/2 = rho u. Of the raw
 * moments m_aa are kept less 1/3, m_aabb less 1/9: their values at rest. In each plane of two axes the algebra is
 * that of two dimensions. Terms in the force come last: without them the result has the bits of a force of zero. */
LW_INLINE cell collide(cell f, float keep, vector force, int forced) {
    const float third = 1.0f / 3.0f;
    const float along_x = f.px + f.mx, along_y = f.py + f.my, along_z = f.pz + f.mz;
    const float xy_same = f.xy.pp + f.xy.mm, xy_other = f.xy.pm + f.xy.mp, xy = xy_same + xy_other;
    const float xz_same = f.xz.pp + f.xz.mm, xz_other = f.xz.pm + f.xz.mp, xz = xz_same + xz_other;
    const float yz_same = f.yz.pp + f.yz.mm, yz_other = f.yz.pm + f.yz.mp, yz = yz_same + yz_other;
    const float xy_up = f.xy.pp - f.xy.mm, xy_down = f.xy.pm - f.xy.mp;
    const float xz_up = f.xz.pp - f.xz.mm, xz_down = f.xz.pm - f.xz.mp;
    const float yz_up = f.yz.pp - f.yz.mm, yz_down = f.yz.pm - f.yz.mp;
    const float density = f.rest + ((along_x + along_y) + along_z) + ((xy + xz) + yz); /* less 1 */
    const float jx = (f.px - f.mx) + ((xy_up + xy_down) + (xz_up + xz_down));
    const float jy = (f.py - f.my) + ((xy_up - xy_down) + (yz_up + yz_down));
    const float jz = (f.pz - f.mz) + ((xz_up - xz_down) + (yz_up - yz_down));
    const float inverse = 1.0f / (1.0f + density), pressure = third * density;
    axis x = an_axis(jx, inverse, force.x, forced), y = an_axis(jy, inverse, force.y, forced);
    axis z = an_axis(jz, inverse, force.z, forced);
    float kxx = (along_x + (xy + xz)) - x.uq, kyy = (along_y + (xy + yz)) - y.uq;
    float kzz = (along_z + (xz + yz)) - z.uq;
    float kxy = (xy_same - xy_other) - x.u * y.q, kxz = (xz_same - xz_other) - x.u * z.q;
    float kyz = (yz_same - yz_other) - y.u * z.q;
    if (forced) {
        kxx += x.w;
        kyy += y.w;
        kzz += z.w;
        kxy += 0.5f * (x.u * y.f + y.u * x.f);
        kxz += 0.5f * (x.u * z.f + z.u * x.f);
        kyz += 0.5f * (y.u * z.f + z.u * y.f);
    }
    const float mean = third * ((kxx + kyy) + kzz);
    const float sx = keep * (kxx - mean), sy = keep * (kyy - mean), sz = keep * (kzz - mean);
    const float dx = pressure + sx, dy = pressure + sy, dz = pressure + sz, fourth = third * pressure;
    x.k2 = third + dx, y.k2 = third + dy, z.k2 = third + dz;
    x.m2 = dx + x.uq, y.m2 = dy + y.uq, z.m2 = dz + z.uq;
    const plane m_xy = in_plane(x, y, keep * kxy, fourth - 0.5f * sz, forced);
    const plane m_xz = in_plane(x, z, keep * kxz, fourth - 0.5f * sy, forced);
    const plane m_yz = in_plane(y, z, keep * kyz, fourth - 0.5f * sx, forced);
    const float mxx = forced ? x.m2 + x.w : x.m2, myy = forced ? y.m2 + y.w : y.m2;
    const float mzz = forced ? z.m2 + z.w : z.m2;
    const float mx = forced ? jx + x.f : jx, my = forced ? jy + y.f : jy, mz = forced ? jz + z.f : jz;
    const float ax = 0.5f * (mxx - (m_xy.m22 + m_xz.m22)), bx = 0.5f * (mx - (m_xy.m12 + m_xz.m12));
    const float ay = 0.5f * (myy - (m_xy.m22 + m_yz.m22)), by = 0.5f * (my - (m_xy.m21 + m_yz.m12));
    const float az = 0.5f * (mzz - (m_xz.m22 + m_yz.m22)), bz = 0.5f * (mz - (m_xz.m21 + m_yz.m21));
    const float rest = (density - ((mxx + myy) + mzz)) + ((m_xy.m22 + m_xz.m22) + m_yz.m22);
    const cell out = {rest, ax + bx, ax - bx, ay + by, ay - by, az + bz, az - bz,
                      of_plane(m_xy), of_plane(m_xz), of_plane(m_yz)};
    return out;
}

/* Velocities of the directions. */
static const int8_t velocity[LW_DIRECTIONS3][3] = {
    {0, 0, 0},  {1, 0, 0},   {-1, 0, 0},  {0, 1, 0},  {0, -1, 0},  {0, 0, 1},  {0, 0, -1},
    {1, 1, 0},  {-1, -1, 0}, {1, -1, 0},  {-1, 1, 0}, {1, 0, 1},   {-1, 0, -1}, {1, 0, -1},
    {-1, 0, 1}, {0, 1, 1},   {0, -1, -1}, {0, 1, -1}, {0, -1, 1},
};

LW_INLINE int32_t smaller(int32_t a, int32_t b) { return a < b ? a : b; }
LW_INLINE int32_t larger(int32_t a, int32_t b) { return a > b ? a : b; }

/* Up and down to whole vectors, within a row. */
LW_INLINE int32_t up(int32_t i, int32_t nx) { return smaller(nx, (i + LANES - 1) / LANES * LANES); }
LW_INLINE int32_t down(int32_t i) { return i - i % LANES; }

/* A row on its way from the old window to the new one. */
typedef struct {
    const float *in[LW_DIRECTIONS3]; /* what streams into its first cell */
    float *out[LW_DIRECTIONS3];
    const float *force[3];
} passage;

/* A collision is as long as what the processor looks ahead: unasked, it would wait for memory in each. */
LW_INLINE void prefetch(const passage *row, int64_t i) {
#if defined(__GNUC__)
    for (int q = 0; q < LW_DIRECTIONS3; ++q) {
        __builtin_prefetch(row->in[q] + i);
    }
#else
    (void)row, (void)i;
#endif
}

/* Pull the populations of at most LANES cells, collide, and write them. */
LW_INLINE void collide_cells(const passage *row, int32_t begin, int32_t end, float keep, int forced) {
    const float *const *in = row->in, *const *force = row->force;
    float *const *out = row->out;
    LW_INDEPENDENT
    for (int64_t i = begin; i < end; ++i) {
        const cell pulled = {in[0][i], in[1][i], in[2][i], in[3][i], in[4][i], in[5][i], in[6][i],
                             {in[7][i], in[8][i], in[9][i], in[10][i]},
                             {in[11][i], in[12][i], in[13][i], in[14][i]},
                             {in[15][i], in[16][i], in[17][i], in[18][i]}};
        const vector push = {forced ? force[0][i] : 0.0f, forced ? force[1][i] : 0.0f,
                             forced ? force[2][i] : 0.0f};
        const cell f = collide(pulled, keep, push, forced);
        out[0][i] = f.rest;
        out[1][i] = f.px;
        out[2][i] = f.mx;
        out[3][i] = f.py;
        out[4][i] = f.my;
        out[5][i] = f.pz;
        out[6][i] = f.mz;
        out[7][i] = f.xy.pp;
        out[8][i] = f.xy.mm;
        out[9][i] = f.xy.pm;
        out[10][i] = f.xy.mp;
        out[11][i] = f.xz.pp;
        out[12][i] = f.xz.mm;
        out[13][i] = f.xz.pm;
        out[14][i] = f.xz.mp;
        out[15][i] = f.yz.pp;
        out[16][i] = f.yz.mm;
        out[17][i] = f.yz.pm;
        out[18][i] = f.yz.mp;
    }
}

/* A row without its end cells; from its last cells to the first where the rows come so, because the processor
 * expects memory to go on as it came. Rounded to whole vectors, some cells are computed from what happens to lie
 * beside the source's row, and are overwritten. */
LW_INLINE void collide_row(const step_job *job, const passage *row, int forced) {
    const int32_t begin = down(job->begin), end = up(job->end, job->lattice->nx);
    const int32_t vectors = (end - begin + LANES - 1) / LANES, ahead = job->down ? -AHEAD : AHEAD;
    const float keep = 1.0f - job->lattice->shear_rate;
    for (int32_t k = 0; k < vectors; ++k) {
        const int32_t i = begin + LANES * (job->down ? vectors - 1 - k : k);
        prefetch(row, i + ahead);
        if (i + LANES <= end) { /* a number of cells that the compiler knows */
            collide_cells(row, i, i + LANES, keep, forced);
        } else {
            collide_cells(row, i, end, keep, forced);
        }
    }
}

/* Relax columns towards the stream. Where fringes overlap, one follows the other. */
LW_INLINE void relax(const step_job *job, const passage *row, int32_t begin, int32_t end, float of_row) {
    const float *blend = job->lattice->blend;
    for (int q = 0; q < LW_DIRECTIONS3; ++q) {
        float *out = row->out[q];
        const float stream = job->stream[q];
        LW_INDEPENDENT
        for (int32_t i = begin; i < end; ++i) {
            out[i] += (blend[i] + of_row * (1.0f - blend[i])) * (stream - out[i]);
        }
    }
}

LW_INLINE void fill(const step_job *job, const passage *row, int32_t begin, int32_t end) {
    for (int q = 0; q < LW_DIRECTIONS3; ++q) {
        for (int32_t i = begin; i < end; ++i) {
            row->out[q][i] = job->stream[q];
        }
    }
}

LW_INLINE int outermost(int32_t at, int32_t n) { return at < 1 || at > n - 2; }

/* A row from the old window to the new one. */
LW_INLINE void advance_row(const step_job *job, int32_t number) {
    const lw_lattice3 *lattice = job->lattice;
    const int32_t nx = lattice->nx, ny = lattice->ny, nz = lattice->nz, j = number % ny, k = number / ny;
    const int32_t from_j = j + job->shift[1], from_k = k + job->shift[2];
    const int64_t from = (int64_t)from_k * ny + from_j, source = from * nx + job->shift[0];
    passage row;
    for (int q = 0; q < LW_DIRECTIONS3; ++q) {
        row.in[q] = lattice->populations + job->upstream[q] + source;
        row.out[q] = lattice->next + q * lattice->volume + (int64_t)number * nx;
    }
    if (outermost(j, ny) || outermost(k, nz) || outermost(from_j, ny) || outermost(from_k, nz)) {
        fill(job, &row, 0, nx);
        return;
    }
    for (int a = 0; a < 3; ++a) {
        row.force[a] = lattice->force + source + a * ((int64_t)nx * ny * nz);
    }
    if (lattice->forced[from]) {
        collide_row(job, &row, 1);
    } else {
        collide_row(job, &row, 0);
    }
    const float of_j = lw_lattice3_blend(lattice, smaller(j, ny - 1 - j));
    const float of_k = lw_lattice3_blend(lattice, smaller(k, nz - 1 - k));
    if (of_j > 0.0f || of_k > 0.0f) {
        relax(job, &row, 0, nx, of_j + of_k * (1.0f - of_j));
    } else {
        const int32_t left = up(lattice->fringe, nx), right = larger(left, down(nx - lattice->fringe));
        relax(job, &row, 0, left, 0.0f);
        relax(job, &row, right, nx, 0.0f);
    }
    fill(job, &row, 0, job->begin);
    fill(job, &row, job->end, nx);
}

LW_INLINE void advance_rows(const step_job *step, int32_t part) {
    const int32_t rows = step->lattice->ny * step->lattice->nz, end = smaller(rows, (part + 1) * ROWS);
    for (int32_t k = part * ROWS; k < end; ++k) {
        advance_row(step, step->down ? rows - 1 - k : k);
    }
}

LW_VERSIONS(advance, advance_rows, (const step_job *step, int32_t part), (step, part), step->lattice->instructions)

static void advance_part(const void *job, int32_t part) {
    const unsigned mode = lw_flush_small();
    advance(job, part);
    lw_restore_small(mode);
}

/* In the same memory, a row is written two slabs and three rows from its place, on that side from which the rows
 * come: over rows that none of those to come reads, whose neighbours are two slabs and two rows away at most in a
 * window that moves. */
void lw_lattice3_step(lw_lattice3 *lattice, const int32_t shift[3]) {
    const int32_t nx = lattice->nx, rows = lattice->ny * lattice->nz;
    step_job job = {.lattice = lattice, .shift = {shift[0], shift[1], shift[2]}};
    job.begin = larger(1, 1 - shift[0]);
    job.end = smaller(nx - 1, nx - 1 - shift[0]);
    job.down = lattice->next > lattice->populations;
    for (int q = 0; q < LW_DIRECTIONS3; ++q) {
        const int8_t *c = velocity[q];
        job.upstream[q] = q * lattice->volume - c[0] - nx * (c[1] + (int64_t)lattice->ny * c[2]);
    }
    lw_lattice3_stream(lattice, job.stream);
    lw_threads_run(lattice->threads, advance_part, &job, (rows + ROWS - 1) / ROWS);
    float *const done = lattice->next;
    lattice->next = lattice->populations;
    lattice->populations = done;
}
