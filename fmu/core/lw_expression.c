#include "lw_expression.h"

/* ---- values ---- */

/* x^n without the C library's pow, whose last bit differs between platforms. */
static double power_integer(double x, int32_t n) {
    uint32_t left = n < 0 ? 0u - (uint32_t)n : (uint32_t)n;
    double result = 1.0;
    for (; left; left >>= 1, x *= x) {
        if (left & 1u) {
            result *= x;
        }
    }
    return n < 0 ? 1.0 / result : result;
}

static double unary(int32_t operation, double x) {
    switch (operation) {
    case LW_NEGATE: return -x;
    case LW_SIN: return sin(x);
    case LW_COS: return cos(x);
    case LW_TAN: return tan(x);
    case LW_ASIN: return asin(x);
    case LW_ACOS: return acos(x);
    case LW_ATAN: return atan(x);
    case LW_SINH: return sinh(x);
    case LW_COSH: return cosh(x);
    case LW_TANH: return tanh(x);
    case LW_EXP: return exp(x);
    case LW_LOG: return log(x);
    case LW_SQRT: return sqrt(x);
    case LW_ABS: return fabs(x);
    default: return NAN;
    }
}

/* min and max let a NaN through (fmin and fmax would hide it) and return the first of two equals. */
static double binary(int32_t operation, double x, double y) {
    switch (operation) {
    case LW_ADD: return x + y;
    case LW_SUBTRACT: return x - y;
    case LW_MULTIPLY: return x * y;
    case LW_DIVIDE: return x / y;
    case LW_POWER: return pow(x, y);
    case LW_ATAN2: return atan2(x, y);
    case LW_HYPOT: return hypot(x, y);
    case LW_MIN: return y < x || y != y ? y : x;
    case LW_MAX: return y > x || y != y ? y : x;
    default: return NAN;
    }
}

static int is_unary(int32_t operation) {
    return operation == LW_NEGATE || (operation >= LW_SIN && operation <= LW_ABS);
}

lw_jet lw_curve(const double *table, double x) {
    int low = 0, high = (int)table[0];
    const double *place = table + 2, *coefficients = place + high + 1, first = place[0], last = place[high];
    if (table[1] > 0.0) x -= table[1] * floor((x - first) / table[1]);
    double held = x < first ? first : x > last ? last : x;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (held >= place[middle]) low = middle;
        else high = middle;
    }
    const double *c = coefficients + 4 * low, d = held - place[low];
    lw_jet found = {c[0] + d * (c[1] + d * (c[2] + d * c[3])), 0.0, 0.0};
    if (held != x) return found;
    found.rate = c[1] + d * (2.0 * c[2] + d * (3.0 * c[3]));
    found.change = 2.0 * c[2] + d * (6.0 * c[3]);
    return found;
}

void lw_expression_run(const int32_t *code, const int32_t *end, const double *constants,
                       const double *variables, double *results) {
    double stack[LW_EXPRESSION_STACK], local[LW_EXPRESSION_LOCALS];
    double *top = stack; /* the next free place */
    for (; code != end; code += 2) {
        const int32_t operation = code[0], operand = code[1];
        switch (operation) {
        case LW_CONSTANT: *top++ = constants[operand]; break;
        case LW_VARIABLE: *top++ = variables[operand]; break;
        case LW_LOCAL: *top++ = local[operand]; break;
        case LW_DEFINE: local[operand] = *--top; break;
        case LW_RESULT: results[operand] = *--top; break;
        case LW_POWER_INTEGER: top[-1] = power_integer(top[-1], operand); break;
        case LW_TABLE: top[-1] = lw_curve(constants + operand, top[-1]).value; break;
        default:
            if (is_unary(operation)) {
                top[-1] = unary(operation, top[-1]);
            } else {
                --top;
                top[-1] = binary(operation, top[-1], top[0]);
            }
        }
    }
}

/* ---- values with two derivatives ---- */

static lw_jet jet(double value, double rate, double change) {
    lw_jet j = {value, rate, change};
    return j;
}

/* f(x) of which value and derivatives are known. However steep f is, it does not change where x does not. */
static lw_jet chain(double f, double first, double second, lw_jet x) {
    if (x.rate == 0.0 && x.change == 0.0 && (isinf(first) || isinf(second))) return jet(f, 0.0, 0.0);
    return jet(f, first * x.rate, second * x.rate * x.rate + first * x.change);
}

