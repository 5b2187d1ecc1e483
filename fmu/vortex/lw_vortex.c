/* The strengths of the rings and the wrench: what a trial state asks for, and how it changes with the twists. */
#include "lw_vortex.h"

#include <stddef.h>

#include "lw_dense.h"
#include "lw_linear.h"
#include "lw_wake.h"

/* A filament of the bodies that bears force, between the corners `from` and `to` of one surface: the ring
 * that runs along it, and the one that runs against it; -1 for none. */
typedef struct { int32_t surface, from, to, with, against; } bearer;

/* Derived sizes. */
typedef struct { int32_t rings, corners, spanwise, bearers, targets, columns; } sizes;

static sizes sizes_of(const lw_vortex *v) {
    const int32_t n = v->surfaces, c = v->chordwise, s = v->spanwise;
    sizes z = {.rings = c * s, .corners = (c + 1) * (s + 1), .spanwise = c * s, .columns = 6 * n};
    z.bearers = z.spanwise + c * (s + 1);
    z.targets = lw_lanes(n * (z.rings + z.bearers));
    return z;
}

void lw_vortex_init(lw_vortex *v) { v->instructions = (int32_t)lw_instructions_here(); }

int32_t lw_vortex_targets(const lw_vortex *v) { return sizes_of(v).targets; }

int32_t lw_vortex_points(const lw_vortex *v) {
    const int32_t targets = lw_vortex_targets(v), wake = lw_lanes(v->capacity * v->surfaces * (v->spanwise + 1));
    return targets > wake ? targets : wake;
}

int32_t lw_vortex_filaments(const lw_vortex *v) {
    const int32_t each = 2 * v->spanwise + 1; /* in a row of rings: across, and along */
    return v->surfaces * (each * (v->chordwise + v->capacity) + 2 * v->spanwise);
}

static void fill(double *values, size_t count) {
    for (size_t k = 0; k < count; ++k) values[k] = 0.0;
}

/* Filament k of a surface that bears force: those along the span but for the last, which lies in the wake's first
 * and bears none (Kutta), then those along the chord. */
static bearer bearer_of(const lw_vortex *v, int32_t surface, int32_t k) {
    const int32_t s = v->spanwise, first = surface * v->chordwise * s, across = v->chordwise * s;
    bearer b = {.surface = surface};
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

static double net(const double *strength, const bearer *b) {
    return (b->with < 0 ? 0.0 : strength[b->with]) - (b->against < 0 ? 0.0 : strength[b->against]);
}

/* Filament k of a surface, those that bear force first, then those of the trailing edge. */
static bearer filament_of(const lw_vortex *v, int32_t surface, int32_t k) {
    const sizes z = sizes_of(v);
    if (k < z.bearers) return bearer_of(v, surface, k);
    const int32_t s = v->spanwise, j = k - z.bearers, from = v->chordwise * (s + 1) + j;
    return (bearer){surface, from, from + 1, -1, (surface + 1) * z.rings - s + j};
}

int32_t lw_vortex_bound(const lw_vortex *v, const double *strength, lw_filament *filaments) {
    const sizes z = sizes_of(v);
    int32_t count = 0;
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const double *placed = v->placed + 3 * b * z.corners;
        for (int32_t k = 0; k < z.bearers + v->spanwise; ++k) {
            const bearer f = filament_of(v, b, k);
            lw_filament *filament = &filaments[count++];
            *filament = (lw_filament){.strength = net(strength, &f), .core = v->core};
            lw_store3(filament->a, lw_load3(placed + 3 * f.from));
            lw_store3(filament->b, lw_load3(placed + 3 * f.to));
        }
    }
    return count;
}

/* ---- geometry ---- */

static void put(const lw_points *points, int32_t k, lw_vec3 r) {
    points->at[0][k] = r.x, points->at[1][k] = r.y, points->at[2][k] = r.z;
}

static lw_vec3 at(double *const axes[3], int32_t k) { return lw_vec(axes[0][k], axes[1][k], axes[2][k]); }

