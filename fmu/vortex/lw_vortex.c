/* The strengths of the rings and the wrench: what a trial state asks for, and how it changes with the twists. */
#include "lw_vortex.h"

#include "lw_dense.h"
#include "lw_linear.h"
#include "lw_surface.h"
#include "lw_wake.h"

void lw_vortex_init(lw_vortex *v) { v->instructions = (int32_t)lw_instructions_here(); }

int32_t lw_vortex_targets(const lw_vortex *v) { return lw_sizes_of(v).targets; }

int32_t lw_vortex_points(const lw_vortex *v) {
    const int32_t targets = lw_vortex_targets(v), wake = lw_lanes(v->capacity * v->surfaces * (v->spanwise + 1));
    return targets > wake ? targets : wake;
}

int32_t lw_vortex_filaments(const lw_vortex *v) {
    const int32_t each = 2 * v->spanwise + 1; /* in a row of rings: across, and along */
    return v->surfaces * (each * (v->chordwise + v->capacity) + 2 * v->spanwise);
}

/* ---- the flow through the rings ---- */

static void gather(double *to, const double *from, double sign, int32_t count) {
    for (int32_t k = 0; k < count; ++k) to[k] += sign * from[k];
}

/* Velocity at the targets by each ring of strength 1. Two rings share most filaments, which are done once. */
static void influence(lw_vortex *v, const lw_points *targets) {
    const lw_sizes z = lw_sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, size = 3 * z.targets;
    lw_fill(v->influence, (size_t)rings * size);
    lw_points alone = *targets; /* a filament is too little to share */
    alone.threads = NULL;
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const double *placed = v->placed + 3 * b * z.corners;
        for (int32_t k = 0; k < z.bearers + v->spanwise; ++k) {
            const lw_bearer f = lw_filament_of(v, b, k);
            lw_filament filament = {.strength = 1.0, .core = LW_SHEET * v->core};
            lw_store3(filament.a, lw_load3(placed + 3 * f.from));
            lw_store3(filament.b, lw_load3(placed + 3 * f.to));
            for (int axis = 0; axis < 3; ++axis) lw_fill(targets->velocity[axis], (size_t)targets->count);
            lw_filaments_add(&filament, 1, &alone);
            for (int axis = 0; axis < 3; ++axis) {
                const double *by = targets->velocity[axis];
                if (f.with >= 0) gather(v->influence + (size_t)f.with * size + axis * z.targets, by, 1.0, z.targets);
                if (f.against >= 0)
                    gather(v->influence + (size_t)f.against * size + axis * z.targets, by, -1.0, z.targets);
            }
        }
    }
    for (int axis = 0; axis < 3; ++axis) lw_fill(targets->velocity[axis], (size_t)targets->count);
}

