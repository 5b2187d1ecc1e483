/* Radau IIA of order 5: README, section Integrators. E. Hairer, G. Wanner, Solving Ordinary Differential Equations
 * II, 1996, IV.5 and IV.8, in the accelerations alone: for given velocities the stages' coordinates are known. */
#include "lw_integrate.h"

#include <string.h>

enum { STAGES = 3, NEWTON_ITERATIONS = 50, TURN_ITERATIONS = 100 };

static const double c[STAGES] = {0.15505102572168219, 0.64494897427831781, 1.0};
/* Its last row is its weights. */
static const double a[STAGES][STAGES] = {
    {0.196815477223660426, -0.0655354258501983881, 0.0237709743482201524},
    {0.394424314739087277, 0.292073411665228463, -0.0415487521259979302},
    {0.376403062700467275, 0.512485826188421614, 0.111111111111111111}};
static const double a_inverse[STAGES][STAGES] = {
    {3.22474487139158905, 1.16784008469040549, -0.253197264742180826},
    {-3.56784008469040549, 0.775255128608410951, 1.05319726474218083},
    {5.53197264742180826, -7.53197264742180826, 5.0}};

/* a_inverse = t diag(single, [pair, turn; -turn, pair]) t_inverse: its eigenvalues are single, pair ± i turn. */
static const double single = 3.63783425274449573, pair = 2.68108287362775213, turn = 3.05043019924741057;
static const double t[STAGES][STAGES] = {
    {0.0944387624889752415, -0.141255295020954208, 0.0300291941051474245},
    {0.250213122965333311, 0.204129352293799932, -0.382942112757261938},
    {1.0, 1.0, 0.0}};
static const double t_inverse[STAGES][STAGES] = {
    {4.17871859155190473, 0.327682820761062387, 0.523376445499449548},
    {-4.17871859155190473, -0.327682820761062387, 0.476623554500550452},
    {0.502872634945786876, -2.57192694985560543, 0.596039204828224925}};

static const double nudge = 1e-5;     /* rad, m, rad/s, m/s, to differentiate */
static const double converged = 1e-15; /* change of a velocity, relative to the largest: round-off */
static const double accepted = 1e-8; /* where Newton's method may end; relative to velocities and coordinates / h */

/* The caller's memory, cut into arrays. */
typedef struct {
    int nq, nv;
    double s, time, h; /* start in macro steps, in s; length */
    double *stage[STAGES], *along;       /* (nq + nv + 2) */
    double *change;                      /* (3,nv) */
    double *by_q, *by_v;                 /* (nv,nv) derivatives of the accelerations, a column for each velocity */
    double *one, *two;                   /* (nv,nv), (2nv,2nv): factors for the real eigenvalue, for the pair */
    double *one_pivots, *two_pivots;     /* (nv), (2nv) */
} lw_radau;

size_t lw_radau5_size(int32_t nq, int32_t nv) {
    size_t m = (size_t)nv, length = (size_t)nq + m + 2;
    return (STAGES + 1) * length + 2 * STAGES * m + 7 * m * m;
}

static lw_radau lay_out(const lw_multibody *mb, double *next) {
    size_t m = (size_t)mb->nv, length = (size_t)mb->nq + m + 2;
    lw_radau r = {.nq = mb->nq, .nv = mb->nv};
    for (int j = 0; j < STAGES; ++j, next += length) r.stage[j] = next;
    r.along = next, next += length;
    r.change = next, next += STAGES * m;
    r.one_pivots = next, next += m;
    r.two_pivots = next, next += 2 * m;
    r.by_q = next, next += m * m;
    r.by_v = next, next += m * m;
    r.one = next, next += m * m;
    r.two = next;
    return r;
}

static double largest(const double *values, int count) {
    double size = 0.0;
    for (int k = 0; k < count; ++k) size = fmax(size, fabs(values[k]));
    return size;
}

/* Largest velocity, and largest coordinate, of the joints. */
static double fastest(const lw_multibody *mb, const double *v) {
    double size = 0.0;
    for (int i = 0; i < mb->n; ++i) size = fmax(size, largest(v + mb->link[i].v, mb->link[i].columns));
    return size;
}

static double farthest(const lw_multibody *mb, const double *q) {
    double size = 0.0;
    for (int i = 0; i < mb->n; ++i)
        size = fmax(size, largest(q + mb->link[i].q, lw_joint_nq(mb->link[i].type)));
    return size;
}

