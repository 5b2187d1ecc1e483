/* Where the rings lie: what runs between which corners, and what is put where when the bodies move. */
#include "lw_surface.h"

lw_sizes lw_sizes_of(const lw_vortex *v) {
    const int32_t n = v->surfaces, c = v->chordwise, s = v->spanwise;
    lw_sizes z = {.rings = c * s, .corners = (c + 1) * (s + 1), .spanwise = c * s, .columns = 6 * n};
    z.bearers = z.spanwise + c * (s + 1);
    z.targets = lw_lanes(n * (z.rings + z.bearers));
    return z;
}

/* Filament k of a surface that bears force: those along the span but for the last, which lies in the wake's first
 * and bears none (Kutta), then those along the chord. */
static lw_bearer bearer_of(const lw_vortex *v, int32_t surface, int32_t k) {
    const int32_t s = v->spanwise, first = surface * v->chordwise * s, across = v->chordwise * s;
    lw_bearer b = {.surface = surface};
    if (k < across) {
        const int32_t i = k / s, j = k % s;
        b.from = i * (s + 1) + j;
        b.to = b.from + 1;
        b.with = first + k;
        b.against = i > 0 ? first + k - s : -1;
    } else {
        const int32_t i = (k - across) / (s + 1), j = (k - across) % (s + 1);
        b.from = i * (s + 1) + j;
        b.to = b.from + s + 1;
        b.with = j > 0 ? first + i * s + j - 1 : -1;
        b.against = j < s ? first + i * s + j : -1;
    }
    return b;
}

/* Filament k of a surface, those that bear force first, then those of the trailing edge. */
lw_bearer lw_filament_of(const lw_vortex *v, int32_t surface, int32_t k) {
    const lw_sizes z = lw_sizes_of(v);
    if (k < z.bearers) return bearer_of(v, surface, k);
    const int32_t s = v->spanwise, j = k - z.bearers, from = v->chordwise * (s + 1) + j;
    return (lw_bearer){surface, from, from + 1, -1, (surface + 1) * z.rings - s + j};
}

int32_t lw_vortex_bound(const lw_vortex *v, const double *strength, lw_filament *filaments) {
    const lw_sizes z = lw_sizes_of(v);
    int32_t count = 0;
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const double *placed = v->placed + 3 * b * z.corners;
        for (int32_t k = 0; k < z.bearers + v->spanwise; ++k) {
            const lw_bearer f = lw_filament_of(v, b, k);
            lw_filament *filament = &filaments[count++];
            *filament = (lw_filament){.strength = lw_net(strength, &f), .core = v->core};
            lw_store3(filament->a, lw_load3(placed + 3 * f.from));
            lw_store3(filament->b, lw_load3(placed + 3 * f.to));
        }
    }
    return count;
}

lw_points lw_vortex_room(const lw_vortex *v, int32_t count) {
    const int32_t apart = lw_vortex_points(v);
    lw_points points = {.count = lw_lanes(count), .instructions = v->instructions, .threads = v->threads};
    for (int axis = 0; axis < 3; ++axis) {
        points.at[axis] = v->points + (size_t)axis * apart;
        points.velocity[axis] = v->points + (size_t)(3 + axis) * apart;
        for (int32_t k = count; k < points.count; ++k) points.at[axis][k] = 0.0;
        lw_fill(points.velocity[axis], (size_t)points.count);
    }
    return points;
}

/* Where the vorticity that a step sheds lies at its end, x panels behind the trailing edge: a third of the way
 * that the fluid goes along the plate in a step, less 1/12; so lift is right for long and short ways. For a way
 * of one panel that is 1/4, as everywhere on the plate. Without a way it is 0, which gives the exact added mass,
 * and at least -1/3 of a short way. The corner of the wake that was shed at x has gone that way since:
 * x = (x + way) / 4 - 1/16, or -(x + way) / 2. */
static lw_vec3 shed_from(lw_vec3 edge, lw_vec3 panel, const double *wake) {
    const double farthest = 1.0, gone = lw_dot(lw_sub(lw_load3(wake), edge), panel) / lw_dot(panel, panel);
    const double far = 0.25 * gone - 0.0625, near = -0.5 * gone, most = far > near ? far : near;
    return lw_add(edge, lw_scale(gone < 0.0 ? 0.0 : most < farthest ? most : farthest, panel));
}

void lw_vortex_place(lw_vortex *v, const double *pose) {
    const lw_sizes z = lw_sizes_of(v);
    const int32_t across = v->spanwise + 1;
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const lw_vec3 centre = lw_load3(pose + 7 * b);
        const lw_mat3 turn = lw_quat_matrix(lw_load4(pose + 7 * b + 3));
        for (int32_t k = b * z.corners; k < (b + 1) * z.corners; ++k)
            lw_store3(v->placed + 3 * k, lw_add(centre, lw_mat_vec(turn, lw_load3(v->corner + 3 * k))));
        for (int32_t j = 0; j < across; ++j) {
            double *last = v->placed + 3 * ((b + 1) * z.corners - across + j);
            const lw_vec3 panel = lw_sub(lw_load3(last), lw_load3(last - 3 * across));
            const lw_vec3 edge = lw_sub(lw_load3(last), lw_scale(0.25, panel));
            lw_store3(v->edge + 3 * (b * across + j), edge);
            if (v->rows > 0) lw_store3(last, shed_from(edge, panel, v->wake + 3 * (b * across + j)));
        }
    }
}

/* Area vectors of the rings, and the targets: collocation points and middles of what bears force. */
lw_points lw_place_targets(lw_vortex *v, const double *pose) {
    const lw_sizes z = lw_sizes_of(v);
    const lw_points points = lw_vortex_room(v, v->surfaces * (z.rings + z.bearers));
    const int32_t s = v->spanwise, row = 3 * (s + 1);
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const lw_vec3 centre = lw_load3(pose + 7 * b);
        const lw_mat3 turn = lw_quat_matrix(lw_load4(pose + 7 * b + 3));
        const double *placed = v->placed + 3 * b * z.corners;
        for (int32_t k = 0; k < z.rings; ++k) {
            const int32_t ring = b * z.rings + k;
            lw_put(&points, ring, lw_add(centre, lw_mat_vec(turn, lw_load3(v->control + 3 * ring))));
            const double *corner = placed + (k / s) * row + 3 * (k % s);
            const lw_vec3 down = lw_sub(lw_load3(corner + row + 3), lw_load3(corner));
            const lw_vec3 up = lw_sub(lw_load3(corner + row), lw_load3(corner + 3));
            lw_store3(v->normal + 3 * ring, lw_scale(0.5, lw_cross(down, up)));
        }
        for (int32_t k = 0; k < z.bearers; ++k) {
            const lw_bearer f = lw_filament_of(v, b, k);
            const lw_vec3 ends = lw_add(lw_load3(placed + 3 * f.from), lw_load3(placed + 3 * f.to));
            lw_put(&points, v->surfaces * z.rings + b * z.bearers + k, lw_scale(0.5, ends));
        }
    }
    return points;
}
