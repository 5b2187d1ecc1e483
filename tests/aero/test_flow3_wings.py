"""Wings of any planform in a flow in space: a disc against the exact value, a rectangle against a plate."""

import numpy as np
import pytest

from linkwind.aero.flow import grid as grids
from linkwind.scenario.bodies import Body
from tests.aero.flows3 import PLATE, driven, scene, still
from tests.aero.flows3 import Driven as Flow

TURN = 2.0 * np.pi * np.arange(48) / 48
RADIUS = 0.5


def wing(points):
    return f'{{ type = "wing", points = {np.asarray(points, float).tolist()} }}'


DISC = wing(RADIUS * np.column_stack([np.cos(TURN), np.sin(TURN)]))
CORNERS = np.array([[-0.5, -0.45], [0.5, -0.45], [0.5, 0.45], [-0.5, 0.45]])
RECTANGLE = wing(CORNERS)


def added_mass(shape, axis, steps=300):
    """The force over the acceleration along an axis, after sound has gone, with hardly any viscosity."""
    cells, step = 20, 1e-3
    rise, size = 0.2 * steps * step, 1.0 / cells / (steps * step) ** 2  # half a cell in all

    def course(t):
        s, after = min(t / rise, 1.0), max(t - rise, 0.0)
        place, twist = np.zeros(6), np.zeros(6)
        twist[axis] = size * (rise * (s**3 - 0.5 * s**4) + after)
        far = rise**2 * (0.25 * s**4 - 0.1 * s**5) + 0.5 * rise * after + 0.5 * after**2
        place[axis] = size * far
        return place, twist

    flow = Flow(scene(shape, cells, step, 1e-6 / cells**2 / step, (4.0, 4.0, 4.0)))
    force = flow.go(course, steps)[:, 0]
    assert np.abs(np.delete(force, axis, axis=1)).max() < 0.02 * np.abs(force[:, axis]).max()
    return -force[steps // 2 :, axis].mean() / size


def test_the_added_mass_of_a_disc():
    """8/3 ρ a³ across, H. Lamb, Hydrodynamics, § 108; 2.5 % more is what the square plate is off, too."""
    assert added_mass(DISC, 1) == pytest.approx(8.0 / 3.0 * RADIUS**3, rel=0.04)


def test_a_rectangular_wing_has_the_forces_of_a_plate():
    here = still(0.01, 0.02, 0.03, 0.1, 0.2, 0.3)
    plate, made = (driven(shape=shape).go(here, 60)[:, 0] for shape in (PLATE, RECTANGLE))
    np.testing.assert_allclose(made, plate, atol=1e-4 * np.abs(plate).max())


def test_a_wing_may_lie_beside_its_centre_of_mass():
    """The response about a point off the wing is that about its middle, moved there."""
    middle, apart = driven(shape=RECTANGLE), np.array([0.2, 0.0, 0.7])
    beside = driven(shape=wing(CORNERS - apart[::2]))
    one, other = (flow.answer(still(*at), 0.0) for flow, at in ((middle, (0, 0, 0)), (beside, apart)))
    x, _, z = apart
    across = np.array([[0, -z, 0], [z, 0, -x], [0, x, 0]])  # the force's moment about the other point
    carried = np.eye(6)
    carried[:3, 3:] = across
    np.testing.assert_allclose(
        other.response, carried.T @ one.response @ carried, atol=2e-3 * np.abs(one.response).max()
    )


def test_how_far_a_wing_reaches_and_what_it_moves():
    shape = {"type": "wing", "points": [[3.0, 0.0], [5.0, 0.0], [5.0, 12.0]]}
    body = Body(name="fin", mass=1.0, inertia=1.0, shape=shape)
    assert grids.reach(body, 3) == 13.0
    assert grids.extent(body, 3) == 12.0
    plan = grids.plan(*_of(driven(shape=PLATE)))
    assert grids.moved(body, plan) == pytest.approx(0.25 * np.pi * 2.0 * 12.0)  # area 12, chord 2, density 1


def _of(flow):
    return flow.scenario, flow.scenario.providers[0]
