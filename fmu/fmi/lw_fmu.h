/* What one FMU is made of, besides code: the constants that the export writes as lw_fmu_data.c.
 *
 * All Float64 values of an instance lie in one array. It is a sequence of sections, in the order of the
 * list of the part that is compiled in; rows lie body by body. Everything before the first calculated
 * section is set from outside or integrated, the rest is computed from it.
 *
 * Doubles are written as hexadecimal constants, so that their bits survive. Where there is nothing to
 * write (no gusts, a field without constants), an array has one zero, because C has no empty arrays.
 */
#ifndef LW_FMU_H
#define LW_FMU_H

#include <stdint.h>

/* X(name, number of values), with n bodies, nq coordinates and nv degrees of freedom. Frames and units are
 * those of lw_multibody.h; reactions act from parent on child at the joint's point on the child. */
#define LW_DYNAMICS_KNOWN(X)                                                                             \
    X(MASS, n) X(INERTIA, 6 * n) X(PARENT_POINT, 3 * n) X(CHILD_POINT, 3 * n) X(GRAVITY, 3)              \
    X(STIFFNESS, nv) X(DAMPING, nv) X(REST, nq) X(FORCE_NUMBER, 3 * lw_fmu_forces) X(RTOL, 1) X(ATOL, 1) \
    X(FORCE, 3 * n) X(TORQUE, 3 * n) X(FORCE_INPUT, lw_fmu_inputs) X(ADDED_INERTIA, 36 * n)              \
    X(EVENT_COMMAND, lw_fmu_events)                                                                      \
    X(Q, nq) X(V, nv)
#define LW_DYNAMICS_CALCULATED(X)                                                                        \
    X(DER_Q, nq) X(DER_V, nv)                                                                            \
    X(POSITION, 3 * n) X(ORIENTATION, 4 * n) X(LINEAR, 3 * n) X(ANGULAR, 3 * n)                          \
    X(LINEAR_ACCELERATION, 3 * n) X(ANGULAR_ACCELERATION, 3 * n)                                         \
    X(REACTION_FORCE, 3 * n) X(REACTION_TORQUE, 3 * n)                                                   \
    X(CLOSURE_FORCE, 3 * lw_fmu_closures) X(CLOSURE_TORQUE, 3 * lw_fmu_closures)                         \
    X(EVENT_TIME, lw_fmu_events) X(EVENT_INDICATOR, lw_fmu_events)                                       \
    X(FORCE_EFFORT, lw_fmu_forces) X(FORCE_POWER, lw_fmu_forces)                                         \
    X(KINETIC_ENERGY, 1) X(POTENTIAL_ENERGY, 1)

/* A field leaves density, wind, its inputs, length and span unused (no variable refers to them). */
#define LW_AERO_KNOWN(X)                                                                                 \
    X(DENSITY, 1) X(WIND, 3) X(LENGTH, n) X(SPAN, n)                                                     \
    X(POSITION, 3 * n) X(ORIENTATION, 4 * n) X(LINEAR, 3 * n) X(ANGULAR, 3 * n)                          \
    X(WIND_INPUT, lw_fmu_wind_inputs)
#define LW_AERO_CALCULATED(X) X(FORCE, 3 * n) X(TORQUE, 3 * n) X(ADDED_INERTIA, 36 * n)

/* A section's number counts from 0 within its part: LW_DYNAMICS_MASS = 0 ..., LW_AERO_DENSITY = 0 ... */
#define LW_ENUMERATE_DYNAMICS(name, size) LW_DYNAMICS_##name,
#define LW_ENUMERATE_AERO(name, size) LW_AERO_##name,
enum {
    LW_DYNAMICS_KNOWN(LW_ENUMERATE_DYNAMICS) LW_DYNAMICS_CALCULATED(LW_ENUMERATE_DYNAMICS)
    LW_DYNAMICS_SECTIONS
};
enum { LW_AERO_KNOWN(LW_ENUMERATE_AERO) LW_AERO_CALCULATED(LW_ENUMERATE_AERO) LW_AERO_SECTIONS };

enum { LW_TYPE_TIME, LW_TYPE_FLOAT64, LW_TYPE_INT32, LW_TYPE_BOOLEAN }; /* Booleans lie among the Float64, 0 or 1 */
enum { LW_INTEGRATOR, LW_SUBSTEPS, LW_INTEGERS }; /* the Int32 values, an array of their own */