lw_points lw_vortex_room(const lw_vortex *v, int32_t count) {
    const int32_t apart = lw_vortex_points(v);
    lw_points points = {.count = lw_lanes(count), .instructions = v->instructions, .threads = v->threads};
    for (int axis = 0; axis < 3; ++axis) {
        points.at[axis] = v->points + (size_t)axis * apart;
        points.velocity[axis] = v->points + (size_t)(3 + axis) * apart;
        for (int32_t k = count; k < points.count; ++k) points.at[axis][k] = 0.0;
        fill(points.velocity[axis], (size_t)points.count);
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
    const sizes z = sizes_of(v);
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
static lw_points place_targets(lw_vortex *v, const double *pose) {
    const sizes z = sizes_of(v);
    const lw_points points = lw_vortex_room(v, v->surfaces * (z.rings + z.bearers));
    const int32_t s = v->spanwise, row = 3 * (s + 1);
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const lw_vec3 centre = lw_load3(pose + 7 * b);
        const lw_mat3 turn = lw_quat_matrix(lw_load4(pose + 7 * b + 3));
        const double *placed = v->placed + 3 * b * z.corners;
        for (int32_t k = 0; k < z.rings; ++k) {
            const int32_t ring = b * z.rings + k;
            put(&points, ring, lw_add(centre, lw_mat_vec(turn, lw_load3(v->control + 3 * ring))));
            const double *corner = placed + (k / s) * row + 3 * (k % s);
            const lw_vec3 down = lw_sub(lw_load3(corner + row + 3), lw_load3(corner));
            const lw_vec3 up = lw_sub(lw_load3(corner + row), lw_load3(corner + 3));
            lw_store3(v->normal + 3 * ring, lw_scale(0.5, lw_cross(down, up)));
        }
        for (int32_t k = 0; k < z.bearers; ++k) {
            const bearer f = bearer_of(v, b, k);
            const lw_vec3 ends = lw_add(lw_load3(placed + 3 * f.from), lw_load3(placed + 3 * f.to));
            put(&points, v->surfaces * z.rings + b * z.bearers + k, lw_scale(0.5, ends));
        }
    }
    return points;
}

/* ---- the flow through the rings ---- */

static void gather(double *to, const double *from, double sign, int32_t count) {
    for (int32_t k = 0; k < count; ++k) to[k] += sign * from[k];
}

/* Velocity at the targets by each ring of strength 1. Two rings share most filaments, which are done once. */
static void influence(lw_vortex *v, const lw_points *targets) {
    const sizes z = sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, size = 3 * z.targets;
    fill(v->influence, (size_t)rings * size);
    lw_points alone = *targets; /* a filament is too little to share */
    alone.threads = NULL;
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const double *placed = v->placed + 3 * b * z.corners;
        for (int32_t k = 0; k < z.bearers + v->spanwise; ++k) {
            const bearer f = filament_of(v, b, k);
            lw_filament filament = {.strength = 1.0, .core = LW_SHEET * v->core};
            lw_store3(filament.a, lw_load3(placed + 3 * f.from));
            lw_store3(filament.b, lw_load3(placed + 3 * f.to));
            for (int axis = 0; axis < 3; ++axis) fill(targets->velocity[axis], (size_t)targets->count);
            lw_filaments_add(&filament, 1, &alone);
            for (int axis = 0; axis < 3; ++axis) {
                const double *by = targets->velocity[axis];
                if (f.with >= 0) gather(v->influence + (size_t)f.with * size + axis * z.targets, by, 1.0, z.targets);
                if (f.against >= 0)
                    gather(v->influence + (size_t)f.against * size + axis * z.targets, by, -1.0, z.targets);
            }
        }
    }
    for (int axis = 0; axis < 3; ++axis) fill(targets->velocity[axis], (size_t)targets->count);
}

/* Add to the velocity at the targets what wakes and wind do, and take away how fast the bodies are there. */
static void meet(lw_vortex *v, const lw_points *targets, double t, const double *pose, const double *twist) {
    const sizes z = sizes_of(v);
    const int32_t count = v->surfaces * (z.rings + z.bearers), wakes = lw_wake_filaments(v, v->filaments);
    lw_filaments_add(v->filaments, wakes, targets);
    for (int32_t k = 0; k < count; ++k) {
        const int32_t rings = v->surfaces * z.rings;
        const int32_t b = k < rings ? k / z.rings : (k - rings) / z.bearers;
        const lw_vec3 r = at(targets->at, k), zero = {0.0, 0.0, 0.0};
        const lw_vec3 arm = lw_sub(r, lw_load3(pose + 7 * b));
        const lw_vec3 body = lw_add(lw_load3(twist + 6 * b), lw_cross(lw_load3(twist + 6 * b + 3), arm));
        const lw_vec3 air = lw_sub(lw_wind_at(&v->wind, t, r, zero).velocity, body);
        targets->velocity[0][k] += air.x, targets->velocity[1][k] += air.y, targets->velocity[2][k] += air.z;
    }
}

