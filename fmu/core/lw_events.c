/* What happens to joints: README, section Events. */
#include "lw_model.h"

#include <string.h>

static const double never = -1.0;   /* an indicator of what is not waited for; a time that has not come */
static const double resting = 1e-4; /* s: a bounce shorter than this is none, where no step says how long */
static const double ordered = -1.5; /* a time below it: as soon as possible */

void lw_events_build(lw_multibody *mb, const lw_tables *t) {
    for (int32_t i = 0; i < mb->events; ++i) {
        lw_event event = {t->event_joint[i], t->event_action[i], t->event_occasion[i], t->event_side[i],
                          t->event_threshold[i], t->event_restitution[i]};
        mb->event[i] = event;
        mb->happened[i] = never;
    }
    for (int32_t c = 0; c < mb->closures; ++c) mb->closure[c].released = 0;
}

/* ---- modes ---- */

static int is_released(const lw_multibody *mb, int32_t joint) {
    for (int32_t e = 0; e < mb->events; ++e)
        if (mb->event[e].joint == joint && mb->event[e].action == LW_RELEASE && mb->happened[e] >= 0.0) return 1;
    return 0;
}

/* The last event decides; or a stop on which the joint rests. */
static int is_locked(const lw_multibody *mb, int32_t joint) {
    double latest = never;
    int locked = 0;
    for (int32_t e = 0; e < mb->events; ++e) {
        if (mb->event[e].joint != joint || !(mb->happened[e] >= 0.0)) continue;
        if (mb->event[e].action == LW_STOP) return 1;
        if (mb->happened[e] >= latest) latest = mb->happened[e], locked = mb->event[e].action == LW_LOCK;
    }
    return locked;
}

static void set_mode(lw_link *l, int released, int locked) {
    int type = released ? LW_FREE : l->built;
    if (type != l->type) memset(l->column, 0, sizeof l->column); /* each type sets the parts that it uses */
    l->type = type;
    l->translations = lw_joint_translations(l->type);
    l->freedoms = lw_joint_nv(l->type);
    l->columns = locked ? 0 : l->freedoms;
    l->sprung = !released && l->built_sprung;
    l->damped = !released && l->built_damped;
}

void lw_modes(lw_multibody *mb, const double *happened) {
    size_t bytes = (size_t)mb->events * sizeof(double);
    if (!mb->events) return;
    memmove(mb->happened, happened, bytes);
    for (int i = 0; i < mb->n; ++i) {
        int32_t body = mb->link[i].body;
        set_mode(&mb->link[i], is_released(mb, body), is_locked(mb, body));
    }
    for (int32_t c = 0; c < mb->closures; ++c) mb->closure[c].released = is_released(mb, mb->n + c);
    /* What a joint had as a free one must not stay in the rates of coordinates that nothing uses. */
    for (int s = 0; s < LW_MAX_STAGES; ++s)
        memset(mb->rate[s], 0, (size_t)(mb->nq + mb->nv + 2) * sizeof(double));
}

static lw_link *link_of(const lw_multibody *mb, int32_t body) {
    int i = 0;
    while (mb->link[i].body != body) ++i;
    return &mb->link[i];
}

/* ---- indicators ---- */

static double joint_distance(const lw_multibody *mb, int32_t joint) {
    if (joint >= mb->n) {
        const lw_closure *c = &mb->closure[joint - mb->n];
        lw_vec3 end[2];
        for (int side = 0; side < 2; ++side) {
            const lw_link *l = c->link[side] < 0 ? NULL : &mb->link[c->link[side]];
            end[side] = l ? lw_add(l->position, lw_mat_vec(l->rotation, c->point[side])) : c->point[side];
        }
        return lw_norm(lw_sub(end[1], end[0]));
    }
    const lw_link *l = link_of(mb, joint), *parent = l->parent < 0 ? NULL : &mb->link[l->parent];
    lw_vec3 hold = l->parent_point;
    if (parent) hold = lw_add(parent->position, lw_mat_vec(parent->rotation, hold));
    return lw_norm(lw_sub(lw_sub(l->position, l->arm), hold));
}

static double reaction_size(const lw_multibody *mb, const lw_event *e) {
    lw_spatial f;
    if (e->joint >= mb->n) {
        const double *load = mb->closure_load + 6 * (e->joint - mb->n);
        f.linear = lw_load3(load), f.angular = lw_load3(load + 3);
    } else {
        f = lw_joint_reaction(link_of(mb, e->joint));
    }
    return lw_norm(e->occasion == LW_ON_FORCE ? f.linear : f.angular);
}

/* A joint goes for its stop, or, where it rests on it, would leave it if it could. */
static int stop_indicator(lw_multibody *mb, const lw_event *e, int rests, const double *y, const double *wrench,
                          double *value, lw_fault *fault) {
    lw_link *l = link_of(mb, e->joint);
    double *acceleration = mb->rate[2] + mb->nq;
    *value = never;
    if (l->type != l->built) return LW_OK;
    if (!rests) {
        if (e->side * y[mb->nq + l->v] > 0.0) *value = e->side * (y[l->q] - e->threshold);
        return LW_OK;
    }
    l->columns = l->freedoms;
    int status = lw_accelerations(mb, y, y + mb->nq, wrench, acceleration, fault);
    l->columns = 0;
    if (!status && e->side * acceleration[l->v] < 0.0) *value = -e->side * acceleration[l->v];
    return status;
}

