/* The mechanism in memory, for the files of this folder. */
#ifndef LW_MODEL_H
#define LW_MODEL_H

#include "lw_expression.h"
#include "lw_linear.h"
#include "lw_multibody.h"

typedef struct { lw_vec3 linear, angular; } lw_spatial; /* twist, acceleration, or (force, torque) */

/* Symmetric 6x6 inertia [[m, h], [hᵀ, j]]: force = m a + h α, torque = hᵀ a + j α. */
typedef struct {
    lw_sym3 m, j;
    lw_mat3 h;
} lw_inertia6;

/* One degree of freedom of a joint: its motion vector s, and what its elimination leaves behind. */
typedef struct {
    lw_spatial s;           /* motion of the child's COM per unit of velocity, in W */
    lw_spatial u;           /* articulated inertia times s */
    double force, inverse;  /* net generalised force; 1 / (s . u), or 0 where the acceleration is given */
    double given, effort;   /* that; the force that it takes */
} lw_column;

/* A body, and the joint that carries it. */
typedef struct {
    /* constant */
    int32_t body, parent; /* row of the tables; link of the parent, -1 = world */
    int32_t type, q, v, translations;
    int32_t freedoms, columns; /* of the type; of them those that are not locked */
    int32_t built, built_sprung, built_damped; /* as at first */
    int32_t parent_rotated, child_rotated, sprung, damped, driven;
    int32_t prescribed; /* bits: columns whose acceleration is given */
    lw_vec3 parent_point, child_point, axis; /* axis: the joint's z in the parent's body frame */
    lw_quat parent_quat, child_quat_inverse;
    lw_mat3 parent_matrix, child_matrix;
    double mass;
    lw_sym3 inertia;
    const double *added; /* of the present evaluation, NULL if there is none or it is zero */
    /* kinematics, in W */
    lw_quat orientation;
    lw_mat3 rotation;
    lw_vec3 position, offset, arm; /* COM; COM from the parent's COM; COM from the joint's point */
    lw_spatial velocity, bias;     /* bias: acceleration that is left with zero parent and joint ones */
    /* dynamics, in W at the COM */
    lw_inertia6 articulated;
    lw_spatial bias_force; /* reaction of the joint for zero acceleration */
    lw_spatial acceleration;
    double mass_scale, inertia_scale; /* size of the terms that a pivot is the difference of */
    lw_column column[6];
} lw_link;

/* A closure of the tree: joint between two bodies that have their places in it already. */
typedef struct {
    int32_t kept, row, rows; /* bits of the table; its first row among all, their number */
    int32_t released;
    int32_t link[2];         /* -1 = world */
    int32_t *path;           /* links that it moves, leaves first: from link[0] and link[1] to where they meet,
                                and from there to the root */
    int32_t count[3], links; /* of each of the three ways, and of all */
    lw_vec3 point[2];
    lw_mat3 rotation[2];
    double length;
} lw_closure;

typedef struct {
    int32_t joint, action, occasion;
    double side, threshold, restitution;
} lw_event;

/* One scalar equation value(q) = 0 of a closure: rate = on . twists, and rate' = on . accelerations + drift. */
typedef struct {
    lw_spatial on[2]; /* force and torque at the COMs, for a multiplier of 1 */
    double value, rate, drift;
    int32_t envelope; /* first row that a link is shared with */
} lw_row;

/* A force element, and what it does at the present evaluation. */
typedef struct {
    int32_t type, link[2], coordinate; /* -1 = world */
    lw_vec3 point[2];
    double number[3];
    const int32_t *code, *end;
    lw_jet motion; /* at the present time */
    double effort, power; /* as lw_evaluation */
    double supplied, dissipated; /* of the power: without what is in an energy; taken by its damper [W] */
} lw_element;

enum { LW_MAX_STAGES = 7 };

