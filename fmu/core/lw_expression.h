/* Expressions compiled to postfix programs for a stack machine. */
#ifndef LW_EXPRESSION_H
#define LW_EXPRESSION_H

#include <stdint.h>

#include "lw_math.h"

/* Machine limits; whoever writes a program has to keep to them. */
enum { LW_EXPRESSION_STACK = 64, LW_EXPRESSION_LOCALS = 64 };

enum { /* operations; the operand, where there is one, in brackets */
    LW_CONSTANT, /* push constants[operand] */
    LW_VARIABLE, /* push the variable [operand] */
    LW_LOCAL,    /* push the local value [operand] */
    LW_DEFINE,   /* pop into the local value [operand] */
    LW_RESULT,   /* pop into the result [operand] */
    LW_NEGATE, LW_ADD, LW_SUBTRACT, LW_MULTIPLY, LW_DIVIDE,
    LW_POWER,         /* real exponent */
    LW_POWER_INTEGER, /* exponent [operand], by repeated multiplication */
    LW_SIN, LW_COS, LW_TAN, LW_ASIN, LW_ACOS, LW_ATAN, LW_SINH, LW_COSH, LW_TANH,
    LW_EXP, LW_LOG, LW_SQRT, LW_ABS,
    LW_ATAN2, LW_HYPOT, LW_MIN, LW_MAX,
    LW_TABLE /* the curve at constants + [operand] */
};

/* A value that changes with one parameter, such as time, and its first two derivatives by that. */
typedef struct { double value, rate, change; } lw_jet;

/* A curve of cubic pieces at x: number of pieces m, period or 0, the m + 1 places where they begin and end,
 * 4 coefficients of each; held beyond its ends. */
lw_jet lw_curve(const double *table, double x);

/* Run the program from `code` to `end`, pairs of operation and operand; results that it does not give stay. */
void lw_expression_run(const int32_t *code, const int32_t *end, const double *constants,
                       const double *variables, double *results);

/* The same with derivatives: of variables that change, the results and how they do. */
LW_API void lw_expression_jet(const int32_t *code, const int32_t *end, const double *constants,
                              const lw_jet *variables, lw_jet *results);

#endif
