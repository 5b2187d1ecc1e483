"""What the model flow in three dimensions refuses or stops at, and what it says; what it takes."""

import math

import numpy as np
import pytest

from linkwind import aero
from linkwind.errors import ScenarioError, SimulationError
from linkwind.scenario import loads
from linkwind.spatial import Wrench
from tests.aero.flows3 import (
    BALL,
    CELLS,
    HEAVY,
    PLATE,
    SIDE,
    STEP,
    Driven,
    driven,
    motion,
    still,
    swing,
    text,
)

ITEM = 'providers[0] "fluid".flow'
FLAT_BALL = '{ type = "ellipsoid", size = [1.0, 1.0, 0.2] }'
COIN = '{ type = "circle", diameter = 1.0, span = 0.25 }'
LONG = '{ type = "circle", diameter = 0.2 }'  # its span is 1 m unless it says another
WEDGE = '{ type = "polygon", points = [[0.5, 0.0], [-0.5, 0.1], [-0.5, -0.1]], span = 1.0 }'


def refused(expected, *overrides, **settings):
    """What a scenario says before its start, or at its first state."""
    with pytest.raises(ScenarioError) as caught:
        driven(*overrides, **settings).answer(still(), 0.0)
    assert expected in str(caught.value)


@pytest.mark.parametrize(
    ("axis", "name", "least"), [(0, "width", "4.8 m, 48"), (1, "height", "4 m, 40"), (2, "depth", "4 m, 40")]
)
def test_a_window_that_is_too_small_and_one_that_is_just_large_enough(axis, name, least):
    window = [SIDE, SIDE, SIDE]
    window[axis] = 3.2
    refused(
        f"scene.toml: {ITEM}.window: expected a {name} of at least {least} cells; got 32 cells. "
        "Make it larger, or leave it out.",
        window=window, shape=BALL,
    )  # fmt: skip
    window[axis] = float(least.split(" m")[0])  # as advised
    assert np.isfinite(driven(window=window, shape=BALL).answer(still(), 0.0).force).all()


def test_too_many_cells():
    refused(
        f"{ITEM}.window: expected at most 33554432 cells; got 400 × 400 × 400. Make it smaller, or use fewer "
        "cells.",
        window=(40.0, 40.0, 40.0),
    )


@pytest.mark.parametrize(
    ("shape", "got"),
    [
        (FLAT_BALL, "10 along, 2 across"),
        (COIN, "10 along, 2.5 across"),
        (LONG, "10 along its span, 1 m, 2 across"),
        (WEDGE, "10 along, 0.995 across"),
    ],
    ids=["flat ball", "along z", "long", "wedge"],
)
def test_closed_shapes_that_are_thin_along_any_axis(shape, got):
    need = math.ceil(4 * CELLS / float(got.split()[-2]))
    refused(
        f'{ITEM}.cells: expected 8 cells along and 4 across "body"; got {got}. Use at least {need}.',
        shape=shape,
    )
    driven(shape=shape, cells=need)


def test_a_viscosity_that_single_precision_does_not_know():
    refused(
        "scene.toml: environment.viscosity: expected at least 1e-07 cells² a lattice step, here 2e-07 m²/s; "
        "got 1e-09 m²/s. Make it larger.",
        viscosity=1e-9,
    )
    driven(viscosity=2e-7).go(still(), 2)


