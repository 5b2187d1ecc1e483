/* The integrators: README, section Integrators. The vector y is (q, v, work, dissipated). */
#include "lw_integrate.h"

#include <string.h>

static int length(const lw_multibody *mb) { return mb->nq + mb->nv + 2; }

/* The wrench at s, in units of the macro step; inputs of force elements become what they are then. */
static const double *wrench_at(lw_run *run, double s) {
    lw_multibody *mb = run->mb;
    if (run->step->inputs) {
        lw_polynomial_value(&run->wrench, s, mb->inputs, run->step->inputs, mb->given);
        lw_multibody_set_inputs(mb, mb->given);
    }
    if (run->wrench.count == 1) return run->step->wrenches;
    lw_polynomial_value(&run->wrench, s, 6 * mb->n, run->step->wrenches, mb->wrench);
    return mb->wrench;
}

static int prescribe(lw_run *run, double time, double *y) {
    int status = lw_take_time(run->mb, time, run->step->fault);
    if (!status) lw_prescribe(run->mb, y, y + run->mb->nq);
    return status;
}

int lw_derive(lw_run *run, double s, double time, double *y, double *rate) {
    lw_multibody *mb = run->mb;
    const double *wrench = wrench_at(run, s), *v = y + mb->nq;
    double *powers = rate + mb->nq + mb->nv;
    int status = mb->forces ? prescribe(run, time, y) : LW_OK;
    if (!status) status = lw_accelerations(mb, y, v, wrench, rate + mb->nq, run->step->fault);
    if (status) {
        run->step->fault->time = s * run->step->h;
        return status;
    }
    lw_coordinate_rate(mb, y, v, rate);
    powers[0] = lw_wrench_power(mb, wrench);
    powers[1] = lw_damper_power(mb, v);
    lw_elements_power(mb, &powers[0], &powers[1]);
    if (mb->formulation && mb->formulation->tree) lw_elements_power(mb->formulation->tree, &powers[0], &powers[1]);
    return LW_OK;
}

static int overflowed(const double *values, int first, int count) {
    for (int k = first; k < first + count; ++k)
        if (!isfinite(values[k])) return 1;
    return 0;
}

/* Every accepted substep ends here: unit quaternions, finite numbers, closed loops, what a formulation adds. */
static int settle(lw_run *run, double *y, double s, double time) {
    lw_multibody *mb = run->mb;
    lw_coordinate_normalise(mb, y);
    for (int i = 0; i < mb->n; ++i) {
        const lw_link *l = &mb->link[i];
        if (!overflowed(y, l->q, lw_joint_nq(l->type)) && !overflowed(y, mb->nq + l->v, l->columns)) continue;
        run->step->fault->item = l->body;
        run->step->fault->time = s * run->step->h;
        return LW_NOT_FINITE;
    }
    run->step->fault->time = s * run->step->h;
    int status = mb->forces ? prescribe(run, time, y) : LW_OK;
    if (status) return status;
    if (mb->formulation) return mb->formulation->settle(mb, y, y + mb->nq, run->step->fault);
    return mb->rows ? lw_project(mb, y, y + mb->nq, run->step->fault) : LW_OK;
}

/* ---- explicit Runge-Kutta methods ---- */

typedef struct {
    int stages;
    double a[LW_MAX_STAGES][LW_MAX_STAGES - 1], b[LW_MAX_STAGES], c[LW_MAX_STAGES];
} lw_tableau;

/* Forward Euler: everything moves with what it is at the start. */
static const lw_tableau euler = {1, {{0.0}}, {1.0}, {0.0}};

/* W. Kutta 1901; E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, II.1. */
static const lw_tableau rk4 = {4,
                               {{0.0}, {0.5}, {0.0, 0.5}, {0.0, 0.0, 1.0}},
                               {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0},
                               {0.0, 0.5, 0.5, 1.0}};

/* J. R. Dormand, P. J. Prince 1980, doi:10.1016/0771-050X(80)90013-3. Its last row is its weights, so the
 * seventh stage is the first of the next substep. */
