"""The built-in scenarios say what the paper and the stated force fields say."""

import math

import numpy as np
import pytest

from linkwind import aero
from linkwind.scenario import load
from linkwind.spatial import Motion, Wrench

PI = math.pi


def field_0(t):
    """F0 as stated: (Fx, Fy, τ) of both bodies."""

    def s(f, phase=0.0):
        return math.sin(2 * PI * f * t + phase)

    def c(f):
        return math.cos(2 * PI * f * t)

    return [
        (-12 + 8 * s(7) + 6 * s(23, 1) + 4 * c(40), 14 + 5 * s(5, 0.5) + 5 * c(31), 0.8 * c(3) + s(19)),
        (-10 + 8 * c(9) + 6 * s(27) + 4 * s(37, 2), 15 + 5 * c(6) + 5 * s(33, 1), -0.6 * s(4) + c(21)),
    ]


def field_1(t, b, position, theta, velocity, omega):
    """F1 as stated, on body b: (Fx, Fy, τ)."""
    x, y = position
    gx = (
        1
        + 0.3 * math.sin(2 * PI * (12 * t + 1.3 * x))
        + 0.2 * math.sin(2 * PI * (35 * t - 0.9 * y + 0.3 * b))
    )
    gy = 0.3 * math.cos(2 * PI * (17 * t + 1.1 * y)) + 0.2 * math.sin(2 * PI * (29 * t + x))
    normal = np.array([-math.sin(theta), math.cos(theta)])
    along = np.array([math.cos(theta), math.sin(theta)])
    u = np.array([-5 * gx, 5 * gy]) - velocity
    speed, u_n, u_e, q = float(np.linalg.norm(u)), float(u @ normal), float(u @ along), 0.3
    f_n, f_e = 2.2 * q * u_n * speed, 0.2 * q * u_e * abs(u_e)
    fx, fy = f_n * normal + f_e * along
    return fx, fy, -0.08 * f_n * u_e / speed - 0.15 * omega * abs(u_n)


def wrench_of(name, t, position, theta, velocity, omega):
    scenario = load(name)
    model = aero.build(scenario, scenario.providers[0])
    motion, wrench = Motion.at_rest(2), Wrench.zeros(2)
    motion.position[:, :2], motion.linear[:, :2], motion.angular[:, 2] = position, velocity, omega
    motion.orientation[:, 0], motion.orientation[:, 3] = np.cos(theta / 2), np.sin(theta / 2)
    model.evaluate(t, motion, wrench)
    return wrench


@pytest.mark.parametrize("seed", range(20))
def test_the_fields_are_the_stated_ones(seed):
    rng = np.random.default_rng(seed)
    t, omega = rng.uniform(0, 1.2), rng.normal(size=2)
    position, velocity = rng.normal(size=(2, 2)), rng.normal(size=(2, 2))
    theta = np.array([PI - 0.3, 0.3]) + rng.uniform(-3, 3, 2)
    expected = {
        "two_link_field": field_0(t),
        "two_link_gust": [field_1(t, b, position[b], theta[b], velocity[b], omega[b]) for b in range(2)],
    }
    for name, stated in expected.items():
        wrench = wrench_of(name, t, position, theta, velocity, omega)
        got = np.column_stack([wrench.force[:, :2], wrench.torque[:, 2]])
        np.testing.assert_allclose(got, stated, rtol=1e-12, atol=1e-11)
        assert not wrench.force[:, 2].any()
        assert not wrench.torque[:, :2].any()


@pytest.mark.parametrize("name", ["two_link", "two_link_free", "two_link_field", "two_link_gust"])
def test_the_paper_s_bodies_and_the_default_coupling(name):
    scenario = load(name)
    for body in scenario.bodies:
        assert (body.mass, body.inertia, body.shape.length, body.shape.span) == (2.0, 1.4, 0.5, 1.0)
    assert [body.name for body in scenario.bodies] == ["link1", "link2"]
    assert scenario.planar
    assert scenario.environment.gravity == (0.0, -9.81, 0.0)
    assert (scenario.time.end, scenario.steps, scenario.coupling.step_ns) == (1.2, 1200, 1_000_000)
    coupling = scenario.coupling
    assert (coupling.scheme, coupling.order, coupling.adaptive) == ("pec", 3, True)
    assert scenario.providers[0].bodies == ("link1", "link2")


def test_streams_and_joints():
    assert load("two_link").environment.wind == (-5.0, 0.0, 0.0)
    assert load("two_link_free").environment.wind == (-3.0, 0.0, 0.0)
    assert load("two_link_free").joints == ()
    for name in ("two_link", "two_link_field", "two_link_gust"):
        (joint,) = load(name).joints
        assert (joint.type, joint.parent, joint.child) == ("revolute", "link1", "link2")
        assert joint.parent_point == joint.child_point == (-0.25, 0.0, 0.0)


def test_free_and_jointed_pair_start_from_the_same_poses():
    jointed, free = load("two_link"), load("two_link_free")
    assert jointed.bodies[0].position == free.bodies[0].position
    assert (
        [body.angle_deg for body in jointed.bodies] == [body.angle_deg for body in free.bodies] == [200, -20]
    )
    for body in free.bodies:
        angle = math.radians(body.angle_deg)
        stated = np.array(body.position[:2])
        np.testing.assert_allclose(stated, 0.25 * np.array([math.cos(angle), math.sin(angle)]), atol=1e-16)
