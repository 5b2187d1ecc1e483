/* A force model: motion in, wrench and added inertia out. */
#include <math.h>
#include <string.h>

#include "lw_field.h"
#include "lw_part.h"
#include "lw_plate.h"

enum { WRENCH = 1 }; /* the one group */

struct lw_part {
    uint32_t first[LW_AERO_SECTIONS + 1];
    lw_plates plates;
    lw_field field;
    double *size;  /* (n, 2) chord, of a wing the mean one, and span [m] */
    double *wind;  /* (wind_constant_count) constants of the wind's functions */
    int32_t *body; /* (n) 0 ... n - 1 */
};

/* Index of the first value of a section; the values themselves. */
#define FIRST(name) (instance->part->first[LW_AERO_##name])
#define AT(name) (instance->values + FIRST(name))

/* ---- layout ---- */

#define COUNT(name, size) count += (size_t)(size);

size_t lw_part_known(void) {
    int32_t n = lw_fmu_n;
    size_t count = 0;
    LW_AERO_KNOWN(COUNT)
    return count;
}

size_t lw_part_values(void) {
    int32_t n = lw_fmu_n;
    size_t count = lw_part_known();
    LW_AERO_CALCULATED(COUNT)
    return count;
}

/* The field's headings. */
size_t lw_part_memory(void) { return (size_t)lw_fmu_n; }

static size_t own_size(void) { return (sizeof(lw_part) + 7) / 8 * 8; }

size_t lw_part_size(void) {
    return own_size() + (size_t)(lw_fmu_n * 3 + lw_fmu_wind_constant_count) * sizeof(double);
}

void lw_part_create(lw_instance *instance) {
    lw_part *part = instance->part;
    int32_t n = lw_fmu_n;
    uint32_t count = 0, *first = part->first;
#define PLACE(name, size) *first++ = count, count += (uint32_t)(size);
    LW_AERO_KNOWN(PLACE) LW_AERO_CALCULATED(PLACE)
    *first = count;
    part->size = (double *)(void *)((char *)part + own_size());
    part->wind = part->size + 2 * n;
    part->body = (int32_t *)(void *)(part->wind + lw_fmu_wind_constant_count);
    for (int32_t i = 0; i < n; ++i) part->body[i] = i;
    part->field.n = part->plates.n = n;
    part->field.body = part->plates.body = part->body;
    part->field.start = lw_fmu_field_start;
    part->field.code = lw_fmu_field_code;
    part->field.constants = lw_fmu_field_constants;
    part->plates.coefficients = lw_fmu_coefficients;
    part->plates.strips = lw_fmu_strips;
    part->plates.curve_size = lw_fmu_curve_size;
    part->plates.curves = lw_fmu_curves;
    part->plates.size = part->size;
    part->plates.planform = lw_fmu_planform_size ? lw_fmu_planform : NULL;
    part->plates.wind.n_gusts = lw_fmu_gust_count;
    part->plates.wind.gusts = lw_fmu_gusts;
    part->plates.wind.instructions = lw_fmu_wind_instructions;
    part->plates.wind.code = lw_fmu_wind_code;
    part->plates.wind.constants = part->wind;
    memcpy(part->wind, lw_fmu_wind_constants, (size_t)lw_fmu_wind_constant_count * sizeof(double));
}

void lw_part_restart(lw_instance *instance) {
    memcpy(instance->store, lw_fmu_theta, lw_part_memory() * sizeof(double));
}

uint32_t lw_part_first(const lw_instance *instance, unsigned section) {
    return instance->part->first[section];
}

uint32_t lw_part_inputs(const lw_instance *instance) { return FIRST(POSITION); }

uint32_t lw_part_states(const lw_instance *instance) { return (void)instance, 0; }

uint32_t lw_part_derivatives(const lw_instance *instance, unsigned *groups) {
    *groups = 0;
    return (void)instance, 0;
}

/* ---- parameters ---- */

static int check_sign(const lw_instance *instance, unsigned number, int zero_allowed) {
    const uint32_t *first = instance->part->first;
    for (uint32_t i = first[number]; i < first[number + 1]; ++i)
        if (!(instance->values[i] > 0.0 || (zero_allowed && instance->values[i] == 0.0)))
            return lw_report(instance, LW_FMI_ERROR, "%s: Expected %s but was %.17g.",
                             lw_name_at(LW_TYPE_FLOAT64, i), zero_allowed ? "zero or more" : "more than zero",
                             instance->values[i]);
    return LW_FMI_OK;
}