/* What one component of the twist of a body adds to the velocity of a point of it. */
static lw_vec3 unit_velocity(int32_t component, lw_vec3 arm) {
    const int axis = component % 3;
    const lw_vec3 e = lw_vec(axis == 0, axis == 1, axis == 2);
    return component < 3 ? e : lw_cross(e, arm);
}

/* Strengths that let nothing through, and their derivative by the twists. */
static int solve(lw_vortex *v, const lw_points *targets, const double *pose) {
    const sizes z = sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, size = 3 * z.targets;
    for (int32_t i = 0; i < rings; ++i) {
        const lw_vec3 normal = lw_load3(v->normal + 3 * i);
        for (int32_t j = 0; j < rings; ++j) {
            const double *by = v->influence + (size_t)j * size;
            v->matrix[(size_t)i * rings + j] = lw_dot(normal, lw_vec(by[i], by[z.targets + i], by[2 * z.targets + i]));
        }
        v->trial_strength[i] = -lw_dot(normal, at(targets->velocity, i));
        const lw_vec3 arm = lw_sub(at(targets->at, i), lw_load3(pose + 7 * (i / z.rings)));
        for (int32_t column = 0; column < z.columns; ++column)
            v->by_twist[(size_t)column * rings + i] =
                column / 6 == i / z.rings ? lw_dot(normal, unit_velocity(column % 6, arm)) : 0.0;
    }
    if (lw_factor_dense(rings, v->matrix, v->pivots, v->instructions)) return 1;
    lw_substitute(rings, v->matrix, v->pivots, v->trial_strength);
    for (int32_t column = 0; column < z.columns; ++column)
        lw_substitute(rings, v->matrix, v->pivots, v->by_twist + (size_t)column * rings);
    return 0;
}

/* Add to the velocity at the middles of what bears force what all rings of these strengths do there. */
static void induce(const lw_vortex *v, const double *strength, double *const velocity[3]) {
    const sizes z = sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, end = rings + v->surfaces * z.bearers;
    for (int32_t ring = 0; ring < rings; ++ring)
        for (int axis = 0; axis < 3; ++axis) {
            const double *by = v->influence + ((size_t)ring * 3 + axis) * z.targets;
            for (int32_t i = rings; i < end; ++i) velocity[axis][i] += strength[ring] * by[i];
        }
}

/* ---- the wrench ---- */

static void add_wrench(double *wrench, lw_vec3 force, lw_vec3 arm) {
    lw_store3(wrench, lw_add(lw_load3(wrench), force));
    lw_store3(wrench + 3, lw_add(lw_load3(wrench + 3), lw_cross(arm, force)));
}

/* Add the force of velocity and strength on every filament, rho gamma u x l, to wrench (n, 6). What those across
 * the chord bear along it is the suction of the leading edge: elsewhere it is next to nothing. */
static void steady_wrench(const lw_vortex *v, const double *pose, const double *strength,
                          double *const middle[3], double *const velocity[3], double *wrench) {
    const sizes z = sizes_of(v);
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const double *placed = v->placed + 3 * b * z.corners;
        const lw_mat3 turn = lw_quat_matrix(lw_load4(pose + 7 * b + 3));
        const lw_vec3 chord = lw_vec(turn.xx, turn.yx, turn.zx);
        for (int32_t k = 0; k < z.bearers; ++k) {
            const bearer f = bearer_of(v, b, k);
            const int32_t target = v->surfaces * z.rings + b * z.bearers + k;
            const lw_vec3 along = lw_sub(lw_load3(placed + 3 * f.to), lw_load3(placed + 3 * f.from));
            const lw_vec3 arm = lw_sub(at(middle, target), lw_load3(pose + 7 * b));
            lw_vec3 force = lw_cross(at(velocity, target), along);
            if (k < z.spanwise)
                force = lw_sub(force, lw_scale((1.0 - v->suction) * lw_dot(force, chord), chord));
            add_wrench(wrench + 6 * b, lw_scale(v->density * net(strength, &f), force), arm);
        }
    }
}

static lw_vec3 middle_of(const double *a, const double *b) {
    return lw_scale(0.5, lw_add(lw_load3(a), lw_load3(b)));
}

