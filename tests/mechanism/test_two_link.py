"""The planar pair: coordinates, tables and start against the paper's kinematics."""

import math

import numpy as np
import pytest

from linkwind.mechanism import build
from linkwind.native.multibody import JOINT_TYPES, Multibody
from linkwind.scenario import load
from linkwind.spatial import Motion

LC = 0.25
STARTS = {
    # hinge x, y; hinge velocity; angles; rates
    "two_link": ((0.0, 0.0), (0.0, 0.0), (math.radians(200), math.radians(-20)), (0.0, 0.0)),
    "two_link_field": (None, None, (math.pi - 0.3, 0.3), (0.6, -0.4)),
    "two_link_gust": (None, None, (math.pi - 0.3, 0.3), (0.6, -0.4)),
}


def motion_of(mechanism):
    multibody = Multibody(mechanism.tables)
    motion = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(mechanism.q0, mechanism.v0), motion)
    return motion


@pytest.mark.parametrize("name", STARTS)
def test_start_of_the_hinged_pair(name):
    hinge, hinge_velocity, theta, omega = STARTS[name]
    e = [np.array([math.cos(angle), math.sin(angle)]) for angle in theta]
    n = [np.array([-math.sin(angle), math.cos(angle)]) for angle in theta]
    if hinge is None:  # the paper's start: C1 at the origin
        hinge, hinge_velocity = -LC * e[0], np.array([-0.5, 0.2]) - LC * omega[0] * n[0]
    mechanism = build(load(name))
    motion = motion_of(mechanism)
    for b in range(2):
        np.testing.assert_allclose(motion.position[b, :2], hinge + LC * e[b], atol=1e-15)
        np.testing.assert_allclose(motion.linear[b, :2], hinge_velocity + LC * omega[b] * n[b], atol=1e-15)
        quaternion = [math.cos(theta[b] / 2), 0, 0, math.sin(theta[b] / 2)]
        np.testing.assert_allclose(motion.orientation[b], quaternion, atol=1e-15)
        np.testing.assert_allclose(motion.angular[b], [0, 0, omega[b]], atol=1e-15)
    c1 = hinge + LC * e[0]
    np.testing.assert_allclose(mechanism.q0, [*c1, theta[0], theta[1] - theta[0]], atol=1e-15)
    c1_velocity = hinge_velocity + LC * omega[0] * n[0]
    np.testing.assert_allclose(mechanism.v0, [*c1_velocity, omega[0], omega[1] - omega[0]], atol=1e-15)
    if name == "two_link":
        assert mechanism.joints == ("world-link1", "hinge")
        assert mechanism.q0[3] == math.radians(-20) - math.radians(200)  # unwrapped, -220°


def test_the_free_pair_has_the_coordinates_of_its_centres_of_mass():
    scenario = load("two_link_free", ["bodies.1.velocity=[1, 2]", "bodies.1.angular_velocity=3"])
    mechanism = build(scenario)
    assert mechanism.joints == ("world-link1", "world-link2")
    assert not mechanism.has_joints
    assert mechanism.q0.tolist() == [  # exactly
        *scenario.bodies[0].position[:2], math.radians(200),
        *scenario.bodies[1].position[:2], math.radians(-20),
    ]  # fmt: skip
    assert mechanism.v0.tolist() == [0, 0, 0, 1, 2, 3]


def test_tables_of_two_link():
    mechanism = build(load("two_link"))
    tables = mechanism.tables
    assert mechanism.bodies == ("link1", "link2")
    assert mechanism.has_joints
    assert tables.parent.tolist() == [-1, 0]
    assert tables.order.tolist() == [0, 1]
    assert tables.joint_type.tolist() == [JOINT_TYPES["planar"], JOINT_TYPES["revolute"]]
    assert (tables.q_index.tolist(), tables.v_index.tolist()) == ([0, 3], [0, 3])
    assert tables.parent_point.tolist() == tables.child_point.tolist() == [[0, 0, 0], [-0.25, 0, 0]]
    for rotations in (tables.parent_rotation, tables.child_rotation):
        assert (rotations == np.eye(3)).all()  # exactly
    assert tables.mass.tolist() == [2.0, 2.0]
    assert tables.gravity.tolist() == [0, -9.81, 0]
    for row in tables.inertia:
        xx, yy, zz = row[:3]
        assert zz == 1.4
        assert xx > 0
        assert yy > 0
        assert xx + yy == zz  # a lamina in the plane
        assert not row[3:].any()
    for key in ("parent", "order", "joint_type", "q_index", "v_index"):
        assert getattr(tables, key).dtype == np.int32
    for key in ("stiffness", "damping", "rest"):
        assert getattr(tables, key).tolist() == [0, 0, 0, 0]


def test_angles_are_unwrapped_as_the_scenario_writes_them():
    mechanism = build(load("two_link", ["bodies.0.angle_deg=560", "bodies.1.angle_deg=-740"]))
    assert mechanism.q0[2] == math.radians(560)
    assert mechanism.q0[3] == math.radians(-740) - math.radians(560)


def test_a_child_that_states_nothing_is_parallel_to_its_parent_and_at_rest_on_it():
    text = ["bodies.1={ name = 'link2', mass = 1, inertia = 1 }", "bodies.0.angular_velocity=2"]
    mechanism = build(load("two_link", [*text, "aero.model=none"]))
    assert mechanism.q0[3] == 0.0
    assert mechanism.v0[3] == 0.0
    motion = motion_of(mechanism)
    np.testing.assert_array_equal(motion.angular[1], [0, 0, 2])
    np.testing.assert_allclose(motion.orientation[1], motion.orientation[0], atol=1e-15)


def test_an_orientation_about_z_gives_a_planar_angle():
    half = math.radians(100)
    orientation = f"bodies.1.orientation=[{math.cos(half)!r}, 0, 0, {math.sin(half)!r}]"
    scenario = load(
        "two_link_free",
        ["bodies.1={ name = 'link2', mass = 1, inertia = 1 }", orientation, "aero.model=none"],
    )
    assert build(scenario).q0[5] == pytest.approx(2 * half, abs=1e-15)


def test_an_axis_against_z_turns_the_other_way():
    mechanism = build(load("two_link", ["joints.hinge.axis=[0, 0, -1]", "bodies.1.angular_velocity=2"]))
    assert mechanism.q0[3] == math.radians(200) - math.radians(-20)
    assert mechanism.v0[3] == pytest.approx(-2.0, abs=1e-15)
    motion = motion_of(mechanism)
    half = math.radians(-20) / 2
    turned = abs(motion.orientation[1] @ [math.cos(half), 0, 0, math.sin(half)])
    assert turned == pytest.approx(1.0, abs=1e-15)
    np.testing.assert_allclose(motion.angular[1], [0, 0, 2], atol=1e-14)