int lw_part_configure(lw_instance *instance) {
    lw_part *part = instance->part;
    if (lw_fmu_aero_model != LW_AERO_PLATE) return LW_FMI_OK;
    if (check_sign(instance, LW_AERO_DENSITY, 1) || check_sign(instance, LW_AERO_LENGTH, 0) ||
        check_sign(instance, LW_AERO_SPAN, 0))
        return LW_FMI_ERROR;
    part->plates.density = *AT(DENSITY);
    memcpy(part->plates.wind.uniform, AT(WIND), sizeof part->plates.wind.uniform);
    for (int32_t i = 0; i < lw_fmu_n; ++i) {
        part->size[2 * i] = AT(LENGTH)[i];
        part->size[2 * i + 1] = AT(SPAN)[i];
    }
    return LW_FMI_OK;
}

/* ---- outputs ---- */

static lw_motion motion(const lw_instance *instance) {
    lw_motion now = {AT(POSITION), AT(ORIENTATION), AT(LINEAR), AT(ANGULAR)};
    return now;
}

unsigned lw_part_group(unsigned number) { return (void)number, WRENCH; }

/* Say why there is no finite wrench on a body. */
static int refuse(lw_instance *instance, int body, const lw_motion *now) {
    double place[6];
    int wind = lw_fmu_aero_model == LW_AERO_PLATE
                   ? lw_plates_wind_fault(&instance->part->plates, body, instance->time, now, place)
                   : 0;
    if (!wind)
        return lw_report(instance, LW_FMI_DISCARD, "Expected a finite wrench on body %d but was none at %.9g s.",
                         body, instance->time);
    return lw_report(instance, LW_FMI_DISCARD,
                     "Expected a finite wind along %c on body %d but was none at %.9g s, (%.9g, %.9g, %.9g) m.",
                     "xyz"[wind - 1], body, instance->time, place[0], place[1], place[2]);
}

int lw_part_update(lw_instance *instance, unsigned groups) {
    const lw_part *part = instance->part;
    lw_motion now = motion(instance);
    lw_wrench wrench = {AT(FORCE), AT(TORQUE), AT(ADDED_INERTIA)};
    int field = lw_fmu_aero_model == LW_AERO_FIELD;
    (void)groups;
    memcpy(part->wind, AT(WIND_INPUT), (size_t)lw_fmu_wind_inputs * sizeof(double));
    int status = field ? lw_field_evaluate(&part->field, instance->time, &now, instance->store, &wrench)
                       : lw_plates_evaluate(&part->plates, instance->time, &now, &wrench);
    if (!status) return LW_FMI_OK;
    return refuse(instance, field ? (status - 1) / 6 : status - 1, &now);
}

int32_t lw_part_output_order(void) { return 0; }

int lw_part_rate(unsigned number) { return (void)number, -1; }

/* ---- steps: what was set and accepted at the start is what headings are unwrapped against ---- */

int32_t lw_part_pieces(const lw_instance *instance) { return (void)instance, 1; }

int lw_part_advance(lw_instance *instance, double h, int32_t pieces) {
    (void)h, (void)pieces;
    int event;
    lw_part_accept(instance, &event);
    return LW_FMI_OK;
}

void lw_part_accept(lw_instance *instance, int *event) {
    *event = 0;
    lw_motion now = motion(instance);
    if (lw_fmu_aero_model == LW_AERO_FIELD) lw_field_commit(&instance->part->field, &now, instance->store);
}

int lw_part_set_input_derivative(lw_instance *instance, uint32_t index, int32_t order, double value) {
    return (void)instance, (void)index, (void)order, (void)value, 0;
}

/* ---- scales of differences ---- */

static double norm(const double *row) { return lw_norm(lw_load3(row)); }

/* Of a body, in the wind at its centre of mass. */
static double airspeed(const lw_instance *instance, uint32_t body) {
    const lw_vec3 v = lw_load3(AT(LINEAR) + 3 * body), r = lw_load3(AT(POSITION) + 3 * body);
    return lw_norm(lw_sub(v, lw_wind_at(&instance->part->plates.wind, instance->time, r, v).velocity));
}

/* A force law turns with the direction of the air: speeds vary by what they are. */
double lw_part_scale(const lw_instance *instance, const lw_fmu_variable *variable, uint32_t index) {
    uint32_t place = index - instance->part->first[variable->section];
    double scale = fabs(instance->values[index]);
    switch (variable->section) {
    case LW_AERO_POSITION:
    case LW_AERO_ORIENTATION: return 1.0;
    case LW_AERO_LINEAR: scale = airspeed(instance, place / 3); break;
    case LW_AERO_ANGULAR: scale = norm(AT(ANGULAR) + place / 3 * 3); break;
    case LW_AERO_WIND: scale = norm(AT(WIND)); break;
    default: break;
    }
    return scale > 0.0 ? scale : 1.0;
}

/* ---- events: none ---- */

size_t lw_part_indicators(const lw_instance *instance, uint32_t *first, unsigned *group) {
    (void)instance;
    *first = 0, *group = 0;
    return 0;
}

int lw_part_event(lw_instance *instance, int *changed, double *next) {
    (void)instance;
    *changed = 0, *next = HUGE_VAL;
    return LW_FMI_OK;
}