static const lw_tableau dopri5 = {
    7,
    {{0.0},
     {1.0 / 5.0},
     {3.0 / 40.0, 9.0 / 40.0},
     {44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0},
     {19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0},
     {9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0},
     {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0}},
    {35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0},
    {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0}};

/* Weights of order 5 minus weights of order 4. */
static const double dopri5_error[7] = {71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0,
                                       -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0};

/* sum = y + h * (weights . rates) */
static void combine(const lw_multibody *mb, int count, const double *weights, double h, double *sum) {
    int size = length(mb);
    memcpy(sum, mb->y, (size_t)size * sizeof(double));
    for (int j = 0; j < count; ++j) {
        if (weights[j] == 0.0) continue;
        double factor = h * weights[j];
        const double *rate = mb->rate[j];
        for (int k = 0; k < size; ++k) sum[k] += factor * rate[k];
    }
}

/* The rates from stage `first` on, for a substep of `h` [s] from `s` and `time`; `width` is h in macro steps. */
static int stages(lw_run *run, const lw_tableau *t, int first, double s, double time, double width, double h) {
    lw_multibody *mb = run->mb;
    for (int i = first; i < t->stages; ++i) {
        double *y = mb->y;
        if (i > 0) {
            combine(mb, i, t->a[i], h, mb->trial);
            y = mb->trial;
        }
        int status = lw_derive(run, s + t->c[i] * width, time + t->c[i] * h, y, mb->rate[i]);
        if (status) return status;
    }
    return LW_OK;
}

static int runge_kutta(lw_run *run, const lw_tableau *t, double s, double time, double width, double h) {
    lw_multibody *mb = run->mb;
    int status = stages(run, t, 0, s, time, width, h);
    if (status) return status;
    combine(mb, t->stages, t->b, h, mb->y);
    return settle(run, mb->y, s + width, time + h);
}

/* ---- semi-implicit Euler: the position moves with the new velocity ---- */

static int semi_implicit_euler(lw_run *run, double s, double time, double width, double h) {
    lw_multibody *mb = run->mb;
    double *y = mb->y, *rate = mb->rate[0];
    int status = lw_derive(run, s, time, y, rate);
    if (status) return status;
    for (int i = mb->nq; i < length(mb); ++i) y[i] += h * rate[i];
    lw_coordinate_rate(mb, y, y + mb->nq, rate);
    for (int i = 0; i < mb->nq; ++i) y[i] += h * rate[i];
    return settle(run, y, s + width, time + h);
}

/* ---- implicit: Radau IIA ---- */

static int implicit(lw_run *run, double s, double time, double width, double h) {
    int status = lw_radau5(run, s, time, width, h);
    return status ? status : settle(run, run->mb->y, s + width, time + h);
}

/* ---- one step of a method, of `h` [s] from s and `time`; `width` is h, and s is, in macro steps ---- */

static int substep(lw_run *run, double s, double time, double width, double h) {
    switch (run->step->integrator) {
    case LW_EULER: return runge_kutta(run, &euler, s, time, width, h);
    case LW_SEMI_IMPLICIT_EULER: return semi_implicit_euler(run, s, time, width, h);
    case LW_RK4: return runge_kutta(run, &rk4, s, time, width, h);
    case LW_RADAU5: return implicit(run, s, time, width, h);
    default: return runge_kutta(run, &dopri5, s, time, width, h);
    }
}

/* ---- events ---- */

enum { LW_BISECTIONS = 48, LW_MAX_EVENTS = 1000 }; /* in a substep */

static double at(const lw_run *run, double s) { return run->step->time + s * run->step->h; }

static void remember(lw_multibody *mb) { memcpy(mb->before, mb->y, (size_t)length(mb) * sizeof(double)); }

static int again(lw_run *run, double s, double width) {
    memcpy(run->mb->y, run->mb->before, (size_t)length(run->mb) * sizeof(double));
    return substep(run, s, at(run, s), width, width * run->step->h);
}