/* When a variable may be set: fixed parameters and start values of states until the end of initialisation,
 * tunable parameters also between steps (Model Exchange: in events), inputs always; discrete ones count from the
 * next step or event on (the standards would have them set in events; importers do so at any time). */
enum {
    LW_FIXED_PARAMETER, LW_TUNABLE_PARAMETER, LW_INPUT, LW_DISCRETE_INPUT, LW_STATE, LW_CALCULATED, LW_INDEPENDENT
};

typedef struct {
    const char *name;  /* as in modelDescription.xml, for messages */
    uint8_t type;      /* LW_TYPE_... */
    uint8_t causality; /* LW_FIXED_PARAMETER ... */
    uint16_t section;  /* LW_DYNAMICS_... or LW_AERO_...; of an Int32 and of time 0 */
    uint32_t offset;   /* of its first value in the whole array of its type */
    uint32_t size;     /* number of values, row-major; 1 for a scalar and for all variables of FMI 2 */
} lw_fmu_variable;

/* ---- every part ---- */
extern const char lw_fmu_token[]; /* GUID or instantiationToken */
extern const char lw_fmu_model_name[];
extern const lw_fmu_variable lw_fmu_variables[]; /* index: value reference; 0 is time */
extern const uint32_t lw_fmu_variable_count;
extern const double lw_fmu_start[];   /* of all Float64 values; zero in calculated sections */
extern const uint32_t lw_fmu_value_count;
extern const int32_t lw_fmu_integers[LW_INTEGERS]; /* start of the Int32 values; zeros in aero */
extern const int32_t lw_fmu_n, lw_fmu_nq, lw_fmu_nv; /* in aero nq = nv = 0 */

/* ---- dynamics: what of lw_tables is no parameter ---- */
extern const int32_t lw_fmu_parent[], lw_fmu_order[], lw_fmu_joint_type[], lw_fmu_q_index[], lw_fmu_v_index[];
extern const double lw_fmu_parent_rotation[], lw_fmu_child_rotation[];
extern const int32_t lw_fmu_closures, lw_fmu_closure_body[], lw_fmu_closure_rows[];
extern const int32_t lw_fmu_events, lw_fmu_event_joint[], lw_fmu_event_action[], lw_fmu_event_occasion[];
extern const int32_t lw_fmu_event_side[];
extern const double lw_fmu_event_threshold[], lw_fmu_event_restitution[];
extern const double lw_fmu_closure_point[], lw_fmu_closure_rotation[], lw_fmu_closure_length[];
extern const int32_t lw_fmu_forces, lw_fmu_force_type[], lw_fmu_force_body[];
extern const double lw_fmu_force_point[];
extern const int32_t lw_fmu_instructions, lw_fmu_constants, lw_fmu_force_start[], lw_fmu_force_code[];
extern const double lw_fmu_force_constants[];
extern const int32_t lw_fmu_inputs, lw_fmu_force_input[];

/* ---- aero ---- */
enum { LW_AERO_PLATE, LW_AERO_FIELD };
extern const int32_t lw_fmu_aero_model;
extern const int32_t lw_fmu_coefficients; /* LW_PLATE_... */
extern const int32_t lw_fmu_strips, lw_fmu_curve_size;
extern const double lw_fmu_curves[];      /* (3, curve_size) as lw_plate.h */
extern const int32_t lw_fmu_planform_size;
extern const double lw_fmu_planform[];    /* (n, strips, 3) as lw_plate.h, or none */
extern const int32_t lw_fmu_gust_count;
extern const double lw_fmu_gusts[];       /* (gust_count, 9) as lw_wind.h */
extern const int32_t lw_fmu_wind_instructions;
extern const int32_t lw_fmu_wind_code[];  /* (wind_instructions, 2) as lw_wind.h */
extern const double lw_fmu_wind_constants[]; /* (wind_constant_count), the first wind_inputs of them inputs */
extern const int32_t lw_fmu_wind_constant_count, lw_fmu_wind_inputs;
extern const int32_t lw_fmu_field_start[]; /* (n + 1) as lw_field.h; the bodies are 0 ... n - 1 */
extern const int32_t lw_fmu_field_code[];
extern const double lw_fmu_field_constants[];
extern const double lw_fmu_theta[];        /* (n) headings [rad] that a field unwraps against at first */

#endif
