#include "lw_march.h"

#include <string.h>

#include "lw_field.h"
#include "lw_plate.h"

/* Behind the start of a step, in steps: of its end, of its start, of the starts before it. */
static const double NODES[] = {1.0, 0.0, -1.0, -2.0, -3.0};
static const double MEMORY = 0.5; /* as linkwind.coupling.degree */

/* What the call needs besides, cut out of its room. */
typedef struct {
    double *trial;                                   /* state */
    double *answer, *added;                          /* (n,6), (n,6,6): sum of the providers' */
    double *state, *wrenches, *differences, *errors; /* as they were before the step */
} lw_room;

static size_t six(const lw_march *m) { return 6 * (size_t)m->n; }
static size_t rows(const lw_march *m) { return (size_t)m->order + 2; }

size_t lw_march_room(const lw_march *m) {
    return 2 * (size_t)m->state_size + six(m) * (7 + (size_t)m->depth + rows(m)) + (size_t)m->order + 1;
}

static lw_room cut(const lw_march *m) {
    lw_room r;
    r.trial = m->room;
    r.answer = r.trial + m->state_size;
    r.added = r.answer + six(m);
    r.state = r.added + 6 * six(m);
    r.wrenches = r.state + m->state_size;
    r.differences = r.wrenches + six(m) * (size_t)m->depth;
    r.errors = r.differences + six(m) * rows(m);
    return r;
}

static void copy(double *to, const double *from, size_t count) { memcpy(to, from, count * sizeof(double)); }

static double time_of(const lw_march *m, int64_t step) { return (double)(step * m->step_ns) / 1e9; }

static int same(const lw_message *message, int64_t step, int64_t step_ns, int32_t i) {
    *message->step = (uint64_t)step;
    *message->time = (uint64_t)(step * step_ns);
    return memcmp(message->bytes, message->recorded[i], message->size) == 0;
}

/* One macro step from the accepted state, with the polynomial through the last `count` wrenches. */
static int advance(const lw_march *m, int64_t step, const double *nodes, int32_t count, double *next, double *work) {
    lw_macro_step how = *m->how;
    how.state = m->state;
    how.h = (double)m->step_ns / 1e9;
    how.time = time_of(m, step - 1);
    how.nodes = nodes;
    how.wrenches = m->wrenches;
    how.added_inertia = m->added_inertia;
    how.count = count;
    how.next = next;
    how.work = work;
    return lw_multibody_advance(m->multibody, &how) == LW_OK;
}

static void write_motion(const lw_march *m, const double *state, const lw_motion *out) {
    lw_multibody_motion(m->multibody, state, (lw_unaligned *)out->position, (lw_unaligned *)out->orientation,
                        (lw_unaligned *)out->linear, (lw_unaligned *)out->angular);
}

/* Let a provider take the accepted state and answer the trial state. A field that takes the same state twice
 * has the same headings, so that a step can be taken again. */
static int answer(const lw_march *m, const lw_provider *p, double time) {
    switch (p->model) {
    case LW_PLATES:
        return lw_plates_evaluate(p->constants, time, &m->trial, &p->wrench) == 0;
    case LW_FIELD:
        lw_field_commit(p->constants, &m->accepted, p->theta);
        return lw_field_evaluate(p->constants, time, &m->trial, p->theta, &p->wrench) == 0;
    default:
        return p->model == LW_NO_FORCE; /* its message has the zeros */
    }
}

static int finite(const double *numbers, size_t count) {
    for (size_t i = 0; i < count; ++i)
        if (!isfinite(numbers[i])) return 0;
    return 1;
}

static void take(double *to, const lw_unaligned *from, int count, int alone) {
    for (int i = 0; i < count; ++i) to[i] = alone ? from[i] : to[i] + from[i];
}

/* The sum of all answers, in the scenario's order. */
static int add_up(const lw_march *m, const lw_room *r) {
    memset(r->answer, 0, 7 * six(m) * sizeof(double));
    int added = 0;
    for (int32_t k = 0; k < m->providers; ++k) {
        const lw_provider *p = &m->provider[k];
        for (int32_t i = 0; i < p->n; ++i) {
            double *wrench = r->answer + 6 * p->body[i];
            take(wrench, p->wrench.force + 3 * i, 3, m->alone);
            take(wrench + 3, p->wrench.torque + 3 * i, 3, m->alone);
            if (p->wrench.added_inertia)
                take(r->added + 36 * p->body[i], p->wrench.added_inertia + 36 * i, 36, m->alone);
        }
        added = added || p->wrench.added_inertia;
    }
    if (!finite(r->answer, 7 * six(m)) || added != (m->added_inertia != NULL)) return 0;
    return !added || memcmp(r->added, m->added_inertia, 6 * six(m) * sizeof(double)) == 0;
}