/* Add to the velocity at the targets what wakes and wind do, and take away how fast the bodies are there. */
static void meet(lw_vortex *v, const lw_points *targets, double t, const double *pose, const double *twist) {
    const lw_sizes z = lw_sizes_of(v);
    const int32_t count = v->surfaces * (z.rings + z.bearers), wakes = lw_wake_filaments(v, v->filaments);
    lw_filaments_add(v->filaments, wakes, targets);
    for (int32_t k = 0; k < count; ++k) {
        const int32_t rings = v->surfaces * z.rings;
        const int32_t b = k < rings ? k / z.rings : (k - rings) / z.bearers;
        const lw_vec3 r = lw_at(targets->at, k), zero = {0.0, 0.0, 0.0};
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
    const lw_sizes z = lw_sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, size = 3 * z.targets;
    for (int32_t i = 0; i < rings; ++i) {
        const lw_vec3 normal = lw_load3(v->normal + 3 * i);
        for (int32_t j = 0; j < rings; ++j) {
            const double *by = v->influence + (size_t)j * size;
            v->matrix[(size_t)i * rings + j] = lw_dot(normal, lw_vec(by[i], by[z.targets + i], by[2 * z.targets + i]));
        }
        v->trial_strength[i] = -lw_dot(normal, lw_at(targets->velocity, i));
        const lw_vec3 arm = lw_sub(lw_at(targets->at, i), lw_load3(pose + 7 * (i / z.rings)));
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
    const lw_sizes z = lw_sizes_of(v);
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

/* Which way a filament is pulled in the plane of its surface: across itself, along the chord without sweep. */
static lw_vec3 pull_of(const lw_vortex *v, int32_t first, const lw_bearer *f, lw_mat3 turn) {
    const lw_vec3 from = lw_load3(v->corner + 3 * (first + f->from)), to = lw_load3(v->corner + 3 * (first + f->to));
    const lw_vec3 along = lw_sub(to, from);
    const double length = sqrt(along.x * along.x + along.z * along.z);
    return lw_mat_vec(turn, lw_vec(along.z / length, 0.0, -along.x / length));
}

/* Add the force of velocity and strength on every filament, rho gamma u x l, to wrench (n, 6). What those across
 * the chord bear in the plane of the surface is the suction of the leading edge: elsewhere it is next to nothing. */
static void steady_wrench(const lw_vortex *v, const double *pose, const double *strength,
                          double *const middle[3], double *const velocity[3], double *wrench) {
    const lw_sizes z = lw_sizes_of(v);
    for (int32_t b = 0; b < v->surfaces; ++b) {
        const double *placed = v->placed + 3 * b * z.corners;
        const lw_mat3 turn = lw_quat_matrix(lw_load4(pose + 7 * b + 3));
        for (int32_t k = 0; k < z.bearers; ++k) {
            const lw_bearer f = lw_filament_of(v, b, k);
            const int32_t target = v->surfaces * z.rings + b * z.bearers + k;
            const lw_vec3 along = lw_sub(lw_load3(placed + 3 * f.to), lw_load3(placed + 3 * f.from));
            const lw_vec3 arm = lw_sub(lw_at(middle, target), lw_load3(pose + 7 * b));
            lw_vec3 force = lw_cross(lw_at(velocity, target), along);
            if (k < z.spanwise) {
                const lw_vec3 pull = pull_of(v, b * z.corners, &f, turn);
                force = lw_sub(force, lw_scale((1.0 - v->suction) * lw_dot(force, pull), pull));
            }
            add_wrench(wrench + 6 * b, lw_scale(v->density * lw_net(strength, &f), force), arm);
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
    const lw_sizes z = lw_sizes_of(v);
    const int32_t s = v->spanwise, row = 3 * (s + 1);
    lw_fill(wrench, (size_t)z.columns);
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
    const lw_sizes z = lw_sizes_of(v);
    const int32_t rings = v->surfaces * z.rings, body = column / 6;
    const lw_vec3 zero = {0.0, 0.0, 0.0};
    const double *strength = v->by_twist + (size_t)column * rings;
    double *velocity[3], *steady = v->steady_by_twist + (size_t)column * z.columns;
    for (int axis = 0; axis < 3; ++axis) velocity[axis] = v->change + (size_t)axis * z.targets;
    lw_fill(v->change, (size_t)3 * z.targets);
    for (int32_t k = 0; k < z.bearers; ++k) {
        const int32_t target = rings + body * z.bearers + k;
        const lw_vec3 arm = lw_sub(lw_at(targets->at, target), lw_load3(pose + 7 * body));
        const lw_vec3 own = unit_velocity(column % 6, arm);
        velocity[0][target] -= own.x, velocity[1][target] -= own.y, velocity[2][target] -= own.z;
    }
    induce(v, strength, velocity);
    lw_fill(steady, (size_t)z.columns);
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
    const lw_sizes z = lw_sizes_of(v);
    const int32_t rings = v->surfaces * z.rings;
    lw_vortex_place(v, pose);
    const lw_points targets = lw_place_targets(v, pose);
    influence(v, &targets);
    meet(v, &targets, t, pose, twist);
    if (solve(v, &targets, pose)) return 1;
    induce(v, v->trial_strength, targets.velocity);
    lw_fill(v->trial_steady, (size_t)z.columns);
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
    const lw_sizes z = lw_sizes_of(v);
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

int lw_vortex_commit(lw_vortex *v, double t, const double *pose, const double *twist) {
    accept(v, twist);
    v->started = 1;
    lw_vortex_place(v, pose);
    return lw_wake_go(v, t);
}

void lw_vortex_velocity(lw_vortex *v, double t, int32_t count, const double *point, double *velocity) {
    const int32_t bodies = lw_vortex_bound(v, v->trial_strength, v->filaments);
    const int32_t filaments = bodies + lw_wake_filaments(v, v->filaments + bodies), room = lw_vortex_points(v);
    for (int32_t first = 0; first < count; first += room) {
        const int32_t some = count - first < room ? count - first : room;
        const lw_points points = lw_vortex_room(v, some);
        for (int32_t k = 0; k < some; ++k) lw_put(&points, k, lw_load3(point + 3 * (first + k)));
        lw_filaments_add(v->filaments, filaments, &points);
        for (int32_t k = 0; k < some; ++k) {
            const lw_vec3 r = lw_at(points.at, k), zero = {0.0, 0.0, 0.0};
            const lw_vec3 wind = lw_wind_at(&v->wind, t, r, zero).velocity;
            lw_store3(velocity + 3 * (first + k), lw_add(wind, lw_at(points.velocity, k)));
        }
    }
}