/* Area vector of the ring of the wake behind ring j of the trailing edge, as far as it is along that of the ring
 * before: the fluid leaves the plate tangentially. */
static lw_vec3 shed_area(const lw_vortex *v, int32_t b, int32_t j, const double *edge, lw_vec3 before) {
    if (v->rows == 0) return lw_vec(0.0, 0.0, 0.0);
    const double *wake = v->wake + 3 * (b * (v->spanwise + 1) + j);
    const lw_vec3 down = lw_sub(lw_load3(wake + 3), lw_load3(edge));
    const lw_vec3 up = lw_sub(lw_load3(wake), lw_load3(edge + 3));
    return lw_scale(0.5 * lw_dot(lw_cross(down, up), before) / lw_dot(before, before), before);
}

/* Write what a change of the strengths in a step does to wrench (n, 6), with the bodies as at its end: on each ring
 * -rho S d gamma / dt; and at the trailing edge +rho / 2 S d gamma / dt with S of the wake's first ring, for what
 * leaves the edge has been on the plate for half of the step. So wrench is what the impulse of all rings loses. */
static void press(const lw_vortex *v, const double *pose, const double *change, double *wrench) {
    const sizes z = sizes_of(v);
    const int32_t s = v->spanwise, row = 3 * (s + 1);
    fill(wrench, (size_t)z.columns);
    for (int32_t ring = 0; ring < v->surfaces * z.rings; ++ring) {
        const int32_t b = ring / z.rings, k = ring % z.rings;
        const double *corner = v->placed + 3 * b * z.corners + k / s * row + 3 * (k % s);
        const lw_vec3 centre = lw_load3(pose + 7 * b), area = lw_load3(v->normal + 3 * ring);
        const double rate = v->density / v->step * change[ring];
        const lw_vec3 ahead = middle_of(corner, corner + 3);
        const lw_vec3 behind = middle_of(corner + row, corner + row + 3);
        const lw_vec3 middle = lw_scale(0.5, lw_add(ahead, behind));
        add_wrench(wrench + 6 * b, lw_scale(-rate, area), lw_sub(middle, centre));
        if (k < z.rings - s) continue;
        const lw_vec3 shed = shed_area(v, b, k % s, corner + row, area);
        const double *edge = v->edge + 3 * (b * (s + 1) + k % s);
        add_wrench(wrench + 6 * b, lw_scale(0.5 * rate, shed), lw_sub(middle_of(edge, edge + 3), centre));
    }
}

/* Add to wrench (6) what half a step of turning with this rate [rad/s] takes from another. */
static void turn_back(const lw_vortex *v, lw_vec3 rate, const double *other, double *wrench) {
    for (int part = 0; part < 6; part += 3) {
        const lw_vec3 gained = lw_scale(0.5 * v->step, lw_cross(rate, lw_load3(other + part)));
        lw_store3(wrench + part, lw_sub(lw_load3(wrench + part), gained));
    }
}

/* Derivatives of the wrenches by one component of the twist of a body: of the steady part, (n, 6), and all
 * of the mean over the step, less, in one column of the response. */
static void respond(lw_vortex *v, const lw_points *targets, const double *pose, const double *twist,
                    int32_t column, double *response) {
    const sizes z = sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, body = column / 6;
    const lw_vec3 zero = {0.0, 0.0, 0.0};
    const double *strength = v->by_twist + (size_t)column * rings;
    double *velocity[3], *steady = v->steady_by_twist + (size_t)column * z.columns;
    for (int axis = 0; axis < 3; ++axis) velocity[axis] = v->change + (size_t)axis * z.targets;
    fill(v->change, (size_t)3 * z.targets);
    for (int32_t k = 0; k < z.bearers; ++k) {
        const int32_t target = rings + body * z.bearers + k;
        const lw_vec3 arm = lw_sub(at(targets->at, target), lw_load3(pose + 7 * body));
        const lw_vec3 own = unit_velocity(column % 6, arm);
        velocity[0][target] -= own.x, velocity[1][target] -= own.y, velocity[2][target] -= own.z;
    }
    induce(v, strength, velocity);
    fill(steady, (size_t)z.columns);
    steady_wrench(v, pose, strength, targets->at, targets->velocity, steady);
    steady_wrench(v, pose, v->trial_strength, targets->at, velocity, steady);
    press(v, pose, strength, v->pressed);
    for (int32_t k = 0; k < z.columns; ++k) v->row[k] = 0.5 * steady[k] + v->pressed[k];
    for (int32_t b = 0; b < v->surfaces; ++b)
        turn_back(v, lw_load3(twist + 6 * b + 3), v->pressed + 6 * b, v->row + 6 * b);
    if (v->started && column % 6 >= 3) {
        press(v, pose, v->gained, v->pressed);
        turn_back(v, unit_velocity(column % 3, zero), v->pressed + 6 * body, v->row + 6 * body);
    }
    for (int32_t k = 0; k < z.columns; ++k) response[(size_t)k * z.columns + column] = -v->row[k];
}