/* linkwind.coupling.degree: take the newest wrench, choose the degree of the next prediction. */
static int choose(lw_march *m) {
    size_t size = six(m);
    double *table = m->differences;
    memmove(table + size, table, (rows(m) - 1) * size * sizeof(double));
    for (size_t i = 0; i < size; ++i) table[i] = m->wrenches[i] * m->weight[i];
    int32_t best = 0;
    for (size_t d = 0; d + 1 < rows(m); ++d) {
        const double *lower = table + d * size;
        double *difference = table + (d + 1) * size, missed = 0.0;
        for (size_t i = 0; i < size; ++i) {
            difference[i] = lower[i] - difference[i];
            missed += difference[i] * difference[i];
        }
        m->errors[d] = MEMORY * m->errors[d] + (1.0 - MEMORY) * missed;
        if (!isfinite(m->errors[d])) return 0;
        if (m->errors[d] < m->errors[best]) best = (int32_t)d;
    }
    if (m->adaptive) m->degree = best;
    return 1;
}

/* The messages State and Step, as linkwind.dynamics.recorder writes them. */
static int write_point(lw_march *m, const lw_room *r, int64_t step, int32_t degree, int32_t i) {
    lw_point p = *m->point;
    p.state = m->state;
    p.trial = r->trial;
    p.time = time_of(m, step);
    p.wrench = m->wrenches;
    p.added_inertia = m->added_inertia;
    if (lw_multibody_point(m->multibody, &p) != LW_OK) return 0;
    *m->kinetic = p.measures->kinetic;
    *m->potential = p.measures->potential;
    *m->external = m->work[0];
    *m->dissipated = m->work[1];
    *m->gap = p.measures->gap;
    if (p.measures->gap > m->largest_gap) m->largest_gap = p.measures->gap;
    if (p.measures->force > m->largest_force) m->largest_force = p.measures->force;
    if (!same(&m->end, step, m->step_ns, i)) return 0;
    *m->extrapolated = (uint32_t)degree;
    for (int32_t d = 0; d <= m->order; ++d) m->extrapolation_error[d] = m->errors[d];
    *m->residual = sqrt(p.measures->missed);
    *m->interface_energy = p.measures->lost * (double)m->step_ns / 1e9;
    return same(&m->step, step, m->step_ns, i);
}

/* One step; false where the record has another, or nothing at all comes of it. */
static int take_step(lw_march *m, const lw_room *r, int64_t step, int32_t i) {
    int32_t degree = m->degree;
    double work[2];
    if (!advance(m, step, NODES + 1, degree + 1, r->trial, work)) return 0;
    write_motion(m, m->state, &m->accepted);
    write_motion(m, r->trial, &m->trial);
    if (!same(&m->motion, step, m->step_ns, i)) return 0;
    for (int32_t k = 0; k < m->providers; ++k)
        if (!answer(m, &m->provider[k], time_of(m, step)) || !same(&m->provider[k].message, step, m->step_ns, i))
            return 0;
    if (!add_up(m, r)) return 0;
    memmove(m->wrenches + six(m), m->wrenches, six(m) * ((size_t)m->depth - 1) * sizeof(double));
    copy(m->wrenches, r->answer, six(m));
    if (!advance(m, step, NODES, (m->order > 1 ? m->order : 1) + 1, m->state, work)) return 0;
    m->work[0] += work[0];
    m->work[1] += work[1];
    return choose(m) && write_point(m, r, step, degree, i);
}

int32_t lw_march_go(lw_march *m, int32_t count) {
    lw_room r = cut(m);
    size_t history = six(m) * (size_t)m->depth, table = six(m) * rows(m);
    for (int32_t i = 0; i < count; ++i) {
        const double work[] = {m->work[0], m->work[1]};
        int32_t degree = m->degree;
        copy(r.state, m->state, (size_t)m->state_size);
        copy(r.wrenches, m->wrenches, history);
        copy(r.differences, m->differences, table);
        copy(r.errors, m->errors, rows(m) - 1);
        if (take_step(m, &r, m->first + i, i)) continue;
        copy(m->state, r.state, (size_t)m->state_size);
        copy(m->wrenches, r.wrenches, history);
        copy(m->differences, r.differences, table);
        copy(m->errors, r.errors, rows(m) - 1);
        copy(m->work, work, 2);
        m->degree = degree;
        return i;
    }
    return count;
}
