/* Force elements between bodies: README, section Force elements. */
#include "lw_model.h"

#include <string.h>

static const lw_vec3 zero = {0.0, 0.0, 0.0};

void lw_elements_build(lw_multibody *mb, const lw_tables *t) {
    for (int32_t i = 0; i < mb->forces; ++i) {
        lw_element *e = &mb->element[i];
        memset(e, 0, sizeof *e);
        e->type = t->force_type[i];
        for (int side = 0; side < 2; ++side) {
            e->link[side] = lw_link_of(mb, t->force_body[2 * i + side]);
            e->point[side] = lw_load3(t->force_point + 6 * i + 3 * side);
        }
        memcpy(e->number, t->force_number + 3 * i, sizeof e->number);
    }
}

/* ---- points ---- */

typedef struct { lw_vec3 arm, position, velocity; } lw_place; /* arm: from the COM */

static lw_place place_of(const lw_multibody *mb, const lw_element *e, int side) {
    lw_place p = {zero, e->point[side], zero};
    if (e->link[side] < 0) return p;
    const lw_link *l = &mb->link[e->link[side]];
    p.arm = lw_mat_vec(l->rotation, e->point[side]);
    p.position = lw_add(l->position, p.arm);
    p.velocity = lw_add(l->velocity.linear, lw_cross(l->velocity.angular, p.arm));
    return p;
}

static void push(lw_multibody *mb, int32_t link, lw_vec3 arm, lw_vec3 force) {
    if (link < 0) return;
    lw_spatial *load = &mb->load[link];
    load->linear = lw_add(load->linear, force);
    load->angular = lw_add(load->angular, lw_cross(arm, force));
}

/* ---- a spring and damper between two points ---- */

typedef struct { lw_place end[2]; lw_vec3 along; double length, rate; } lw_span; /* along: from first to second */

static lw_span span_of(const lw_multibody *mb, const lw_element *e) {
    lw_span s = {{place_of(mb, e, 0), place_of(mb, e, 1)}, zero, 0.0, 0.0};
    lw_vec3 apart = lw_sub(s.end[1].position, s.end[0].position);
    s.length = lw_norm(apart);
    s.along = lw_scale(1.0 / s.length, apart);
    s.rate = lw_dot(s.along, lw_sub(s.end[1].velocity, s.end[0].velocity));
    return s;
}

static int load_spring(lw_multibody *mb, lw_element *e) {
    lw_span s = span_of(mb, e);
    if (!(s.length > 0.0)) return LW_POINTS_MEET;
    e->effort = e->number[0] * (s.length - e->number[2]) + e->number[1] * s.rate;
    e->dissipated = e->number[1] * s.rate * s.rate;
    lw_vec3 pull = lw_scale(e->effort, s.along);
    push(mb, e->link[0], s.end[0].arm, pull);
    push(mb, e->link[1], s.end[1].arm, lw_neg(pull));
    return LW_OK;
}

/* ---- all of them ---- */

int lw_elements_load(lw_multibody *mb, lw_fault *fault) {
    memset(mb->load, 0, (size_t)mb->n * sizeof *mb->load);
    for (int32_t i = 0; i < mb->forces; ++i) {
        int status = load_spring(mb, &mb->element[i]);
        fault->item = i;
        if (status) return status;
    }
    return LW_OK;
}

double lw_elements_dissipated(const lw_multibody *mb) {
    double power = 0.0;
    for (int32_t i = 0; i < mb->forces; ++i) power += mb->element[i].dissipated;
    return power;
}

double lw_elements_energy(const lw_multibody *mb) {
    double energy = 0.0;
    for (int32_t i = 0; i < mb->forces; ++i) {
        const lw_element *e = &mb->element[i];
        double stretch = span_of(mb, e).length - e->number[2];
        energy += 0.5 * e->number[0] * stretch * stretch;
    }
    return energy;
}