int lw_vortex_evaluate(lw_vortex *v, double t, const double *pose, const double *twist, double *wrench,
                       double *response) {
    const sizes z = sizes_of(v);
    const int32_t rings = v->surfaces * z.rings;
    lw_vortex_place(v, pose);
    const lw_points targets = place_targets(v, pose);
    influence(v, &targets);
    meet(v, &targets, t, pose, twist);
    if (solve(v, &targets, pose)) return 1;
    induce(v, v->trial_strength, targets.velocity);
    fill(v->trial_steady, (size_t)z.columns);
    steady_wrench(v, pose, v->trial_strength, targets.at, targets.velocity, v->trial_steady);
    for (int32_t k = 0; k < z.columns; ++k)
        wrench[k] = v->started ? 0.5 * (v->steady[k] + v->trial_steady[k]) : v->trial_steady[k];
    if (v->started) {
        for (int32_t k = 0; k < rings; ++k) v->gained[k] = v->trial_strength[k] - v->strength[k];
        press(v, pose, v->gained, v->pressed);
        for (int32_t k = 0; k < z.columns; ++k) wrench[k] += v->pressed[k];
        for (int32_t b = 0; b < v->surfaces; ++b)
            turn_back(v, lw_load3(twist + 6 * b + 3), v->pressed + 6 * b, wrench + 6 * b);
    }
    for (int32_t column = 0; column < z.columns; ++column) respond(v, &targets, pose, twist, column, response);
    for (int32_t k = 0; k < z.columns; ++k) v->trial_twist[k] = twist[k];
    return 0;
}

/* The trial's strengths and steady wrenches for the twists that were accepted instead. */
static void accept(lw_vortex *v, const double *twist) {
    const sizes z = sizes_of(v);
    const int32_t rings = v->surfaces * z.rings;
    for (int32_t k = 0; k < rings; ++k) v->strength[k] = v->trial_strength[k];
    for (int32_t k = 0; k < z.columns; ++k) v->steady[k] = v->trial_steady[k];
    for (int32_t column = 0; column < z.columns; ++column) {
        const double more = twist[column] - v->trial_twist[column];
        const double *by = v->by_twist + (size_t)column * rings;
        const double *steady = v->steady_by_twist + (size_t)column * z.columns;
        for (int32_t k = 0; k < rings; ++k) v->strength[k] += more * by[k];
        for (int32_t k = 0; k < z.columns; ++k) v->steady[k] += more * steady[k];
    }
}

void lw_vortex_commit(lw_vortex *v, double t, const double *pose, const double *twist) {
    accept(v, twist);
    v->started = 1;
    lw_vortex_place(v, pose);
    lw_wake_go(v, t);
}

void lw_vortex_velocity(lw_vortex *v, double t, int32_t count, const double *point, double *velocity) {
    const int32_t bodies = lw_vortex_bound(v, v->trial_strength, v->filaments);
    const int32_t filaments = bodies + lw_wake_filaments(v, v->filaments + bodies), room = lw_vortex_points(v);
    for (int32_t first = 0; first < count; first += room) {
        const int32_t some = count - first < room ? count - first : room;
        const lw_points points = lw_vortex_room(v, some);
        for (int32_t k = 0; k < some; ++k) put(&points, k, lw_load3(point + 3 * (first + k)));
        lw_filaments_add(v->filaments, filaments, &points);
        for (int32_t k = 0; k < some; ++k) {
            const lw_vec3 r = at(points.at, k), zero = {0.0, 0.0, 0.0};
            const lw_vec3 wind = lw_wind_at(&v->wind, t, r, zero).velocity;
            lw_store3(velocity + 3 * (first + k), lw_add(wind, at(points.velocity, k)));
        }
    }
}