/* ---- derivatives of the accelerations at the start of the step ---- */

/* (f(y + d along) - f(y - d along)) / 2d, d = nudge */
static int difference(lw_run *run, lw_radau *r, double *matrix, int column) {
    lw_multibody *mb = run->mb;
    double *ahead = mb->rate[3], *behind = mb->rate[4];
    for (int side = 0; side < 2; ++side) {
        double step = side ? -nudge : nudge;
        for (int k = 0; k < r->nq + r->nv; ++k) mb->trial[k] = mb->y[k] + step * r->along[k];
        int status = lw_derive(run, r->s, r->time, mb->trial, side ? behind : ahead);
        if (status) return status;
    }
    for (int i = 0; i < r->nv; ++i)
        matrix[(size_t)i * r->nv + column] = (ahead[r->nq + i] - behind[r->nq + i]) / (2.0 * nudge);
    return LW_OK;
}

/* A column of both: along what the closures leave of a velocity of 1, off which the accelerations may be steep,
 * and along the motion that this is. Without laws of forces they are quadratic in v, so that the first
 * difference is exact. */
static int differentiate(lw_run *run, lw_radau *r, int column) {
    lw_multibody *mb = run->mb;
    double *velocity = r->along + r->nq;
    memset(r->along, 0, ((size_t)r->nq + r->nv + 2) * sizeof(double));
    velocity[column] = 1.0;
    int status = mb->rows ? lw_allow(mb, mb->y, velocity, run->step->fault) : LW_OK;
    if (!status) status = difference(run, r, r->by_v, column);
    if (status) return status;
    lw_coordinate_rate(mb, mb->y, velocity, r->along);
    memset(velocity, 0, (size_t)r->nv * sizeof(double));
    return difference(run, r, r->by_q, column);
}

static int linearise(lw_run *run, lw_radau *r) {
    const lw_multibody *mb = run->mb;
    memset(r->by_q, 0, 2 * (size_t)r->nv * r->nv * sizeof(double));
    for (int i = 0; i < mb->n; ++i)
        for (int k = mb->link[i].v; k < mb->link[i].v + mb->link[i].columns; ++k) {
            int status = differentiate(run, r, k);
            if (status) return status;
        }
    return LW_OK;
}

/* ---- linear systems: lambda - h by_v - h² / lambda by_q for each eigenvalue lambda ---- */

static int factor(lw_radau *r) {
    int m = r->nv, wide = 2 * m;
    double size = pair * pair + turn * turn, h = r->h;
    for (int i = 0; i < m; ++i)
        for (int j = 0; j < m; ++j) {
            double speed = h * r->by_v[(size_t)i * m + j], place = h * h * r->by_q[(size_t)i * m + j];
            double own = (i == j ? pair : 0.0) - speed - pair / size * place;
            double cross = (i == j ? turn : 0.0) + turn / size * place;
            r->one[(size_t)i * m + j] = (i == j ? single : 0.0) - speed - place / single;
            r->two[(size_t)i * wide + j] = r->two[(size_t)(m + i) * wide + m + j] = own;
            r->two[(size_t)i * wide + m + j] = cross;
            r->two[(size_t)(m + i) * wide + j] = -cross;
        }
    return lw_factor(m, r->one, r->one_pivots) || lw_factor(wide, r->two, r->two_pivots);
}

/* (3,nv), in place: what the stages lack, as what to change of their velocities. */
static void solve(lw_radau *r) {
    int m = r->nv;
    double *x = r->change, *y = x + m, *z = y + m;
    for (int i = 0; i < m; ++i) {
        double lack[STAGES] = {x[i], y[i], z[i]};
        for (int j = 0; j < STAGES; ++j)
            x[j * m + i] = t_inverse[j][0] * lack[0] + t_inverse[j][1] * lack[1] + t_inverse[j][2] * lack[2];
    }
    lw_substitute(m, r->one, r->one_pivots, x);
    lw_substitute(2 * m, r->two, r->two_pivots, y);
    for (int i = 0; i < m; ++i) {
        double part[STAGES] = {x[i], y[i], z[i]};
        for (int j = 0; j < STAGES; ++j)
            x[j * m + i] = t[j][0] * part[0] + t[j][1] * part[1] + t[j][2] * part[2];
    }
}

/* ---- Newton's method ---- */