static int is_pending(const lw_multibody *mb, int32_t i) {
    const lw_event *e = &mb->event[i];
    if (e->action == LW_STOP) return 1;
    return e->occasion == LW_ON_COMMAND ? mb->happened[i] < ordered : !(mb->happened[i] >= 0.0);
}

static int needs_forces(const lw_multibody *mb) {
    for (int32_t i = 0; i < mb->events; ++i) {
        int32_t occasion = mb->event[i].occasion;
        if (is_pending(mb, i) && (occasion == LW_ON_FORCE || occasion == LW_ON_TORQUE)) return 1;
    }
    return 0;
}

static double plain_indicator(lw_multibody *mb, const lw_event *e, const double *y, double time) {
    double value = time;
    if (e->occasion == LW_ON_COMMAND) return 0.0;
    if (mb->formulation)
        return e->side * (mb->formulation->occasion(mb, (int32_t)(e - mb->event), y, time) - e->threshold);
    const lw_link *l = e->joint < mb->n ? link_of(mb, e->joint) : NULL;
    if (e->occasion == LW_ON_POSITION || e->occasion == LW_ON_SPEED) {
        if (l->type != l->built) return never;
        value = e->occasion == LW_ON_POSITION ? y[l->q] : y[mb->nq + l->v];
    }
    if (e->occasion == LW_ON_DISTANCE) value = joint_distance(mb, e->joint);
    if (e->occasion == LW_ON_FORCE || e->occasion == LW_ON_TORQUE) value = reaction_size(mb, e);
    return e->side * (value - e->threshold);
}

static int indicators(lw_multibody *mb, const double *y, double time, const double *wrench, double *values,
                      lw_fault *fault) {
    int status = LW_OK;
    if (needs_forces(mb))
        status = lw_loaded_accelerations(mb, y, y + mb->nq, wrench, mb->rate[2] + mb->nq, mb->closure_load, fault);
    else
        lw_kinematics(mb, y, y + mb->nq);
    for (int32_t i = 0; i < mb->events; ++i)
        if (mb->event[i].action != LW_STOP)
            values[i] = is_pending(mb, i) ? plain_indicator(mb, &mb->event[i], y, time) : never;
    for (int32_t i = 0; i < mb->events && !status; ++i)
        if (mb->event[i].action == LW_STOP)
            status = stop_indicator(mb, &mb->event[i], mb->happened[i] >= 0.0, y, wrench, &values[i], fault);
    return status;
}

/* Written so that something that is not a number does not happen. */
static int is_due(double value) { return value >= 0.0; }

int lw_events_due(lw_multibody *mb, const double *y, double time, const double *wrench, int *due,
                  lw_fault *fault) {
    double *values = mb->indicator;
    int pending = 0, status = lw_take_time(mb, time, fault);
    *due = 0;
    for (int32_t i = 0; i < mb->events; ++i) pending |= is_pending(mb, i);
    if (pending && !status) status = indicators(mb, y, time, wrench, values, fault);
    for (int32_t i = 0; i < mb->events && pending && !status; ++i)
        if (is_due(values[i])) *due = 1, fault->item = i;
    return status;
}

/* ---- what happens ---- */

typedef struct { double kinetic, added, springs; } lw_energies;

static lw_energies energies(lw_multibody *mb, const double *y) {
    lw_energies sum = {0.0, 0.0, lw_spring_energy(mb, y)};
    lw_kinematics(mb, y, y + mb->nq);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        lw_vec3 v = lw_mat_tvec(l->rotation, l->velocity.linear), w = lw_mat_tvec(l->rotation, l->velocity.angular);
        double six[6];
        sum.kinetic += 0.5 * (l->mass * lw_dot(v, v) + lw_dot(w, lw_sym_vec(l->inertia, w)));
        lw_store3(six, v), lw_store3(six + 3, w);
        for (int k = 0; l->added && k < 36; ++k) sum.added += 0.5 * six[k / 6] * l->added[k] * six[k % 6];
    }
    return sum;
}

