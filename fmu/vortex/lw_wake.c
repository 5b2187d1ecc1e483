/* Wakes: what the trailing edges leave behind goes with the fluid. */
#include "lw_wake.h"

#include "lw_surface.h"

/* Corner j of the r-th edge between rows of rings: 0 is the trailing edge. */
static double *edge(const lw_vortex *v, int32_t surface, int32_t r, int32_t j) {
    const int32_t across = v->spanwise + 1;
    if (r == 0) return v->placed + 3 * (((surface + 1) * (v->chordwise + 1) - 1) * across + j);
    return v->wake + 3 * (((r - 1) * v->surfaces + surface) * across + j);
}

/* Strength of a ring of row r; 0 where there is none. */
static double ring(const lw_vortex *v, int32_t surface, int32_t r, int32_t j) {
    if (r < 0 || r >= v->rows || j < 0 || j >= v->spanwise) return 0.0;
    return v->wake_rings[(r * v->surfaces + surface) * v->spanwise + j];
}

/* The core is at most so much of the distance from the edge, which is not felt on the wing. */
static const double GROWTH = 0.1;

static void add(const lw_vortex *v, lw_filament *f, const double *from, const double *to, double strength,
                lw_vec3 shed) {
    *f = (lw_filament){.strength = strength};
    const lw_vec3 a = lw_load3(from), b = lw_load3(to);
    lw_store3(f->a, a), lw_store3(f->b, b);
    const double away = GROWTH * lw_norm(lw_sub(lw_scale(0.5, lw_add(a, b)), shed));
    f->core = away < v->core ? away : v->core;
    if (f->core < LW_SHEET * v->core) f->core = LW_SHEET * v->core;
}

int32_t lw_wake_filaments(const lw_vortex *v, lw_filament *filaments) {
    int32_t count = 0;
    for (int32_t b = 0; b < v->surfaces && v->rows > 0; ++b)
        for (int32_t r = 0; r <= v->rows; ++r)
            for (int32_t j = 0; j <= v->spanwise; ++j) {
                const double *here = edge(v, b, r, j), *shed = edge(v, b, 0, j);
                if (j < v->spanwise) {
                    const lw_vec3 middle = lw_scale(0.5, lw_add(lw_load3(shed), lw_load3(edge(v, b, 0, j + 1))));
                    const double strength = ring(v, b, r, j) - ring(v, b, r - 1, j);
                    add(v, &filaments[count++], here, edge(v, b, r, j + 1), strength, middle);
                }
                if (r < v->rows) {
                    const double strength = ring(v, b, r, j - 1) - ring(v, b, r, j);
                    add(v, &filaments[count++], here, edge(v, b, r + 1, j), strength, lw_load3(shed));
                }
            }
    return count;
}

int lw_wake_go(lw_vortex *v, double t) {
    const int32_t n = v->surfaces, s = v->spanwise, across = n * (s + 1);
    const int32_t bodies = lw_vortex_bound(v, v->strength, v->filaments);
    const int32_t filaments = bodies + lw_wake_filaments(v, v->filaments + bodies);
    for (int32_t k = 0; k < filaments; ++k) v->filaments[k].core = v->core; /* the points lie on filaments */
    const int32_t rows = v->rows + 1 < v->capacity ? v->rows + 1 : v->capacity;
    const lw_points points = lw_vortex_room(v, rows * across);
    int fault = 0;
    for (int32_t k = 0; k < rows * across; ++k) {
        const double *from = edge(v, k % across / (s + 1), k / across, k % (s + 1));
        for (int axis = 0; axis < 3; ++axis) points.at[axis][k] = from[axis];
    }
    lw_filaments_add(v->filaments, filaments, &points);
    for (int32_t k = 0; k < rows * across; ++k) {
        const lw_vec3 r = lw_vec(points.at[0][k], points.at[1][k], points.at[2][k]), zero = {0.0, 0.0, 0.0};
        const lw_vec3 u = lw_vec(points.velocity[0][k], points.velocity[1][k], points.velocity[2][k]);
        lw_vec3 wind = lw_wind_at(&v->wind, t, r, zero).velocity;
        if (!isfinite(wind.x + wind.y + wind.z)) {
            if (!fault) fault = 1 + k;
            wind = lw_neg(u);
        }
        lw_store3(v->wake + 3 * k, lw_add(r, lw_scale(v->step, lw_add(wind, u))));
    }
    for (int32_t k = rows * n * s - 1; k >= n * s; --k) v->wake_rings[k] = v->wake_rings[k - n * s];
    for (int32_t k = 0; k < n * s; ++k) /* the last row of each surface's rings */
        v->wake_rings[k] = v->strength[(k / s * v->chordwise + v->chordwise - 1) * s + k % s];
    v->rows = rows;
    return fault;
}