/* Another way to the accelerations than articulated bodies: see ../baselines. */
typedef struct {
    int (*accelerations)(lw_multibody *multibody, const double *q, const double *v, const double *wrench,
                         double *joint_acceleration, lw_fault *fault);
    int (*settle)(lw_multibody *multibody, double *q, double *v, lw_fault *fault); /* after every substep */
    double (*spring_energy)(const lw_multibody *multibody, const double *q);
    double (*damper_power)(const lw_multibody *multibody, const double *v);
    lw_multibody *tree; /* its joints, with their actuators */
    double (*occasion)(lw_multibody *multibody, int32_t event, const double *y, double time); /* seen from it */
    void (*closure_reactions)(const lw_multibody *multibody, double *reaction); /* at the last evaluation */
    void (*coordinates)(lw_multibody *multibody, const double *state, lw_unaligned *q, lw_unaligned *v); /* of it */
} lw_formulation;

struct lw_multibody {
    int32_t n, nq, nv;
    lw_formulation *formulation; /* NULL: articulated bodies */
    lw_vec3 gravity;
    lw_link *link; /* n, in topological order */
    double *stiffness, *damping, *rest;
    int32_t forces;
    double time; /* of the present evaluation [s] */
    int32_t *code;     /* programs of force elements, and what they push */
    double *constants;
    int32_t inputs, *input; /* (inputs) which of the constants they are */
    double *given;          /* (inputs) room */
    lw_element *element; /* forces */
    lw_spatial *load;    /* n: force and torque of all elements on each link, in W at the COM */
    int32_t closures, rows, events;
    lw_event *event;   /* events */
    double *happened, *indicator; /* (events) of the state; how far they are from happening */
    double *before;    /* q, v, work, dissipated at the start of a substep */
    double *loaded, *closure_load; /* (n,6), (closures,6): wrench with the forces of closures, these alone */
    lw_closure *closure; /* closures */
    lw_row *row;         /* rows */
    double *spread;      /* (rows,nv) generalised force of each row at each column, as eliminated */
    double *delassus, *factor; /* (rows,rows), lower halves, scaled: acceleration of row i by force of row j */
    double *row_scale, *multiplier, *right, *correction; /* (rows) */
    double *wrench;                 /* (n,6) at the time of a stage */
    double *y, *trial, *rate[LW_MAX_STAGES]; /* q, v, work, dissipated: state, stage, derivatives */
};

/* lw_model.c: of a joint type; the link that carries a body, -1 for the world */
int lw_joint_translations(int joint_type);
int32_t lw_link_of(const lw_multibody *multibody, int32_t body);
/* lw_tables.c */
int lw_tables_check(const lw_tables *tables, lw_fault *fault);
/* lw_kinematics.c: poses, velocities, motion vectors and bias accelerations of all links. */
void lw_kinematics(lw_multibody *multibody, const double *q, const double *v);
/* lw_closures.c: equations of all closures after lw_kinematics; forces of their multipliers, added to wrench
 * (n,6), on the second bodies at their points as reaction (closures,6). */
void lw_closures_build(lw_multibody *multibody, const lw_tables *tables);
void lw_closure_equations(lw_multibody *multibody);
void lw_multibody_closure_values(lw_multibody *multibody, const double *state);
void lw_closure_forces(const lw_multibody *multibody, double *wrench, double *reaction);
double lw_closure_gap(const lw_multibody *multibody, const lw_closure *closure, const lw_unaligned *position,
                      const lw_unaligned *orientation);
/* lw_delassus.c, after the elimination of lw_dynamics.c: what the rows' forces do to the rows; multipliers for
 * `right`, the wanted change of each row; the joints' answer to them; accelerations that keep the closures. */
void lw_delassus_factor(lw_multibody *multibody);
void lw_delassus_solve(lw_multibody *multibody);
void lw_delassus_respond(lw_multibody *multibody, double *joint_velocity);
void lw_delassus_close(lw_multibody *multibody, double *joint_acceleration);
/* lw_projection.c: q and v moved onto the closures; v alone. */
int lw_project(lw_multibody *multibody, double *q, double *v, lw_fault *fault);
int lw_allow(lw_multibody *multibody, const double *q, double *v, lw_fault *fault);
/* lw_events.c: take the joints for what the events of a state have made of them; whether any may still happen;
 * whether one happens at y; let all of those happen. */