/* The coordinates of the stages for their velocities: at once, but for rotations, whose rates depend on them. */
static int follow(lw_run *run, lw_radau *r) {
    lw_multibody *mb = run->mb;
    double change = HUGE_VAL;
    for (int k = 0; k < TURN_ITERATIONS && change > 1e-15; ++k) {
        for (int j = 0; j < STAGES; ++j)
            lw_coordinate_rate(mb, r->stage[j], r->stage[j] + r->nq, mb->rate[j]);
        change = 0.0;
        for (int j = 0; j < STAGES; ++j)
            for (int i = 0; i < r->nq; ++i) {
                double rate = 0.0, q;
                for (int l = 0; l < STAGES; ++l) rate += a[j][l] * mb->rate[l][i];
                q = mb->y[i] + r->h * rate;
                change = fmax(change, fabs(q - r->stage[j][i]));
                r->stage[j][i] = q;
            }
    }
    return change > 1e-15;
}

/* Move the stages' velocities by one step of Newton's method; returns the largest change and what has it. */
static double correct(lw_run *run, lw_radau *r, int *worst) {
    lw_multibody *mb = run->mb;
    const double *start = mb->y + r->nq;
    int m = r->nv;
    double now = 0.0;
    for (int j = 0; j < STAGES; ++j)
        for (int i = 0; i < m; ++i) {
            double lack = r->h * mb->rate[j][r->nq + i];
            for (int k = 0; k < STAGES; ++k) lack -= a_inverse[j][k] * (r->stage[k][r->nq + i] - start[i]);
            r->change[j * m + i] = lack;
        }
    for (int i = 0; i < mb->n; ++i) /* what is prescribed lacks nothing */
        for (int k = 0; k < mb->link[i].columns; ++k)
            for (int j = 0; j < STAGES && mb->link[i].prescribed >> k & 1; ++j)
                r->change[j * m + mb->link[i].v + k] = 0.0;
    solve(r);
    for (int k = 0; k < STAGES * m; ++k) {
        r->stage[k / m][r->nq + k % m] += r->change[k];
        if (!(fabs(r->change[k]) <= now)) now = fabs(r->change[k]), *worst = k % m;
    }
    return now;
}

/* Stiffly accurate: the last stage is the result. */
static void finish(lw_run *run, lw_radau *r) {
    lw_multibody *mb = run->mb;
    int first = r->nq + r->nv;
    memcpy(mb->y, r->stage[STAGES - 1], (size_t)first * sizeof(double));
    for (int i = first; i < first + 2; ++i)
        for (int j = 0; j < STAGES; ++j) mb->y[i] += r->h * a[STAGES - 1][j] * mb->rate[j][i];
}

static int fail(lw_run *run, double s, int column) {
    const lw_multibody *mb = run->mb;
    run->step->fault->time = s * run->step->h;
    for (int i = 0; i < mb->n; ++i)
        if (column >= mb->link[i].v && column < mb->link[i].v + mb->link[i].columns)
            run->step->fault->item = mb->link[i].body;
    return LW_NEWTON;
}

int lw_radau5(lw_run *run, double s, double time, double width, double h) {
    lw_multibody *mb = run->mb;
    lw_radau r = lay_out(mb, run->step->memory);
    r.s = s, r.time = time, r.h = h;
    double last = HUGE_VAL, *end = r.stage[STAGES - 1];
    int worst = mb->n ? mb->link[0].v : 0, status = linearise(run, &r);
    if (status) return status;
    if (factor(&r)) return fail(run, s, worst);
    for (int j = 0; j < STAGES; ++j)
        memcpy(r.stage[j], mb->y, ((size_t)r.nq + r.nv) * sizeof(double));
    for (int k = 0; k < NEWTON_ITERATIONS; ++k) {
        if (follow(run, &r)) break;
        for (int j = 0; j < STAGES && !status; ++j)
            status = lw_derive(run, s + c[j] * width, time + c[j] * h, r.stage[j], mb->rate[j]);
        if (status && k == 0) return status; /* further on, Newton's method has led astray */
        double now = status ? HUGE_VAL : correct(run, &r, &worst);
        if (!isfinite(now)) break;
        double speed = fastest(mb, end + r.nq), size = fmax(speed, farthest(mb, end) / h);
        if (now <= converged * speed || (now >= last && now <= accepted * size)) {
            follow(run, &r);
            finish(run, &r);
            return LW_OK;
        }
        last = now;
    }
    return fail(run, s, worst);
}
