/* Rigid bodies in a tree of joints: flat tables in, motion out. The equations are in fmu/README.md.
 *
 * World-aligned axes, SI units, radians, quaternions (w, x, y, z). Body i is carried by joint i. Nothing
 * is allocated here and there are no globals: the caller gives one block of memory per mechanism, and
 * one mechanism may be used by one thread at a time.
 */
#ifndef LW_MULTIBODY_H
#define LW_MULTIBODY_H

#include <stddef.h>
#include <stdint.h>

#include "lw_math.h"

typedef enum { LW_FIXED, LW_REVOLUTE, LW_PRISMATIC, LW_PLANAR, LW_SPHERICAL, LW_FREE } lw_joint_type;
enum { LW_JOINT_TYPES = 6 };

typedef enum { LW_EULER, LW_SEMI_IMPLICIT_EULER, LW_RK4, LW_DOPRI5, LW_RADAU5 } lw_integrator;

/* What a closure keeps: bits of closure_rows. Translations are along the axes of the frame on its first body,
 * rotations about them; both frames coincide where all is kept. LW_DISTANCE stands alone. */
enum {
    LW_KEEP_X = 1, LW_KEEP_Y = 2, LW_KEEP_Z = 4, LW_KEEP_TURN_X = 8, LW_KEEP_TURN_Y = 16, LW_KEEP_TURN_Z = 32,
    LW_DISTANCE = 64
};

/* What happens to a joint, once, or with stops each time that it is met. */
typedef enum {
    LW_RELEASE, /* from then on the joint, or closure, is not there */
    LW_LOCK,    /* from then on the joint keeps its coordinates */
    LW_STOP     /* its coordinate goes no further; joints with one degree of freedom */
} lw_action;

/* What an event waits for. */
typedef enum {
    LW_ON_COMMAND,  /* for its number in the state to be below -1.5 */
    LW_ON_TIME,     /* [s] */
    LW_ON_FORCE,    /* size of the joint's reaction [N] */
    LW_ON_TORQUE,   /* likewise, at the joint's point on the child [N m] */
    LW_ON_POSITION, /* coordinate of a joint with one degree of freedom [rad, m] */
    LW_ON_SPEED,    /* its rate */
    LW_ON_DISTANCE  /* between the joint's two points [m] */
} lw_occasion;

typedef enum {
    LW_SPRING,      /* between two points of two bodies; its program gives tension from length, rate, t */
    LW_ACTUATOR,    /* along a joint's coordinate; its program gives force or torque from t, q, v */
    LW_MOTION,      /* a joint's coordinate as a program of t */
    LW_POINT_FORCE, /* on a body; its program gives (fx, fy, fz, tx, ty, tz) from (t, x, y, z, vx, vy, vz, wx, wy,
                       wz, theta) of its COM */
    LW_BUOYANCY     /* on a body, at its centre of volume */
} lw_force_type;
enum { LW_FORCE_TYPES = 5 };

/* A mechanism. Joint i carries body i; q_index and v_index are explicit, so that a joint may own more
 * coordinates than its type needs. Coordinates that no joint uses keep their value. Closures are joints
 * that close loops of the tree. */
