#include "lw_field.h"

#include "lw_expression.h"

static const double two_pi = 6.283185307179586476925286766559;

/* Heading of the body's x axis about world z, on the branch nearest to the reference. The first column
 * of the rotation matrix is taken unnormalised, so that the quaternion's length does not matter. */
static double heading(const lw_unaligned *q, double reference) {
    const double c = q[0] * q[0] + q[1] * q[1] - q[2] * q[2] - q[3] * q[3];
    const double s = 2.0 * (q[1] * q[2] + q[0] * q[3]);
    const double angle = atan2(s, c);
    return angle + two_pi * floor((reference - angle) / two_pi + 0.5);
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
        lw_expression_run(field->code + 2 * field->start[i], field->code + 2 * field->start[i + 1],
                          field->constants, variables, result);
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