void lw_events_build(lw_multibody *multibody, const lw_tables *tables);
void lw_modes(lw_multibody *multibody, const double *happened);
int lw_events_due(lw_multibody *multibody, const double *y, double time, const double *wrench, int *due,
                  lw_fault *fault);
int lw_events_happen(lw_multibody *multibody, double *y, double time, double h, double slack,
                     const double *wrench, lw_fault *fault);
/* lw_impulse.c: v without what a joint may no longer do, by impulses. */
int lw_stop_joint(lw_multibody *multibody, const double *q, double *v, lw_link *stopped, lw_fault *fault);
/* lw_dynamics.c: accelerations, then forces in the joints of the tree and in closures. */
int lw_loaded_accelerations(lw_multibody *multibody, const double *q, const double *v, const double *wrench,
                            double *joint_acceleration, double *closure_load, lw_fault *fault);
lw_spatial lw_joint_reaction(const lw_link *link);
int lw_impulse_response(lw_multibody *multibody, const double *wrench, double *joint_velocity, lw_fault *fault);
/* lw_coordinates.c */
void lw_coordinate_rate(const lw_multibody *multibody, const double *q, const double *v, double *rate);
void lw_coordinate_normalise(const lw_multibody *multibody, double *q);
lw_vec3 lw_rotation_vector(lw_quat q);
/* lw_springs.c */
void lw_joint_force(const lw_multibody *multibody, const lw_link *link, const double *q, const double *v,
                    double *force);
double lw_spring_energy(const lw_multibody *multibody, const double *q);
double lw_damper_power(const lw_multibody *multibody, const double *v);
/* lw_elements.c: set the present time, and with it what motions prescribe; put that into q and v, or into the
 * accelerations that lw_dynamics.c takes as given. */
void lw_elements_build(lw_multibody *multibody, const lw_tables *tables);
int lw_take_time(lw_multibody *multibody, double time, lw_fault *fault);
void lw_prescribe(const lw_multibody *multibody, double *q, double *v);
void lw_prescribe_accelerations(lw_multibody *multibody, int at_rest);
/* After lw_kinematics: set the loads on the bodies, of which q of a tree tells the turns; add the actuators' forces
 * to those of a joint; did these give numbers; add the power of all [W]; energy [J]. */
int lw_elements_load(lw_multibody *multibody, const lw_multibody *tree, const double *q, lw_fault *fault);
void lw_elements_drive(const lw_multibody *multibody, const lw_link *link, const double *q, const double *v,
                       double *force);
int lw_elements_check(const lw_multibody *multibody, lw_fault *fault);
void lw_elements_power(lw_multibody *multibody, double *supplied, double *dissipated);
double lw_elements_energy(const lw_multibody *multibody);
/* lw_dynamics.c: set the added inertia of the coming evaluations; accelerations; power of the wrench. */
void lw_bind_added(lw_multibody *multibody, const double *added_inertia);
int lw_tree_accelerations(lw_multibody *multibody, const double *q, const double *v, const double *wrench,
                          double *joint_acceleration, lw_fault *fault);
void lw_outward(lw_multibody *multibody, int with_bias, double *joint_acceleration);
int lw_accelerations(lw_multibody *multibody, const double *q, const double *v, const double *wrench,
                     double *joint_acceleration, lw_fault *fault);
lw_spatial lw_total_wrench(const lw_link *link, const double *wrench);
double lw_wrench_power(const lw_multibody *multibody, const double *wrench);
/* lw_inputs.c: index of the first number that is not finite, or -1; the inputs of a call */
int lw_first_not_finite(const double *values, int count);
int lw_inputs_check(const lw_multibody *multibody, const double *state, int32_t count,
                    const double *wrenches, const double *added_inertia, lw_fault *fault);

#endif