typedef struct {
    int32_t n, nq, nv, closures, events, forces, instructions, constants, inputs;
    const int32_t *parent;         /* (n) index of the parent body, -1 = world */
    const int32_t *order;          /* (n) the bodies, every parent before its children */
    const int32_t *joint_type;     /* (n) lw_joint_type */
    const int32_t *q_index;        /* (n) first coordinate of the joint in q */
    const int32_t *v_index;        /* (n) first coordinate of the joint in v */
    const double *parent_point;    /* (n,3) joint frame origin, parent's body frame, from its COM [m] */
    const double *parent_rotation; /* (n,3,3) joint frame to parent body frame */
    const double *child_point;     /* (n,3) joint frame origin, child's body frame, from its COM [m] */
    const double *child_rotation;  /* (n,3,3) joint frame to child body frame */
    const double *mass;            /* (n) [kg] */
    const double *inertia;         /* (n,6) Ixx Iyy Izz Ixy Ixz Iyz, body frame, about the COM [kg m2] */
    const double *gravity;         /* (3) [m/s2] */
    const double *stiffness;       /* (nv) [N/m, N m/rad] */
    const double *damping;         /* (nv) [N s/m, N m s/rad] */
    const double *rest;            /* (nq) configuration without spring force */
    const int32_t *closure_body;    /* (closures,2) -1 = world */
    const int32_t *closure_rows;    /* (closures) bits LW_KEEP_... or LW_DISTANCE */
    const double *closure_point;    /* (closures,2,3) on the bodies, body frame, from the COM [m] */
    const double *closure_rotation; /* (closures,2,3,3) frame to body frame */
    const double *closure_length;   /* (closures) distance [m] of LW_DISTANCE */
    const int32_t *event_joint;     /* (events) joint of a body, or n + closure */
    const int32_t *event_action;    /* (events) lw_action */
    const int32_t *event_occasion;  /* (events) lw_occasion */
    const int32_t *event_side;      /* (events) 1: as soon as at or above the threshold, -1: at or below */
    const double *event_threshold;  /* (events) */
    const double *event_restitution; /* (events) of a stop: speed after over speed before, 0 to 1 */
    const int32_t *force_type;   /* (forces) lw_force_type */
    const int32_t *force_body;   /* (forces,2) of a spring two, -1 = world; else the body, of an actuator and a
                                    motion the one that the joint carries, and the number of the coordinate */
    const double *force_point;   /* (forces,2,3) on the bodies, body frame, from the COM [m] */
    const double *force_number;  /* (forces,3) stiffness [N/m], damping [N s/m], length at rest [m] of a spring;
                                    of a point force whether it is in the body frame; volume [m3], density
                                    [kg/m3] */
    const int32_t *force_start;  /* (forces + 1) first instruction of each program, which may be empty */
    const int32_t *force_code;   /* (instructions,2) as lw_expression.h */
    const double *force_constants; /* (constants) */
    const int32_t *force_input;    /* (inputs) constants that may be set from outside: lw_multibody_set_inputs */
} lw_tables;

/* 0 is success; `lw_fault` names the item and the time. */
typedef enum {
    LW_OK = 0,
    /* numerical trouble */
    LW_SINGULAR,             /* item: body whose joint has no inertia to move */
    LW_NOT_FINITE,           /* item: body whose coordinates overflowed */
    LW_STEP_UNDERFLOW,       /* the error control asks for steps of nothing, or a million */
    LW_WRENCH_NOT_FINITE,    /* item: body */
    LW_ADDED_NOT_FINITE,     /* item: body */
    LW_STATE_NOT_FINITE,     /* item: index in the state */
    LW_RESPONSE_NOT_FINITE,  /* item: body */
    LW_NOT_CONVERGED,        /* item: body whose affine wrench is not met */
    LW_JOINT_OPEN,           /* item: body whose joint cannot be closed */
    LW_OPEN,                 /* item: closure that the mechanism cannot close */
    LW_CROWDED,              /* item: event that happens too often in a step */
    LW_NEWTON,               /* item: body whose joint Newton's method of radau5 does not converge for */
    LW_FORCE_NOT_FINITE = 13, /* item: force element whose program gives no number */
    LW_POINTS_MEET,          /* item: force element whose points coincide, so that it has no direction */
    /* arguments */
    LW_BAD_STEP = 20,
    LW_BAD_NODES,
    LW_BAD_INTEGRATOR,
    LW_BAD_SUBSTEPS,
    LW_BAD_TOLERANCE,
    /* tables, named like the field; item: its row, of a spring's or damper's table its coordinate */
    LW_BAD_COUNT = 40,
    LW_BAD_PARENT,
    LW_BAD_ORDER,
    LW_BAD_JOINT_TYPE,
    LW_BAD_Q_INDEX,
    LW_BAD_V_INDEX,
    LW_BAD_PARENT_POINT,
    LW_BAD_PARENT_ROTATION,
    LW_BAD_CHILD_POINT,
    LW_BAD_CHILD_ROTATION,
    LW_BAD_MASS,
    LW_BAD_INERTIA,
    LW_BAD_GRAVITY,
    LW_BAD_STIFFNESS,
    LW_BAD_DAMPING,
    LW_BAD_REST,
    LW_BAD_CLOSURE_BODY,
    LW_BAD_CLOSURE_ROWS,
    LW_BAD_CLOSURE_POINT,
    LW_BAD_CLOSURE_ROTATION,
    LW_BAD_CLOSURE_LENGTH,
    LW_BAD_EVENT_JOINT,
    LW_BAD_EVENT_ACTION,
    LW_BAD_EVENT_OCCASION,
    LW_BAD_EVENT_SIDE,
    LW_BAD_EVENT_THRESHOLD,
    LW_BAD_EVENT_RESTITUTION,
    LW_BAD_FORCE_TYPE = 70,
    LW_BAD_FORCE_BODY,
    LW_BAD_FORCE_POINT,
    LW_BAD_FORCE_NUMBER,
    LW_BAD_FORCE_START,
    LW_BAD_FORCE_INPUT
} lw_status;