static lw_jet unary_jet(int32_t operation, lw_jet x) {
    double f = unary(operation, x.value), v = x.value, r;
    switch (operation) {
    case LW_NEGATE: return chain(f, -1.0, 0.0, x);
    case LW_SIN: return chain(f, cos(v), -f, x);
    case LW_COS: return chain(f, -sin(v), -f, x);
    case LW_TAN: return chain(f, 1.0 + f * f, 2.0 * f * (1.0 + f * f), x);
    case LW_ASIN: r = 1.0 / sqrt(1.0 - v * v); return chain(f, r, v * r * r * r, x);
    case LW_ACOS: r = 1.0 / sqrt(1.0 - v * v); return chain(f, -r, -v * r * r * r, x);
    case LW_ATAN: r = 1.0 / (1.0 + v * v); return chain(f, r, -2.0 * v * r * r, x);
    case LW_SINH: return chain(f, cosh(v), f, x);
    case LW_COSH: return chain(f, sinh(v), f, x);
    case LW_TANH: r = 1.0 - f * f; return chain(f, r, -2.0 * f * r, x);
    case LW_EXP: return chain(f, f, f, x);
    case LW_LOG: return chain(f, 1.0 / v, -1.0 / (v * v), x);
    case LW_SQRT: return chain(f, 0.5 / f, -0.25 / (f * f * f), x);
    default: return chain(f, v < 0.0 ? -1.0 : 1.0, 0.0, x); /* LW_ABS */
    }
}

static lw_jet integer_jet(lw_jet x, int32_t n) {
    double first = n == 0 ? 0.0 : n * power_integer(x.value, n - 1);
    double second = n == 0 || n == 1 ? 0.0 : n * (n - 1.0) * power_integer(x.value, n - 2);
    return chain(power_integer(x.value, n), first, second, x);
}

/* x^y: a constant exponent leaves x its sign. */
static lw_jet power_jet(lw_jet x, lw_jet y) {
    double p = pow(x.value, y.value), n = y.value;
    if (y.rate == 0.0 && y.change == 0.0)
        return chain(p, n == 0.0 ? 0.0 : n * pow(x.value, n - 1.0),
                     n == 0.0 || n == 1.0 ? 0.0 : n * (n - 1.0) * pow(x.value, n - 2.0), x);
    lw_jet l = chain(log(x.value), 1.0 / x.value, -1.0 / (x.value * x.value), x);
    double rate = y.rate * l.value + n * l.rate;
    double change = y.change * l.value + 2.0 * y.rate * l.rate + n * l.change;
    return jet(p, p * rate, p * (change + rate * rate));
}

static lw_jet binary_jet(int32_t operation, lw_jet x, lw_jet y) {
    double f = binary(operation, x.value, y.value), rate, square;
    switch (operation) {
    case LW_ADD: return jet(f, x.rate + y.rate, x.change + y.change);
    case LW_SUBTRACT: return jet(f, x.rate - y.rate, x.change - y.change);
    case LW_MULTIPLY:
        return jet(f, x.rate * y.value + x.value * y.rate,
                   x.change * y.value + 2.0 * x.rate * y.rate + x.value * y.change);
    case LW_DIVIDE:
        rate = (x.rate - f * y.rate) / y.value;
        return jet(f, rate, (x.change - 2.0 * rate * y.rate - f * y.change) / y.value);
    case LW_POWER: return power_jet(x, y);
    case LW_ATAN2:
        square = x.value * x.value + y.value * y.value;
        rate = (y.value * x.rate - x.value * y.rate) / square;
        return jet(f, rate, (y.value * x.change - x.value * y.change -
                             2.0 * rate * (x.value * x.rate + y.value * y.rate)) / square);
    case LW_HYPOT:
        rate = (x.value * x.rate + y.value * y.rate) / f;
        return jet(f, rate, (x.rate * x.rate + x.value * x.change + y.rate * y.rate + y.value * y.change -
                             rate * rate) / f);
    case LW_MIN: return y.value < x.value || y.value != y.value ? y : x;
    default: return y.value > x.value || y.value != y.value ? y : x; /* LW_MAX */
    }
}

void lw_expression_jet(const int32_t *code, const int32_t *end, const double *constants,
                       const lw_jet *variables, lw_jet *results) {
    lw_jet stack[LW_EXPRESSION_STACK], local[LW_EXPRESSION_LOCALS], *top = stack, c;
    for (; code != end; code += 2) {
        const int32_t operation = code[0], operand = code[1];
        switch (operation) {
        case LW_CONSTANT: *top++ = jet(constants[operand], 0.0, 0.0); break;
        case LW_VARIABLE: *top++ = variables[operand]; break;
        case LW_LOCAL: *top++ = local[operand]; break;
        case LW_DEFINE: local[operand] = *--top; break;
        case LW_RESULT: results[operand] = *--top; break;
        case LW_POWER_INTEGER: top[-1] = integer_jet(top[-1], operand); break;
        case LW_TABLE:
            c = lw_curve(constants + operand, top[-1].value);
            top[-1] = chain(c.value, c.rate, c.change, top[-1]);
            break;
        default:
            if (is_unary(operation)) {
                top[-1] = unary_jet(operation, top[-1]);
            } else {
                --top;
                top[-1] = binary_jet(operation, top[-1], top[0]);
            }
        }
    }
}
