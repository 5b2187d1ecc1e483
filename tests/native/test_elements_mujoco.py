"""Springs between points, and actuators, are MuJoCo's spatial tendons and motors."""

import dataclasses

import numpy as np
import pytest

from linkwind.native.multibody import FORCE_TYPES, Multibody
from tests.native.mechanisms import Body, random_inertia, random_state, tables

mujoco = pytest.importorskip("mujoco")


def text(values) -> str:
    return " ".join(repr(float(x)) for x in np.ravel(values))


def chain(rng):
    """Three bodies on hinges about z, joint frames parallel to the bodies."""
    points = rng.normal(size=(3, 2, 3)) * 0.4
    return [Body(i - 1, "revolute", rng.uniform(0.5, 2.0), random_inertia(rng), *points[i]) for i in range(3)]


def mjcf(bodies, ends, points, numbers, gear) -> str:
    """A body of MuJoCo has its origin at the joint, so that places move by the joint's point on the child."""

    def site(k):
        origin = bodies[ends[k]].child_point if ends[k] >= 0 else np.zeros(3)
        return f'<site name="s{k}" pos="{text(points[k] - origin)}"/>'

    def body(i):
        b = bodies[i]
        at = np.array(b.parent_point) - (bodies[b.parent].child_point if b.parent >= 0 else 0.0)
        inertia = b.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        inner = "".join(site(k) for k in range(2) if ends[k] == i) + (body(i + 1) if i < 2 else "")
        return (
            f'<body pos="{text(at)}"><inertial pos="{text(-np.array(b.child_point))}" mass="{b.mass!r}" '
            f'fullinertia="{text(inertia)}"/><joint name="j{i}" type="hinge" axis="0 0 1"/>{inner}</body>'
        )

    world = "".join(site(k) for k in range(2) if ends[k] < 0)
    k, c, rest = numbers
    return (
        f'<mujoco><option gravity="0 -9.81 0"/><worldbody>{world}{body(0)}</worldbody><tendon>'
        f'<spatial stiffness="{k!r}" damping="{c!r}" springlength="{rest!r}">'
        '<site site="s0"/><site site="s1"/></spatial></tendon>'
        f'<actuator><motor joint="j1" gear="{gear!r}"/></actuator></mujoco>'
    )


@pytest.mark.parametrize("ends", [(0, 2), (-1, 2), (2, 0)])
def test_a_spring_is_a_spatial_tendon_and_an_actuator_a_motor(ends):
    rng = np.random.default_rng(7)
    bodies, points = chain(rng), rng.normal(size=(2, 3))
    numbers, gear = rng.uniform(0.5, 3.0, 3).tolist(), 1.7
    flat = dataclasses.replace(
        tables(bodies),
        force_type=np.array([FORCE_TYPES["spring"], FORCE_TYPES["actuator"]], np.int32),
        force_body=np.array([ends, (1, 0)], np.int32),
        force_point=np.array([points, np.zeros((2, 3))]),
        force_number=np.array([numbers, np.zeros(3)]),
        force_start=np.array([0, 0, 2], np.int32),
        force_code=np.array([(0, 0), (4, 0)], np.int32),  # push a constant, pop it into the result
        force_constants=np.array([gear * 0.8]),
    )
    core = Multibody(flat)
    state = random_state(rng, core)
    model = mujoco.MjModel.from_xml_string(mjcf(bodies, ends, points, numbers, gear))
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = state[:3], state[3:6]
    data.ctrl[0] = 0.8
    mujoco.mj_forward(model, data)
    result = core.evaluate(state, np.zeros((3, 6)))
    np.testing.assert_allclose(result.joint_acceleration, data.qacc, rtol=1e-9, atol=1e-9)
    length = data.ten_length[0]
    k, c, rest = numbers
    assert result.effort[0] == pytest.approx(k * (length - rest) + c * data.ten_velocity[0], rel=1e-12)