def test_a_body_with_too_few_cells_along_it():
    small = SECOND.replace("0.8, 0.5, 0.5", "0.6, 0.6, 0.6")
    scene = text().replace("[[providers]]\n", small + "[[providers]]\n", 1)
    with pytest.raises(ScenarioError, match=r'4 across "other"; got 6 along, 6 across. Use at least 14\.'):
        Driven(scene)
    Driven(scene, "providers.0.flow.cells=14")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["environment.density=0.0"], "environment.density: expected a number above 0 for the model flow"),
        (["providers.0.flow.window=[4.8, 4.8]"],
         "flow.window: expected 3 lengths, as many as dimensions; got [4.8, 4.8]. Write [width, height,"),
        (["providers.0.flow.window=[4.8, 4.8, -4.8]"],
         "flow.window: expected a list of 2 or 3 numbers above 0; got [4.8, 4.8, -4.8]"),
        (["providers.0.flow.dimensions=4"],
         "flow.dimensions: expected 2 or 3; got 4. Use one of these."),
        (['providers.0.flow.dimensions="3"'],
         'flow.dimensions: expected 2 or 3; got "3". Write the number alone, without quotes.'),
    ],
)  # fmt: skip
def test_what_a_flow_in_space_cannot_have(changes, message):
    with pytest.raises(ScenarioError) as caught:
        loads(text(), "scene.toml", changes)
    assert message in str(caught.value)


def test_what_one_in_the_plane_cannot_have_and_how_to_have_it():
    flat = "providers.0.flow.dimensions=2", "providers.0.flow.window=[4.8, 4.8]"
    for shape, wind, item in ((BALL, (0.5, 0, 0), "shape.type"), (PLATE, (0.5, 0, 0.1), "environment.wind")):
        with pytest.raises(ScenarioError, match=rf"{item}: .*or set aero.flow.dimensions = 3\."):
            loads(text(shape, wind=wind), "scene.toml", list(flat))
        assert loads(text(shape, wind=wind), "scene.toml").bodies


def test_a_body_without_a_shape():
    with pytest.raises(ScenarioError, match=r'bodies\[0\] "body".shape: expected a shape, which the model'):
        loads(text().replace(f"shape = {PLATE}", ""), "scene.toml")


# ---- on the way ----

SECOND = """
[[bodies]]
name = "other"
mass = 1.0
inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
shape = { type = "ellipsoid", size = [0.8, 0.5, 0.5] }
"""
PROVIDER = '[[providers]]\nbodies = ["body", "other"]\n'
FREE = SECOND.replace("other", "third")
ALONG, AT_REST = np.eye(6)[0], np.zeros((3, 6))


