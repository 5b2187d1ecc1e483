/* Force elements: README, section Force elements. */
#include "lw_model.h"

#include <string.h>

static const lw_vec3 zero = {0.0, 0.0, 0.0};
static const double two_pi = 6.283185307179586476925286766559;

static int turns_or_slides(const lw_element *e) { return e->type == LW_ACTUATOR || e->type == LW_MOTION; }

void lw_elements_build(lw_multibody *mb, const lw_tables *t) {
    if (mb->forces) memcpy(mb->code, t->force_code, 2 * (size_t)t->instructions * sizeof(int32_t));
    if (mb->forces) memcpy(mb->constants, t->force_constants, (size_t)t->constants * sizeof(double));
    if (mb->inputs) memcpy(mb->input, t->force_input, (size_t)t->inputs * sizeof(int32_t));
    for (int32_t i = 0; i < mb->forces; ++i) {
        lw_element *e = &mb->element[i];
        memset(e, 0, sizeof *e);
        e->type = t->force_type[i];
        e->link[0] = lw_link_of(mb, t->force_body[2 * i]);
        e->link[1] = turns_or_slides(e) ? -1 : lw_link_of(mb, t->force_body[2 * i + 1]);
        e->coordinate = turns_or_slides(e) ? t->force_body[2 * i + 1] : 0;
        for (int side = 0; side < 2; ++side) e->point[side] = lw_load3(t->force_point + 6 * i + 3 * side);
        memcpy(e->number, t->force_number + 3 * i, sizeof e->number);
        e->code = mb->code + 2 * t->force_start[i];
        e->end = mb->code + 2 * t->force_start[i + 1];
        if (e->type == LW_ACTUATOR) mb->link[e->link[0]].driven = 1;
        if (e->type == LW_MOTION) mb->link[e->link[0]].prescribed |= 1 << e->coordinate;
    }
}

void lw_multibody_set_inputs(lw_multibody *mb, const double *values) {
    for (int32_t i = 0; i < mb->inputs; ++i) mb->constants[mb->input[i]] = values[i];
}

static int32_t run(const lw_multibody *mb, const lw_element *e, const double *variables, double *results,
                   int count) {
    int32_t finite = 1;
    lw_expression_run(e->code, e->end, mb->constants, variables, results);
    for (int k = 0; k < count; ++k) finite &= isfinite(results[k]) != 0;
    return finite ? LW_OK : LW_FORCE_NOT_FINITE;
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
    double variables[3] = {s.length, s.rate, mb->time}, law = 0.0;
    if (!(s.length > 0.0)) return LW_POINTS_MEET;
    int status = run(mb, e, variables, &law, 1);
    e->effort = e->number[0] * (s.length - e->number[2]) + e->number[1] * s.rate + law;
    e->dissipated = e->number[1] * s.rate * s.rate;
    e->supplied = -law * s.rate;
    e->power = -e->effort * s.rate;
    lw_vec3 pull = lw_scale(e->effort, s.along);
    push(mb, e->link[0], s.end[0].arm, pull);
    push(mb, e->link[1], s.end[1].arm, lw_neg(pull));
    return status;
}

/* ---- a force and a torque on a body ---- */

/* Heading of the body's x axis about world z, on the branch that the turns of its joints add up to. */
static double heading(const lw_multibody *tree, int32_t link, lw_mat3 rotation, const double *q) {
    double angle = atan2(rotation.yx, rotation.xx), turns = 0.0;
    for (int32_t k = link; k >= 0; k = tree->link[k].parent) {
        const lw_link *l = &tree->link[k];
        if (l->type == LW_REVOLUTE) turns += l->axis.z * q[l->q];
        if (l->type == LW_PLANAR) turns += l->axis.z * q[l->q + 2];
    }
    return angle + two_pi * floor((turns - angle) / two_pi + 0.5);
}

static int load_point(lw_multibody *mb, lw_element *e, const lw_multibody *tree, const double *q) {
    const lw_link *l = &mb->link[e->link[0]];
    lw_place p = place_of(mb, e, 0);
    double variables[11] = {mb->time}, results[6] = {0.0};
    lw_store3(variables + 1, l->position);
    lw_store3(variables + 4, l->velocity.linear);
    lw_store3(variables + 7, l->velocity.angular);
    variables[10] = heading(tree, e->link[0], l->rotation, q);
    int status = run(mb, e, variables, results, 6);
    lw_vec3 force = lw_load3(results), torque = lw_load3(results + 3);
    if (e->number[0] != 0.0) force = lw_mat_vec(l->rotation, force), torque = lw_mat_vec(l->rotation, torque);
    e->effort = lw_norm(force);
    e->power = e->supplied = lw_dot(force, p.velocity) + lw_dot(torque, l->velocity.angular);
    push(mb, e->link[0], p.arm, force);
    mb->load[e->link[0]].angular = lw_add(mb->load[e->link[0]].angular, torque);
    return status;
}

/* ---- buoyancy ---- */