/* The coordinates of a joint as those of a free one that is where it is and moves as it does. */
static void loosen(const lw_multibody *mb, const lw_link *l, double *y) {
    double *q = y + l->q, *v = y + mb->nq + l->v, own[4] = {0.0}, rate[3] = {0.0};
    lw_vec3 at = {0.0, 0.0, 0.0}, speed = at, turning = at;
    lw_quat turned = {1.0, 0.0, 0.0, 0.0};
    memcpy(own, q, (size_t)lw_joint_nq(l->type) * sizeof(double));
    memcpy(rate, v, (size_t)l->freedoms * sizeof(double));
    int last = l->type == LW_PLANAR ? 2 : 0;
    if (l->type == LW_REVOLUTE || l->type == LW_PLANAR) {
        turned = lw_quat_of(cos(0.5 * own[last]), 0.0, 0.0, sin(0.5 * own[last]));
        turning.z = rate[last];
    }
    if (l->type == LW_PLANAR) at.x = own[0], at.y = own[1], speed.x = rate[0], speed.y = rate[1];
    if (l->type == LW_PRISMATIC) at.z = own[0], speed.z = rate[0];
    if (l->type == LW_SPHERICAL) turned = lw_load4(own), turning = lw_load3(rate);
    lw_store3(q, at);
    lw_store4(q + 3, turned);
    lw_store3(v, speed);
    lw_store3(v + 3, turning);
}

/* A bounce; or rest, if the next one would come within a step of h [s]. */
static int bounce(lw_multibody *mb, int32_t i, double *y, double time, double h, const double *wrench,
                  lw_fault *fault) {
    const lw_event *e = &mb->event[i];
    lw_link *l = link_of(mb, e->joint);
    double *v = y + mb->nq, *stopped = mb->rate[4], *acceleration = mb->rate[5];
    size_t bytes = (size_t)mb->nv * sizeof(double);
    memcpy(stopped, v, bytes);
    int status = lw_stop_joint(mb, y, stopped, l, fault);
    l->columns = l->freedoms;
    if (status) return status;
    for (int k = 0; k < mb->nv; ++k) v[k] += (1.0 + e->restitution) * (stopped[k] - v[k]);
    memset(acceleration, 0, bytes);
    if ((status = lw_accelerations(mb, y, v, wrench, acceleration, fault))) return status;
    double pressing = e->side * acceleration[l->v];
    if (pressing > 0.0 && 2.0 * fabs(v[l->v]) < h * pressing) {
        status = lw_stop_joint(mb, y, v, l, fault);
        mb->happened[i] = time;
    }
    return status;
}

static int happen(lw_multibody *mb, int32_t i, double *y, double time, double h, const double *wrench,
                  lw_fault *fault) {
    const lw_event *e = &mb->event[i];
    lw_link *l = e->joint < mb->n ? link_of(mb, e->joint) : NULL;
    int status = LW_OK, rests = e->action == LW_STOP && mb->happened[i] >= 0.0;
    lw_energies before = energies(mb, y);
    if (rests) {
        mb->happened[i] = never;
    } else if (e->action == LW_STOP) {
        status = bounce(mb, i, y, time, h, wrench, fault);
    } else {
        if (e->action == LW_LOCK) status = lw_stop_joint(mb, y, y + mb->nq, l, fault);
        if (e->action == LW_RELEASE && l && l->type != LW_FREE) loosen(mb, l, y);
        mb->happened[i] = time;
    }
    lw_modes(mb, mb->happened);
    lw_energies after = energies(mb, y);
    double *work = y + mb->nq + mb->nv, to_fluid = after.added - before.added;
    work[0] -= to_fluid;
    work[1] += before.kinetic - after.kinetic - to_fluid + before.springs - after.springs;
    return status;
}

int lw_events_happen(lw_multibody *mb, double *y, double time, double h, double slack, const double *wrench,
                     lw_fault *fault) {
    int status = lw_take_time(mb, time, fault);
    if (status) return status;
    for (int32_t i = 0; i < mb->events; ++i) {
        double *values = mb->indicator;
        status = indicators(mb, y, time, wrench, values, fault);
        int due = is_due(values[i] + slack);
        if (!status && due) status = happen(mb, i, y, time, h, wrench, fault);
        if (status) return status;
    }
    return LW_OK;
}

/* ---- for callers ---- */

int lw_multibody_happen(lw_multibody *mb, double *state, double time, double slack, const double *wrench,
                        const double *added_inertia, lw_fault *fault) {
    int coordinates = mb->nq + mb->nv, status = lw_inputs_check(mb, state, 1, wrench, added_inertia, fault);
    double *happened = state + coordinates + 1, *y = mb->y;
    if (status) return status;
    lw_modes(mb, happened);
    lw_bind_added(mb, added_inertia);
    memcpy(y, state, (size_t)coordinates * sizeof(double));
    y[coordinates] = y[coordinates + 1] = 0.0;
    if ((status = lw_events_happen(mb, y, time, resting, slack, wrench, fault))) return status;
    memcpy(state, y, (size_t)coordinates * sizeof(double));
    memcpy(happened, mb->happened, (size_t)mb->events * sizeof(double));
    return LW_OK;
}

int lw_multibody_indicators(lw_multibody *mb, const double *state, double time, const double *wrench,
                            const double *added_inertia, double *values, lw_fault *fault) {
    int status = lw_inputs_check(mb, state, 1, wrench, added_inertia, fault);
    if (status) return status;
    lw_modes(mb, state + mb->nq + mb->nv + 1);
    lw_bind_added(mb, added_inertia);
    if ((status = lw_take_time(mb, time, fault))) return status;
    return indicators(mb, state, time, wrench, values, fault);
}
