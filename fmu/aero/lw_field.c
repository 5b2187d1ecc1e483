#include "lw_field.h"

static const double two_pi = 6.283185307179586476925286766559;

/* Heading of the body's x axis about world z, on the branch nearest to the reference. The first column
 * of the rotation matrix is taken unnormalised, so that the quaternion's length does not matter. */
static double heading(const lw_unaligned *q, double reference) {
    const double c = q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3];
    const double s = 2.0 * (q[1] * q[2] + q[0] * q[3]);
    const double angle = atan2(s, c);
    return angle + two_pi * floor((reference - angle) / two_pi + 0.5);
}

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

/* Run one program; components without a result stay zero. */
static void run(const int32_t *code, const int32_t *end, const double *constants,
                const double variables[LW_VARIABLES], double result[6]) {
    double stack[LW_FIELD_STACK], local[LW_FIELD_LOCALS];
    double *top = stack; /* the next free place */
    for (; code != end; code += 2) {
        const int32_t operation = code[0], operand = code[1];
        switch (operation) {
        case LW_CONSTANT: *top++ = constants[operand]; break;
        case LW_VARIABLE: *top++ = variables[operand]; break;
        case LW_LOCAL: *top++ = local[operand]; break;
        case LW_DEFINE: local[operand] = *--top; break;
        case LW_RESULT: result[operand] = *--top; break;
        case LW_POWER_INTEGER: top[-1] = power_integer(top[-1], operand); break;
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

void lw_field_commit(const lw_field *field, const lw_motion *motion, double *theta) {
    for (int i = 0; i < field->n; ++i) {
        theta[i] = heading(motion->orientation + 4 * field->body[i], theta[i]);
    }
}

void lw_field_variables(const lw_field *field, int i, double t, const lw_motion *motion,
                        const double *theta, double variables[LW_VARIABLES]) {
    const int32_t b = field->body[i];
    variables[LW_VAR_T] = t;
    for (int k = 0; k < 3; ++k) {
        variables[LW_VAR_X + k] = motion->position[3 * b + k];
        variables[LW_VAR_VX + k] = motion->linear[3 * b + k];
        variables[LW_VAR_WX + k] = motion->angular[3 * b + k];
    }
    variables[LW_VAR_THETA] = heading(motion->orientation + 4 * b, theta[i]);
}

int lw_field_evaluate(const lw_field *field, double t, const lw_motion *motion, const double *theta,
                      const lw_wrench *wrench) {
    int status = 0;
    for (int i = 0; i < field->n; ++i) {
        double variables[LW_VARIABLES], result[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
        lw_field_variables(field, i, t, motion, theta, variables);
        run(field->code + 2 * field->start[i], field->code + 2 * field->start[i + 1], field->constants,
                variables, result);
        lw_store3(wrench->force + 3 * i, lw_load3(result));
        lw_store3(wrench->torque + 3 * i, lw_load3(result + 3));
        for (int c = 0; c < 6 && !status; ++c) {
            if (!isfinite(result[c])) {
                status = 1 + 6 * i + c;
            }
        }
    }
    return status;
}