static lw_vec3 lift(const lw_multibody *mb, const lw_element *e) {
    return lw_scale(-e->number[0] * e->number[1], mb->gravity);
}

static int load_buoyancy(lw_multibody *mb, lw_element *e) {
    lw_place p = place_of(mb, e, 0);
    lw_vec3 force = lift(mb, e);
    e->effort = lw_norm(force);
    e->power = lw_dot(force, p.velocity);
    push(mb, e->link[0], p.arm, force);
    return LW_OK;
}

int lw_elements_load(lw_multibody *mb, const lw_multibody *tree, const double *q, lw_fault *fault) {
    memset(mb->load, 0, (size_t)mb->n * sizeof *mb->load);
    for (int32_t i = 0; i < mb->forces; ++i) {
        lw_element *e = &mb->element[i];
        int status = LW_OK;
        if (e->type == LW_SPRING) status = load_spring(mb, e);
        if (e->type == LW_POINT_FORCE) status = load_point(mb, e, tree, q);
        if (e->type == LW_BUOYANCY) status = load_buoyancy(mb, e);
        fault->item = i;
        if (status) return status;
    }
    return LW_OK;
}

/* ---- along joints ---- */

void lw_elements_drive(const lw_multibody *mb, const lw_link *l, const double *q, const double *v, double *force) {
    for (int32_t i = 0; i < mb->forces; ++i) {
        lw_element *e = &mb->element[i];
        int k = e->coordinate;
        if (e->type != LW_ACTUATOR || l != &mb->link[e->link[0]]) continue;
        double variables[3] = {mb->time, q[l->q + k], v[l->v + k]};
        e->effort = e->supplied = e->power = 0.0;
        if (k >= l->columns || l->type != l->built) continue; /* locked, or released */
        e->effort = NAN;
        lw_expression_run(e->code, e->end, mb->constants, variables, &e->effort);
        e->power = e->supplied = e->effort * v[l->v + k];
        force[k] += e->effort;
    }
}

int lw_elements_check(const lw_multibody *mb, lw_fault *fault) {
    for (int32_t i = 0; i < mb->forces; ++i)
        if (mb->element[i].type == LW_ACTUATOR && !isfinite(mb->element[i].effort)) {
            fault->item = i;
            return LW_FORCE_NOT_FINITE;
        }
    return LW_OK;
}

int lw_take_time(lw_multibody *mb, double time, lw_fault *fault) {
    const lw_jet now = {time, 1.0, 0.0};
    mb->time = time;
    for (int32_t i = 0; i < mb->forces; ++i) {
        lw_element *e = &mb->element[i];
        if (e->type != LW_MOTION) continue;
        lw_jet *m = &e->motion;
        lw_expression_jet(e->code, e->end, mb->constants, &now, m);
        fault->item = i;
        if (!isfinite(m->value) || !isfinite(m->rate) || !isfinite(m->change)) return LW_FORCE_NOT_FINITE;
    }
    return LW_OK;
}

void lw_prescribe(const lw_multibody *mb, double *q, double *v) {
    for (int32_t i = 0; i < mb->forces; ++i) {
        const lw_element *e = &mb->element[i];
        if (e->type != LW_MOTION) continue;
        const lw_link *l = &mb->link[e->link[0]];
        q[l->q + e->coordinate] = e->motion.value;
        v[l->v + e->coordinate] = e->motion.rate;
    }
}

void lw_prescribe_accelerations(lw_multibody *mb, int at_rest) {
    for (int32_t i = 0; i < mb->forces; ++i) {
        const lw_element *e = &mb->element[i];
        if (e->type == LW_MOTION)
            mb->link[e->link[0]].column[e->coordinate].given = at_rest ? 0.0 : e->motion.change;
    }
}

int lw_multibody_prescribe(lw_multibody *mb, double *state, double time, lw_fault *fault) {
    int status = lw_take_time(mb, time, fault);
    fault->time = 0.0;
    if (!status) lw_prescribe(mb, state, state + mb->nq);
    return status;
}

/* ---- energy ---- */

void lw_elements_power(lw_multibody *mb, double *supplied, double *dissipated) {
    for (int32_t i = 0; i < mb->forces; ++i) {
        lw_element *e = &mb->element[i];
        if (e->type == LW_MOTION && !mb->formulation) {
            e->effort = mb->link[e->link[0]].column[e->coordinate].effort;
            e->power = e->supplied = e->effort * e->motion.rate;
        }
        *supplied += e->supplied;
        *dissipated += e->dissipated;
    }
}

double lw_elements_energy(const lw_multibody *mb) {
    double energy = 0.0;
    for (int32_t i = 0; i < mb->forces; ++i) {
        const lw_element *e = &mb->element[i];
        if (e->type == LW_SPRING) {
            double stretch = span_of(mb, e).length - e->number[2];
            energy += 0.5 * e->number[0] * stretch * stretch;
        }
        if (e->type == LW_BUOYANCY) energy -= lw_dot(lift(mb, e), place_of(mb, e, 0).position);
    }
    return energy;
}