def three(*places):
    """Three bodies at places, the first a plate, in a window of 64³ cells."""
    scene = text(window=(6.4, 6.4, 6.4)).replace("[[providers]]\n", SECOND + FREE + "[[providers]]\n", 1)
    flow = Driven(scene)
    return flow, np.array([[*place, 0.0, 0.0, 0.0] for place in places])


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("body", range(3))
def test_a_body_that_leaves_the_window_is_named(body, side, axis):
    names = ["body", "other", "third"]
    flow, places = three((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    flow.model.evaluate(0.0, motion(places, AT_REST), Wrench.zeros(3))
    places[body, axis] = side * 2.6
    with pytest.raises(SimulationError) as caught:
        flow.model.evaluate(STEP, motion(places, AT_REST), Wrench.zeros(3))
    assert (
        f"scene.toml: {ITEM}.window: t = {STEP:g} s: expected every body inside the window, 14 "
        f'cells from its border; got "{names[body]}" outside.'
    ) in str(caught.value)


@pytest.mark.parametrize(("one", "other"), [(0, 1), (0, 2), (1, 2)])
def test_bodies_on_one_another_are_named(one, other):
    names = ["body", "other", "third"]
    flow, places = three((0.0, -1.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    places[other, :3] = places[one, :3] + [0.1, 0.0, 0.05]
    with pytest.raises(SimulationError) as caught:
        flow.model.evaluate(0.0, motion(places, AT_REST), Wrench.zeros(3))
    message = str(caught.value)
    assert f"{ITEM}.cells: t = 0 s: expected surfaces at least a cell apart" in message
    assert any(f'got "{names[k]}" on another' in message for k in (one, other))
    assert not any(f'"{name}"' in message for k, name in enumerate(names) if k not in (one, other))


def test_bodies_that_joints_connect_over_one_without_a_shape_may_touch():
    """As the root of a wing that sweeps on a hinge of its own, and the thorax."""
    ends = ("body", "hinge"), ("hinge", "other")
    joints = "".join(
        f'[[joints]]\nname = "{child}"\ntype = "revolute"\nparent = "{parent}"\nchild = "{child}"\n'
        for parent, child in ends
    )
    hinge = SECOND.split("shape")[0].replace("other", "hinge")
    scene = text(window=(6.4, 6.4, 6.4), rest=joints).replace("[[providers]]\n", hinge + SECOND + PROVIDER, 1)
    place = np.zeros((3, 6))
    place[2, 2] = 0.5  # the ball reaches from 0.25 to 0.75, the plate to 0.45
    found = Driven(scene).model
    found.evaluate(0.0, motion(place, AT_REST), Wrench.zeros(2))
    free = Driven(scene.replace('parent = "hinge"', 'parent = "world"')).model
    with pytest.raises(SimulationError, match="expected surfaces at least a cell apart"):
        free.evaluate(0.0, motion(place, AT_REST), Wrench.zeros(2))


def test_a_body_that_becomes_too_fast():
    flow = driven(body=HEAVY)
    flow.go(swing, 2)
    place, twist = swing(3 * STEP)
    flow.model.evaluate(3 * STEP, motion(place, twist + 1e4 * ALONG), Wrench.zeros(1))
    with pytest.raises(SimulationError, match="expected bodies of at most 256 lattice steps"):
        flow.model.commit(3 * STEP, motion(place, twist + 1e4 * ALONG))
    light = driven(body=HEAVY.replace("1e3", "1e-3"))
    light.go(swing, 2)
    with pytest.raises(SimulationError, match=r'coupling.step: expected bodies below 0.12 .*"body" is light'):
        light.model.commit(3 * STEP, motion(place, twist + 3.0 * ALONG))


def test_a_closed_body_lighter_than_the_fluid_inside_is_refused():
    """Of this ball, which displaces π/6 · 0.48 kg, some 0.55 of that are needed with 32 cells."""
    displaced = math.pi / 6.0 * 0.48
    for share in (0.4, 0.7):
        body = f"mass = {share * displaced!r}\ninertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]"
        ball = driven(shape=BALL, body=body, cells=32, window=(2.5, 2.5, 2.5), step=STEP / 4)
        if share == 0.4:
            with pytest.raises(SimulationError, match=r"body.*mass: expected at least 0\.\d+ kg, for the"):
                ball.go(swing, 2)
        else:
            ball.go(swing, 2)


def test_a_closed_body_of_less_inertia_than_the_fluid_inside_is_refused():
    """About the axis where this ball lacks it, turned as it is: some 0.55 of the displaced fluid's again."""
    displaced = math.pi / 6.0 * 0.48
    inside = displaced / 20.0 * np.array([0.8**2 + 0.6**2, 1.0 + 0.6**2, 1.0 + 0.8**2])
    for axis, share in ((0, 0.3), (1, 0.3), (2, 0.3), (0, 1.0)):
        own = inside.copy()
        own[axis] *= share
        own[np.argmax(own)] = min(own.max(), 0.999 * (own.sum() - own.max()))  # what a body can have
        body = f"mass = {displaced!r}\ninertia = {[*own.tolist(), 0.0, 0.0, 0.0]}"
        ball = driven(shape=BALL, body=body, cells=32, window=(2.5, 2.5, 2.5), step=STEP / 4)
        if share < 1.0:
            with pytest.raises(SimulationError, match=r"body.*inertia: expected at least 0\.\d+ kg·m² about"):
                ball.go(swing, 2)
        else:
            ball.go(swing, 2)


def test_wind_along_any_axis_pushes_that_way():
    for axis in range(3):
        wind = 0.6 * np.eye(3)[axis]
        force = driven(shape=BALL, wind=wind).go(still(), 60)[30:, 0, :3].mean(axis=0)
        assert force[axis] > 0.05
        assert np.abs(np.delete(force, axis)).max() < 0.02 * force[axis]


def test_a_provider_without_a_first_motion_has_no_fluid():
    scenario = loads(text(), "scene.toml")
    model = aero.build(scenario, scenario.providers[0])
    assert model.save() == b""
    assert model.frame() is None
