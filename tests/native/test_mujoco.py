"""Poses, twists and accelerations of random trees are those of MuJoCo.

A body of MuJoCo is given the frame of the joint on the child, in which all our joints act along or about
the axes; a free joint is three slides and a ball, so that it may also connect two bodies.
"""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from linkwind.native.multibody import NQ, NV, Multibody
from tests.native.mechanisms import (
    AXES,
    matrix,
    motion_of,
    random_added,
    random_state,
    random_tree,
    tables,
    topological,
)

mujoco = pytest.importorskip("mujoco")
GRAVITY = (0.7, -2.1, -9.1)


def text(values) -> str:
    return " ".join(repr(float(x)) for x in np.ravel(values))


def joints_xml(index: int, joint: str) -> str:
    slides, turns = AXES[joint]
    parts = [f'<joint name="j{index}_{k}" type="slide" axis="{text(np.eye(3)[k])}"/>' for k in slides]
    if len(turns) == 3:
        return "".join([*parts, f'<joint name="j{index}_ball" type="ball"/>'])
    return "".join([*parts, *(f'<joint name="j{index}_r" type="hinge" axis="0 0 1"/>' for _ in turns)])


def body_xml(bodies, i: int) -> str:
    body = bodies[i]
    position, rotation = np.array(body.parent_point), np.array(body.parent_rotation)
    if body.parent >= 0:  # from the parent's body frame to its joint frame
        parent = bodies[body.parent]
        position = parent.child_rotation.T @ (position - parent.child_point)
        rotation = parent.child_rotation.T @ rotation
    quaternion = Rotation.from_matrix(rotation).as_quat(scalar_first=True)
    r = body.child_rotation.T
    inertia = (r @ body.inertia @ r.T)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return (
        f'<body name="b{i}" pos="{text(position)}" quat="{text(quaternion)}">'
        f'<inertial pos="{text(-r @ body.child_point)}" mass="{body.mass!r}" fullinertia="{text(inertia)}"/>'
        + joints_xml(i, body.joint)
        + "".join(body_xml(bodies, k) for k, child in enumerate(bodies) if child.parent == i)
        + "</body>"
    )


def reference(bodies):
    trees = "".join(body_xml(bodies, i) for i, body in enumerate(bodies) if body.parent < 0)
    xml = f'<mujoco><option gravity="{text(GRAVITY)}"/><worldbody>{trees}</worldbody></mujoco>'
    model = mujoco.MjModel.from_xml_string(xml)
    return model, mujoco.MjData(model)


def first_joint(model, i: int):
    return model.body_jntadr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, f"b{i}")]


def copy_state(bodies, multibody, state, model, data):
    """Set MuJoCo's coordinates; return where our velocities lie among MuJoCo's."""
    place = np.zeros(multibody.nv, int)
    for i, body in enumerate(bodies):
        if body.joint == "fixed":
            continue
        joint = first_joint(model, i)
        q, v = multibody.tables.q_index[i], multibody.tables.v_index[i]
        at, nq, nv = model.jnt_qposadr[joint], NQ[body.joint], NV[body.joint]
        data.qpos[at : at + nq] = state[q : q + nq]
        place[v : v + nv] = model.jnt_dofadr[joint] + np.arange(nv)
        model.qpos_spring[at : at + nq] = body.rest
        model.dof_damping[place[v : v + nv]] = body.damping
        springs = list(body.stiffness[: len(AXES[body.joint][0]) + (len(AXES[body.joint][1]) > 0)])
        for k, value in enumerate(springs):
            model.jnt_stiffness[joint + k] = value
    data.qvel[place] = state[multibody.nq : -1]
    return place


def body_velocity(model, data, body):
    both = np.zeros(6)
    mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, both, 0)
    return both[3:], both[:3]


@pytest.mark.parametrize("n", [1, 2, 3, 6, 7, 10, 14, 20])
@pytest.mark.parametrize("seed", range(4))
def test_random_trees(n, seed):
    rng = np.random.default_rng([n, seed])
    bodies = random_tree(rng, n, springs=True)
    for body in bodies:
        if body.joint in ("spherical", "free"):  # MuJoCo's balls have one stiffness for all axes
            body.stiffness[-3:] = body.stiffness[-3]
    multibody = Multibody(tables(bodies, GRAVITY))
    state = random_state(rng, multibody)
    wrench = rng.normal(size=(n, 6)) * 5.0
    model, data = reference(bodies)
    place = copy_state(bodies, multibody, state, model, data)
    ids = [mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, f"b{i}") for i in range(n)]
    data.xfrc_applied[ids] = wrench
    mujoco.mj_forward(model, data)

    ours = multibody.evaluate(state, wrench).joint_acceleration
    assert np.abs(ours - data.qacc[place]).max(initial=0.0) <= 1e-10 * np.abs(ours).max(initial=1.0)
    motion = motion_of(multibody, state)
    speed = 1.0 + np.abs(motion.linear).max()
    for i, body in enumerate(ids):
        np.testing.assert_allclose(motion.position[i], data.xipos[body], atol=1e-12)
        frame = matrix(motion.orientation[i]) @ bodies[i].child_rotation
        np.testing.assert_allclose(frame, data.xmat[body].reshape(3, 3), atol=1e-12)
        linear, angular = body_velocity(model, data, body)
        np.testing.assert_allclose(motion.linear[i], linear, atol=1e-12 * speed)
        np.testing.assert_allclose(motion.angular[i], angular, atol=1e-12 * speed)


def test_order_of_the_bodies_is_free():
    """The trees above do list children before parents, so that `order` is exercised."""
    listed = [topological(random_tree(np.random.default_rng([10, s]), 10)) for s in range(4)]
    assert any(order != sorted(order) for order in listed)


def test_added_inertia_is_seen():
    """The comparison can fail: with added inertia the accelerations are not MuJoCo's."""
    rng = np.random.default_rng(5)
    bodies = random_tree(rng, 6)
    multibody = Multibody(tables(bodies, GRAVITY))
    state, wrench = random_state(rng, multibody), np.zeros((6, 6))
    with_added = multibody.evaluate(state, wrench, random_added(rng, 6)).joint_acceleration
    without = multibody.evaluate(state, wrench).joint_acceleration
    assert np.abs(with_added - without).max() > 1e-3
