/* Random arguments: arrays on the heap, exactly as long as is claimed. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lw_fmu.h"

enum { LONGEST = 512 };

static uint64_t random_state;

static unsigned pick(unsigned below) {
    random_state ^= random_state << 13, random_state ^= random_state >> 7, random_state ^= random_state << 17;
    return (unsigned)(random_state >> 33) % below;
}

static double number(void) {
    static const double odd[] = {NAN, INFINITY, -INFINITY, 1e300, -1e300, 0.0, -0.0, -1.0, 1e-300, 1e10};
    return pick(12) ? pick(2001) * 1e-3 - 1.0 : odd[pick(10)];
}

static double *numbers(size_t count) {
    double *values = malloc(count * sizeof(double) + 1);
    for (size_t i = 0; i < count; ++i) values[i] = number();
    return values;
}

/* Some references, mostly to variables of the type; how many values they have. */
typedef struct {
    uint32_t *vr;
    size_t n, count;
} list;

static list references(int type) {
    list l = {malloc(5 * sizeof *l.vr), pick(5), 0};
    for (size_t i = 0; i < l.n; ++i) {
        unsigned tries = 20;
        do l.vr[i] = pick(lw_fmu_variable_count);
        while (--tries && lw_fmu_variables[l.vr[i]].type != type);
        l.count += lw_fmu_variables[l.vr[i]].size;
        if (!pick(40)) l.vr[i] = pick(2) ? lw_fmu_variable_count : 0xffffffffu;
    }
    if (!pick(20)) l.count = pick(10);
    if (l.count > LONGEST) l.count = LONGEST;
    return l;
}

/* Parameters and states mostly get their start values, so that instances live on. */
static void soothe(list l, double *values) {
    for (size_t i = 0, at = 0; i < l.n && l.vr[i] < lw_fmu_variable_count; at += lw_fmu_variables[l.vr[i++]].size) {
        const lw_fmu_variable *v = &lw_fmu_variables[l.vr[i]];
        int tame = v->causality != LW_INPUT && v->type == LW_TYPE_FLOAT64 && pick(50);
        for (size_t k = 0; tame && k < v->size && at + k < l.count; ++k) values[at + k] = lw_fmu_start[v->offset + k];
    }
}