typedef struct {
    int32_t item;
    double time; /* within the macro step [s] */
} lw_fault;

typedef struct lw_multibody lw_multibody;

/* Number of coordinates of a joint type in q and in v; -1 for an unknown type. */
LW_API int lw_joint_nq(int joint_type);
LW_API int lw_joint_nv(int joint_type);

/* Bytes that a mechanism needs, 8-byte alignment; reads the counts and closure_rows. */
LW_API size_t lw_multibody_size(const lw_tables *tables);

/* Check the tables and build the mechanism in `memory`; the tables may go afterwards. */
LW_API int lw_multibody_init(lw_multibody *memory, const lw_tables *tables, lw_fault *fault);

/* A state is nq + nv + 1 + events numbers: q, v, the substep [s] that dopri5 would take next (0 = not known), and
 * for each event when it happened [s], or -1; for a stop since when its joint has rested on it. A joint that may
 * be released needs room in q and v for a free one. */

/* One macro step. */
typedef struct {
    const double *state;         /* at its start */
    double h, time;              /* its length, time at its start [s] */
    const double *nodes;         /* (count) in units of h from its start */
    const double *wrenches;      /* (count,n,6) force, torque in W at the COM: the wrench is the polynomial
                                    through these values at the nodes */
    const double *added_inertia; /* (n,6,6) body frame at the COM, symmetric positive semi-definite, force
                                    first: the force -A a is added to the wrench; or NULL */
    double rtol, atol;           /* of dopri5, on every coordinate and velocity */
    int32_t count, integrator, substeps;
    double *next;                /* out: state at its end; may be the memory of `state` */
    double *work;                /* out (2): work of the whole wrench on the bodies, energy taken by the
                                    joint dampers and by events [J] */
    lw_fault *fault;             /* out, if the status is not 0 */
    double *memory;              /* lw_radau5_size(nq,nv) doubles of the caller's, for the time of the call; or
                                    NULL, for all integrators but radau5 */
    const double *inputs;        /* (count,inputs) of force elements, at the nodes, as the wrench; or NULL: as they
                                    were set last */
} lw_macro_step;

LW_API size_t lw_radau5_size(int32_t nq, int32_t nv);

/* Set the inputs of force elements, values (inputs); at first they are the constants of the tables. */
LW_API void lw_multibody_set_inputs(lw_multibody *multibody, const double *values);

LW_API int lw_multibody_advance(lw_multibody *multibody, const lw_macro_step *step);

/* A wrench that is affine in the twist at the end of the step: the newest wrench of the step (its first) is
 * meant for the twist `about`, and is less by G (twist - about) for the one that comes out. */
typedef struct {
    const double *response; /* (6n,6n) G, in W: rows force, torque; columns linear, angular of every body */
    const double *about;    /* (n,6) twist, linear first, in W */
    double *wrench;         /* out (n,6): newest wrench at the twist that came out */
    double *held, *inertia; /* out (n,6), (n,6,6): newest wrench and added inertia (body frame) that the step
                               was integrated with, which amount to the same */
    double *memory;         /* lw_affine_size(n) doubles of the caller's, for the time of the call */
} lw_affine;

LW_API size_t lw_affine_size(int32_t n);

/* A macro step under an affine wrench; `next` must not be the memory of `state`. A wrench held over the step
 * (one node) may act on massless bodies: the bodies' own blocks of G then count as added inertia. */
LW_API int lw_multibody_advance_affine(lw_multibody *multibody, const lw_macro_step *step,
                                       const lw_affine *affine);

/* The added inertia (n,6,6), body frame, that the bodies' own blocks of G amount to over a step of h [s], on top
 * of `added_inertia` or NULL. */
LW_API void lw_affine_inertia(lw_multibody *multibody, const double *state, const double *added_inertia,
                              const double *response, double h, double *inertia);

