/* What a release waits for, in terms of the tree: the bodies know of its events only when they happened. */
#include <string.h>

#include "lw_constraints.h"

void lw_maximal_follow(lw_maximal *m, const lw_multibody *mb) {
    size_t bytes = (size_t)mb->events * sizeof(double);
    if (memcmp(m->tree->happened, mb->happened, bytes)) lw_modes(m->tree, mb->happened);
}

/* The link that a joint of the tree carries. */
static int32_t carried(const lw_multibody *tree, int32_t body) {
    int32_t i = 0;
    while (tree->link[i].body != body) ++i;
    return i;
}

static double coordinate(lw_maximal *m, const lw_multibody *mb, const lw_event *e, const double *q) {
    const lw_link *joint = &m->tree->link[carried(m->tree, e->joint)];
    lw_joint_coordinates(m, mb, q);
    if (joint->type != joint->built) return NAN; /* another event was first: this one will not be */
    return e->occasion == LW_ON_POSITION ? m->q[joint->q] : m->v[joint->v];
}

static lw_vec3 point(const lw_multibody *mb, int32_t link, lw_vec3 on_body) {
    if (link < 0) return on_body;
    return lw_add(mb->link[link].position, lw_mat_vec(mb->link[link].rotation, on_body));
}

static double distance(const lw_maximal *m, const lw_multibody *mb, const lw_event *e) {
    const lw_multibody *tree = m->tree;
    if (e->joint >= tree->n) {
        const lw_closure *c = &tree->closure[e->joint - tree->n];
        return lw_norm(lw_sub(point(mb, c->link[1], c->point[1]), point(mb, c->link[0], c->point[0])));
    }
    int32_t i = carried(tree, e->joint);
    const lw_link *joint = &tree->link[i];
    return lw_norm(lw_sub(point(mb, i, joint->child_point), point(mb, joint->parent, joint->parent_point)));
}

static double reaction(const lw_maximal *m, const lw_multibody *mb, const lw_event *e) {
    const lw_multibody *tree = m->tree;
    lw_spatial f = e->joint < tree->n ? lw_joint_reaction(&mb->link[carried(tree, e->joint)])
                                      : lw_maximal_closure_reaction(m, mb, e->joint - tree->n);
    return lw_norm(e->occasion == LW_ON_FORCE ? f.linear : f.angular);
}

double lw_maximal_occasion(lw_multibody *mb, int32_t event, const double *y, double time) {
    lw_maximal *m = (lw_maximal *)mb->formulation;
    const lw_event *e = &m->tree->event[event];
    lw_maximal_follow(m, mb);
    switch (e->occasion) {
    case LW_ON_POSITION:
    case LW_ON_SPEED: return coordinate(m, mb, e, y);
    case LW_ON_DISTANCE: return distance(m, mb, e);
    case LW_ON_FORCE:
    case LW_ON_TORQUE: return reaction(m, mb, e);
    default: return time;
    }
}