static int due(lw_run *run, double s, int *found) {
    return lw_events_due(run->mb, run->mb->y, at(run, s), wrench_at(run, s), found, run->step->fault);
}

/* Shorten the step that was just taken from s until the first event is at its end; returns its length. */
static int locate(lw_run *run, double s, double *width) {
    double early = 0.0, late = *width;
    int found = 1, status = LW_OK;
    for (int k = 0; k < LW_BISECTIONS && !status; ++k) {
        double middle = 0.5 * (early + late);
        if ((status = again(run, s, middle)) || (status = due(run, s + middle, &found))) break;
        if (found) late = middle;
        else early = middle;
    }
    *width = late;
    return status ? status : again(run, s, late);
}

/* The step from s to `end` has been taken: if anything happened on the way, take it up to there, let it happen,
 * and take the rest. */
static int watch(lw_run *run, double s, double end, double h) {
    lw_multibody *mb = run->mb;
    for (int k = 0; k < LW_MAX_EVENTS && mb->events; ++k) {
        int found = 0, status = due(run, end, &found);
        if (status || !found) return status;
        double width = end - s;
        run->interrupted = 1;
        if ((status = locate(run, s, &width))) return status;
        s += width;
        status = lw_events_happen(mb, mb->y, at(run, s), h, 0.0, wrench_at(run, s), run->step->fault);
        if (status || !(end > s)) return status;
        remember(mb);
        if ((status = substep(run, s, at(run, s), end - s, (end - s) * run->step->h))) return status;
    }
    run->step->fault->time = s * run->step->h;
    return mb->events ? LW_CROWDED : LW_OK;
}

static int equal_substeps(lw_run *run) {
    double h = run->step->h / run->step->substeps, width = 1.0 / run->step->substeps;
    for (int32_t k = 0; k < run->step->substeps; ++k) {
        if (run->mb->events) remember(run->mb);
        double time = run->step->time + run->step->h * k / run->step->substeps;
        int status = substep(run, k * width, time, width, h);
        if (!status) status = watch(run, k * width, (k + 1) * width, h);
        if (status) return status;
    }
    return LW_OK;
}

/* ---- Dormand-Prince 5(4) with error control ---- */

/* Root mean square of the estimated error in units of the tolerance, over q and v. The result of the
 * step is in `trial`. */
static double error_norm(const lw_run *run, double h) {
    const lw_multibody *mb = run->mb;
    int size = mb->nq + mb->nv;
    double sum = 0.0;
    for (int k = 0; k < size; ++k) {
        double error = 0.0, larger = fmax(fabs(mb->y[k]), fabs(mb->trial[k]));
        for (int j = 0; j < 7; ++j) error += dopri5_error[j] * mb->rate[j][k];
        error *= h / (run->step->atol + run->step->rtol * larger);
        sum += error * error;
    }
    return size ? sqrt(sum / size) : 0.0;
}

/* Factor from one substep to the next; a norm that is not a number shrinks the step. */
static double step_factor(double norm) {
    if (!(norm < HUGE_VAL)) return 0.2;
    if (norm == 0.0) return 5.0;
    return fmin(5.0, fmax(0.2, 0.9 * pow(norm, -0.2)));
}

/* Take the trial as the state; its rate is known from the last stage, but for the normalised part. */
static int accept(lw_run *run, double from, double time) {
    lw_multibody *mb = run->mb;
    remember(mb);
    run->interrupted = 0;
    memcpy(mb->y, mb->trial, (size_t)length(mb) * sizeof(double));
    double *last = mb->rate[6];
    mb->rate[6] = mb->rate[0];
    mb->rate[0] = last;
    int status = settle(run, mb->y, time / run->step->h, run->step->time + time);
    if (!status) status = watch(run, from / run->step->h, time / run->step->h, time - from);
    if (!status && (mb->formulation || mb->rows || run->interrupted))
        return lw_derive(run, time / run->step->h, run->step->time + time, mb->y, mb->rate[0]);
    lw_coordinate_rate(mb, mb->y, mb->y + mb->nq, mb->rate[0]);
    return status;
}

