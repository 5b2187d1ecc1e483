/* Groups of points stand still, filaments pass by: a sum never depends on who computes it. */
#include "lw_filaments.h"

enum { GROUPS = 4 }; /* of points, that a thread takes at a time */

typedef struct {
    const lw_filament *filaments;
    const lw_points *points;
    int32_t count;
} add_job;

static const double PI = 3.14159265358979323846;

int32_t lw_lanes(int32_t count) { return (count + LW_LANES - 1) / LW_LANES * LW_LANES; }

LW_INLINE void add_group(const add_job *job, int32_t first) {
    const lw_points *points = job->points;
    const double *restrict x = points->at[0] + first, *restrict y = points->at[1] + first;
    const double *restrict z = points->at[2] + first;
    double u[LW_LANES] = {0.0}, v[LW_LANES] = {0.0}, w[LW_LANES] = {0.0};
    for (int32_t k = 0; k < job->count; ++k) {
        const lw_filament *f = &job->filaments[k];
        const double lx = f->b[0] - f->a[0], ly = f->b[1] - f->a[1], lz = f->b[2] - f->a[2];
        const double smooth = f->core * f->core * (lx * lx + ly * ly + lz * lz);
        const double factor = f->strength / (4.0 * PI);
        for (int i = 0; i < LW_LANES; ++i) {
            const double ax = x[i] - f->a[0], ay = y[i] - f->a[1], az = z[i] - f->a[2];
            const double bx = x[i] - f->b[0], by = y[i] - f->b[1], bz = z[i] - f->b[2];
            const double a = sqrt(ax * ax + ay * ay + az * az), b = sqrt(bx * bx + by * by + bz * bz);
            const double across = a * b, along = ax * bx + ay * by + az * bz;
            const double below = across * (across + along) + smooth;
            const double scale = below > 0.0 ? factor * (a + b) / below : 0.0; /* on the filament: none */
            u[i] += scale * (ay * bz - az * by);
            v[i] += scale * (az * bx - ax * bz);
            w[i] += scale * (ax * by - ay * bx);
        }
    }
    for (int i = 0; i < LW_LANES; ++i) {
        points->velocity[0][first + i] += u[i];
        points->velocity[1][first + i] += v[i];
        points->velocity[2][first + i] += w[i];
    }
}

LW_INLINE void add_groups(const add_job *job, int32_t part) {
    const int32_t begin = part * GROUPS * LW_LANES, most = begin + GROUPS * LW_LANES;
    const int32_t end = most < job->points->count ? most : job->points->count;
    for (int32_t first = begin; first < end; first += LW_LANES) add_group(job, first);
}

LW_VERSIONS(add, add_groups, (const add_job *job, int32_t part), (job, part), job->points->instructions)

static void add_part(const void *job, int32_t part) { add(job, part); }

void lw_filaments_add(const lw_filament *filaments, int32_t count, const lw_points *points) {
    const add_job job = {filaments, points, count};
    const int32_t size = GROUPS * LW_LANES;
    lw_threads_run(points->threads, add_part, &job, (points->count + size - 1) / size);
}
