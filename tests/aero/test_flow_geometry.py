"""Motion between two states and the fluid inside bodies: in space against formulas and against the plane."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from linkwind.aero.flow.interior import Interior, InteriorInSpace
from linkwind.aero.flow.motion import State, between, between_in_space, planar, spatial
from linkwind.runs.validate.driven import motion
from linkwind.scenario import loads
from tests.scenario.texts import SMALL

H = 1e-3
CIRCLE = '{ type = "circle", diameter = 0.4, span = 0.5 }'
WEDGE = '{ type = "polygon", points = [[0.1, -0.1], [0.5, 0.0], [0.0, 0.3]], span = 0.7 }'


def state(position, turn, linear, angular):
    """The state of a body turned by a rotation vector."""
    x, y, z, w = Rotation.from_rotvec(turn).as_quat()
    return State(np.array([[*position, w, x, y, z]]), np.array([[*linear, *angular]]))


def turned(found):
    w, x, y, z = found.pose[0, 3:]
    return Rotation.from_quat([x, y, z, w])


def body(shape):
    return loads(SMALL + f"shape = {shape}\n", "s.toml").bodies[0]


def test_a_steady_screw_is_followed_exactly():
    spin, speed = np.array([3.0, -40.0, 25.0]), np.array([1.0, 2.0, -0.5])
    first = Rotation.from_rotvec([0.4, -0.2, 0.9])
    start, end = (
        state(speed * t, (Rotation.from_rotvec(spin * t) * first).as_rotvec(), speed, spin) for t in (0.0, H)
    )
    for share in (0.0, 0.3, 1.0):
        found = between_in_space(start, end, share, H)
        np.testing.assert_allclose(found.pose[0, :3], speed * share * H, atol=1e-18)
        off = turned(found) * (Rotation.from_rotvec(spin * share * H) * first).inv()
        assert off.magnitude() < 1e-14
        np.testing.assert_allclose(found.twist[0], [*speed, *spin], rtol=1e-11)


def test_the_twist_between_is_the_rate_of_the_pose():
    """By differences, of a turn of 0.05 rad whose rate changes its axis: within its third power."""
    spin, later = np.array([30.0, 20.0, -35.0]), np.array([28.0, 30.0, -30.0])
    start = state([0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], spin)
    end = state([0.8e-3, 1e-4, 0.0], 0.5 * (spin + later) * H, [0.5, 0.3, 0.1], later)
    eps = 1e-4
    for share in (0.25, 0.5, 0.75):
        low, middle, high = (between_in_space(start, end, share + d, H) for d in (-eps, 0.0, eps))
        rate = (high.pose[0, :3] - low.pose[0, :3]) / (2.0 * eps * H)
        np.testing.assert_allclose(middle.twist[0, :3], rate, rtol=1e-7)
        spinning = (turned(high) * turned(low).inv()).as_rotvec() / (2.0 * eps * H)
        assert np.linalg.norm(middle.twist[0, 3:] - spinning) < 0.05**3 * 50.0 / 24.0


def test_the_ends_are_the_states():
    start = state([1.0, 2.0, 3.0], [0.1, 0.2, 0.3], [1.0, -1.0, 2.0], [4.0, 5.0, 6.0])
    end = state([1.001, 2.0, 3.002], [0.104, 0.205, 0.307], [0.9, -1.0, 2.1], [4.1, 5.2, 6.0])
    for share, there in ((0.0, start), (1.0, end)):
        found = between_in_space(start, end, share, H)
        np.testing.assert_allclose(found.pose, there.pose, atol=1e-15)
        np.testing.assert_allclose(found.twist, there.twist, rtol=1e-8)  # series in the turn


def test_in_the_plane_space_is_the_plane():
    one = motion(np.array([0.1, 0.2, 2.9]), np.array([3.0, -2.0, 40.0]), 1)
    other = motion(np.array([0.103, 0.1982, 2.94]), np.array([2.9, -1.8, 41.0]), 1)
    everything = slice(0, 1)
    flat = between(planar(one, everything), planar(other, everything), 0.4, H)
    solid = between_in_space(spatial(one, everything), spatial(other, everything), 0.4, H)
    np.testing.assert_allclose(solid.pose[:, :2], flat.pose[:, :2], rtol=1e-14)
    np.testing.assert_allclose(solid.twist[:, [0, 1, 5]], flat.twist, rtol=1e-13)
    assert turned(solid).as_rotvec()[2] == pytest.approx(math.atan2(flat.pose[0, 3], flat.pose[0, 2]))
    assert spatial(one, everything).fastest([0.5]) == planar(one, everything).fastest([0.5])


@pytest.mark.parametrize("shape", [CIRCLE, WEDGE])
def test_the_inside_in_space_is_that_in_the_plane_times_the_span(shape):
    there = motion(np.array([0.1, 0.2, 0.6]), np.zeros(3), 1)
    flat = Interior([body(shape)], 1.2 * body(shape).shape.span).inertia(planar(there, slice(0, 1)).pose)
    solid = InteriorInSpace([body(shape)], 1.2).inertia(spatial(there, slice(0, 1)).pose)
    kept = np.ix_([0], [0, 1, 5], [0, 1, 5])
    np.testing.assert_allclose(solid[kept], flat, atol=1e-12)


def test_the_inside_of_a_cylinder_and_of_an_ellipsoid():
    r, span = 0.2, 0.5
    mass = 1.2 * np.pi * r**2 * span
    across = mass * (3.0 * r**2 + span**2) / 12.0
    upright = np.array([[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
    found = InteriorInSpace([body(CIRCLE)], 1.2).inertia(upright)[0]
    expected = np.diag([mass, mass, mass, across, across, 0.5 * mass * r**2])
    np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-9)

    a, b, c = 0.1, 0.2, 0.3
    mass = 1.2 * 4.0 / 3.0 * np.pi * a * b * c
    ball = body('{ type = "ellipsoid", size = [0.2, 0.4, 0.6] }')
    quarter = np.array([[0.0, 0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0]])  # about x: y is z
    found = InteriorInSpace([ball], 1.2).inertia(quarter)[0]
    moments = 0.2 * mass * np.array([b**2 + c**2, a**2 + b**2, a**2 + c**2])
    np.testing.assert_allclose(found, np.diag([mass, mass, mass, *moments]), atol=1e-12)


def test_the_inside_off_the_centre_of_mass_has_a_first_moment():
    """The momentum of a rigid fluid is that of its centroid, wherever the body turns about."""
    wedge = body(WEDGE)
    points = np.array(wedge.shape.points)
    centroid, area = np.append(points.mean(axis=0), 0.0), wedge.shape.outline()
    (x, y), (x1, y1) = area.T, np.roll(area, -1, axis=0).T
    mass = 1.2 * 0.5 * (x @ y1 - x1 @ y) * 0.7
    turn = Rotation.from_rotvec([0.3, -0.8, 0.5])
    qx, qy, qz, qw = turn.as_quat()
    found = InteriorInSpace([wedge], 1.2).inertia(np.array([[0.0, 0.0, 0.0, qw, qx, qy, qz]]))[0]
    velocity, spin = np.array([1.0, 2.0, 3.0]), np.array([-2.0, 0.5, 1.5])
    momentum = mass * (velocity + np.cross(spin, turn.apply(centroid)))
    np.testing.assert_allclose((found @ [*velocity, *spin])[:3], momentum, rtol=1e-12)
    np.testing.assert_allclose(found, found.T, atol=1e-15)
    assert np.linalg.eigvalsh(found).min() > 0.0