enum { LW_MAX_SUBSTEPS = 1000000 }; /* of dopri5 in a macro step: a run shall end, if with an error */

static int dormand_prince(lw_run *run) {
    lw_multibody *mb = run->mb;
    double time = 0.0, h = run->step->h, limit = run->step->h / run->step->substeps, largest = 5.0;
    double next = run->proposed > 0.0 ? fmin(run->proposed, limit) : limit;
    int trouble = LW_OK, status = lw_derive(run, 0.0, run->step->time, mb->y, mb->rate[0]);
    if (run->proposed <= 0.0) run->proposed = next;
    for (int tried = 0; !status && time < h; ++tried) {
        int last = time + 1.01 * next >= h;
        double step = last ? h - time : next;
        if (step < 1e-13 * h || tried == LW_MAX_SUBSTEPS) {
            run->step->fault->time = time;
            return trouble ? trouble : LW_STEP_UNDERFLOW;
        }
        /* A stage that cannot be evaluated means that the step is too long, until none is short enough. */
        trouble = stages(run, &dopri5, 1, time / h, run->step->time + time, step / h, step);
        double norm = trouble ? HUGE_VAL : error_norm(run, step), factor = step_factor(norm);
        int clipped = factor >= largest;
        next = step * fmin(factor, largest);
        largest = norm <= 1.0 ? 5.0 : 1.0; /* no growth right after a rejection */
        if (norm <= 1.0) {
            /* A step cut short by the end of the macro step says nothing against a longer one. */
            run->proposed = last && clipped ? fmax(next, run->proposed) : next;
            double from = time;
            time = last ? h : time + step;
            status = accept(run, from, time);
        } else {
            run->proposed = next;
        }
    }
    return status;
}

/* ---- one macro step ---- */

static int check_arguments(lw_run *run) {
    const lw_macro_step *step = run->step;
    if (!(step->h > 0.0) || !isfinite(step->h) || !isfinite(step->time)) return LW_BAD_STEP;
    if (step->substeps < 1) return LW_BAD_SUBSTEPS;
    if (step->integrator == LW_RADAU5 && !step->memory) return LW_BAD_INTEGRATOR;
    if (!(step->rtol >= 0.0 && step->atol > 0.0)) return LW_BAD_TOLERANCE;
    if (lw_polynomial_init(&run->wrench, step->count, step->nodes)) return LW_BAD_NODES;
    return lw_inputs_check(run->mb, step->state, step->count, step->wrenches, step->added_inertia,
                           step->fault);
}

static int integrate(lw_run *run) {
    switch (run->step->integrator) {
    case LW_EULER:
    case LW_SEMI_IMPLICIT_EULER:
    case LW_RK4:
    case LW_RADAU5: return equal_substeps(run);
    case LW_DOPRI5: return dormand_prince(run);
    default: return LW_BAD_INTEGRATOR;
    }
}

int lw_multibody_advance(lw_multibody *mb, const lw_macro_step *step) {
    int coordinates = mb->nq + mb->nv;
    lw_run run = {.mb = mb, .step = step};
    int status = check_arguments(&run);
    if (status) return status;
    run.proposed = step->state[coordinates];
    lw_modes(mb, step->state + coordinates + 1);
    lw_bind_added(mb, step->added_inertia);
    memcpy(mb->y, step->state, (size_t)coordinates * sizeof(double));
    mb->y[coordinates] = mb->y[coordinates + 1] = 0.0;
    if ((status = integrate(&run))) return status;
    memcpy(step->next, mb->y, (size_t)coordinates * sizeof(double));
    step->next[coordinates] = run.proposed;
    memcpy(step->next + coordinates + 1, mb->happened, (size_t)mb->events * sizeof(double));
    memcpy(step->work, mb->y + coordinates, 2 * sizeof(double));
    return LW_OK;
}