/* Poses and twists of the bodies: position (n,3), orientation (n,4), linear (n,3), angular (n,3), in W. */
LW_API void lw_multibody_motion(lw_multibody *multibody, const double *state, lw_unaligned *position,
                                lw_unaligned *orientation, lw_unaligned *linear, lw_unaligned *angular);

/* Accelerations and forces under `wrench` (n,6). */
typedef struct {
    double *joint_acceleration; /* (nv) */
    double *acceleration;       /* (n,6) linear first */
    double *reaction;           /* (n,6) of parent on child at the joint's point on the child */
    double *total_wrench;       /* (n,6) */
    double *effort, *power;     /* (forces) tension, size of the force, force or torque along the coordinate; what
                                   it gives to the bodies [W] */
    double *closure_reaction;   /* (closures,6) of the first on the second body at the point on the second */
} lw_evaluation;

/* At a state, at `time` [s]. */
LW_API int lw_multibody_evaluate(lw_multibody *multibody, const double *state, double time, const double *wrench,
                                 const double *added_inertia, const lw_evaluation *evaluation,
                                 lw_fault *fault);

/* Numbers of an accepted state. */
typedef struct {
    double kinetic, potential; /* as lw_multibody_energy [J] */
    double gap;                /* as lw_multibody_joint_gap [m] */
    double force;              /* largest of total_wrench [N] */
    double missed;             /* accepted minus trial twist, squared, by mass and mean principal inertia [J] */
    double lost;               /* power of the wrench on that difference [W] */
} lw_measures;

/* An accepted state as it is written: evaluated once, and put where the caller wants it. */
typedef struct {
    const double *state, *trial; /* trial: the state that the wrench was asked for */
    double time;                 /* [s] */
    const double *wrench, *added_inertia; /* as lw_multibody_evaluate */
    lw_evaluation evaluation;    /* room for it */
    double *difference;          /* (n,6) room */
    int32_t closures;            /* of `closure_reaction` */
    lw_unaligned *position, *orientation, *linear, *angular; /* out, as lw_multibody_motion */
    lw_unaligned *q, *v;         /* out: of the joints of the mechanism */
    lw_unaligned *acceleration, *reaction, *total_wrench, *closure_reaction, *effort, *power; /* out */
    lw_unaligned *event_time;    /* out (events) */
    lw_measures *measures;       /* out */
    lw_fault *fault;
} lw_point;

LW_API int lw_multibody_point(lw_multibody *multibody, const lw_point *point);

/* Put the coordinates (in place) that motions prescribe to what they are at `time` [s], and their rates. */
LW_API int lw_multibody_prescribe(lw_multibody *multibody, double *state, double time, lw_fault *fault);

/* Number of rows of all closures. */
LW_API int32_t lw_closure_row_count(const lw_tables *tables);

/* The closures at a state: by how much each row is violated, value (rows) [m, rad], and how it changes,
 * value' = jacobian (rows,nv) v. */
LW_API void lw_multibody_closures(lw_multibody *multibody, const double *state, double *value,
                                  double *jacobian);

/* Move a state (in place) to the nearest one, by kinetic energy, that closes all loops. */
LW_API int lw_multibody_close(lw_multibody *multibody, double *state, lw_fault *fault);

/* Kinetic and potential energy [J]; gravity counts from the origin of W, springs from their rest. */
LW_API void lw_multibody_energy(lw_multibody *multibody, const double *state, double *kinetic,
                                double *potential);

/* Let those happen at a state (in place), at `time` [s], whose indicators are not below -slack. */
LW_API int lw_multibody_happen(lw_multibody *multibody, double *state, double time, double slack,
                               const double *wrench, const double *added_inertia, lw_fault *fault);

/* How far each event is from happening under `wrench` (n,6): values (events), at and above 0 it happens. */
LW_API int lw_multibody_indicators(lw_multibody *multibody, const double *state, double time,
                                   const double *wrench, const double *added_inertia, double *values,
                                   lw_fault *fault);

/* Largest distance [m] by which given poses violate a joint or closure. */
LW_API double lw_multibody_joint_gap(const lw_multibody *multibody, const lw_unaligned *position,
                                     const lw_unaligned *orientation);

/* Evaluate the accelerations `repeats` times under zero wrench, for benchmarks. */
LW_API int lw_multibody_repeat(lw_multibody *multibody, const double *state, int32_t repeats);

#endif
