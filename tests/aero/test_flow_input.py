"""What the model flow refuses or stops at, and what it says; where its markers lie."""

import numpy as np
import pytest

from linkwind import aero
from linkwind.aero.flow.grid import MAX_SPEED
from linkwind.aero.flow.outline import SPACING, inset, markers
from linkwind.errors import ScenarioError, SimulationError
from linkwind.runs.validate.driven import at_rest, motion
from linkwind.scenario import load, loads
from linkwind.spatial import Wrench
from tests.aero.flows import CELLS, STEP, driven, text

FAST = "expected bodies of at most 256 lattice steps"
ELLIPSE = '{ type = "ellipse", length = 1.0, width = 0.05 }'
SECOND = """
[[bodies]]
name = "other"
mass = 1.0
inertia = 1.0
position = [0.0, 0.0]
shape = { type = "plate", length = 1.0 }
"""


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["aero.flow.cells=8.0", f"bodies.0.shape={ELLIPSE}"],
         "scene.toml: aero.flow.cells: expected 8 cells along and 4 across \"body\"; "
         "got 8 along, 0.4 across. Use at least 80."),
        (["aero.flow.window=[2.0, 5.0]"],
         "scene.toml: aero.flow.window: expected a width of at least 2.667 m, 64 cells; got 48 cells. "
         "Make it larger, or leave it out."),
        (["coupling.step=5.0", "time.end=5.0"],
         "scene.toml: coupling.step: expected at most 256 lattice steps of 0.12 cells in it; got 5 s, which "
         "takes 584. Take at most 2.2 s, or fewer cells."),
    ],
)  # fmt: skip
def test_what_is_refused_before_the_start(changes, message):
    scenario = loads(text(), "scene.toml", changes)
    with pytest.raises(ScenarioError) as caught:
        _first(scenario)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (["environment.wind=[1.0, 0.0, 0.5]"], "environment.wind: expected no component along z"),
        (["environment.density=0.0"], "environment.density: expected a number above 0 for the model flow"),
        (["bodies.0.inertia=[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]"],
         'bodies[0] "body".inertia: expected one number: the flow is two-dimensional'),
    ],
)  # fmt: skip
def test_what_a_two_dimensional_flow_cannot_have(changes, message):
    with pytest.raises(ScenarioError) as caught:
        loads(text(), "scene.toml", changes)
    assert message in str(caught.value)


def test_a_body_without_shape_and_spans_that_differ():
    plain = text().replace('shape = { type = "plate", length = 1.0 }', "")
    with pytest.raises(ScenarioError, match=r'bodies\[0\] "body".shape: expected a shape, which the model'):
        loads(plain, "scene.toml")
    wider = SECOND.replace("length = 1.0", "length = 1.0, span = 2.0")
    with pytest.raises(
        ScenarioError, match=r'bodies\[1\] "other".shape.span: expected the span of the others'
    ):
        loads(text().replace("[aero]\n", f"{wider}[aero]\n"), "scene.toml")


def test_a_body_that_leaves_the_window_and_bodies_on_one_another():
    flow = driven()
    flow.model.evaluate(0.0, _motion(0.0), _wrench())
    with pytest.raises(SimulationError, match=r'expected every body inside the window.*got "body" outside'):
        flow.model.evaluate(STEP, _motion(3.0), _wrench())
    crossed = text().replace("[aero]\n", SECOND + "[aero]\n")
    scenario = loads(crossed, "scene.toml")
    model = aero.build(scenario, scenario.providers[0])
    with pytest.raises(SimulationError, match=r'expected outlines at least a cell apart; got "other" on'):
        model.evaluate(0.0, motion(np.zeros(3), np.zeros(3), 2), Wrench.zeros(2))


def test_a_body_that_becomes_too_fast():
    flow = driven(body="mass = 100.0\ninertia = 10.0")
    flow.go(at_rest(), steps=2)
    fast = _motion(0.0)
    fast.linear[0, 0] = 1e4
    flow.model.evaluate(3 * STEP, fast, _wrench())
    with pytest.raises(SimulationError, match=FAST):
        flow.model.commit(3 * STEP, fast)


RAIL = """
[[joints]]
name = "rail"
type = "prismatic"
parent = "world"
child = "body"
"""
CARRIED = (
    RAIL
    + """
[[forces]]
type = "motion"
name = "carriage"
joint = "rail"
position = "0.0"
"""
)


@pytest.mark.parametrize(("joint", "substeps"), [(CARRIED, 2), (RAIL, None)])
def test_a_light_body_becomes_too_fast_for_a_lattice_step_if_the_fluid_moves_it(joint, substeps):
    """One that goes as stated cannot become unstable, whatever its mass: its step is taken in two."""
    light = text(body="mass = 1e-3\ninertia = 1e-3").replace("[aero]\n", joint + "[aero]\n")
    scenario = loads(light, "scene.toml")
    model, wrench = aero.build(scenario, scenario.providers[0]), _wrench()
    wrench.diagnostics = np.zeros(4)
    fast = _motion(0.0)
    fast.linear[0, 0] = 1.5 * MAX_SPEED / CELLS / STEP  # one and a half times what a lattice step allows
    model.commit(0.0, _motion(0.0))
    model.evaluate(STEP, fast, wrench)
    if substeps is None:
        with pytest.raises(SimulationError, match=r'coupling.step: .* "body" is light'):
            model.commit(STEP, fast)
    else:
        model.commit(STEP, fast)
        model.evaluate(2 * STEP, fast, wrench)
        assert wrench.diagnostics[3] == substeps


def _motion(x):
    return motion(np.array([x, 0.0, 0.0]), np.zeros(3), 1)


def _wrench():
    return Wrench.zeros(1)


def _first(scenario):
    model = aero.build(scenario, scenario.providers[0])
    model.evaluate(0.0, _motion(0.0), _wrench())


# ---- markers ----


def test_a_hinge_is_one_marker_of_both_links():
    scenario = load("two_link_flow")
    found = markers(list(scenario.bodies), list(scenario.joints), 0.5 / 48, 1e-5)
    (hinge,) = np.flatnonzero(found.body[:, 1] >= 0)
    assert sorted(found.body[hinge]) == [0, 1]
    np.testing.assert_allclose(np.abs(found.point[hinge, :, 0]), 24.0)
    assert (np.bincount(found.body[:, 0]) > 40).all()
    assert (found.next >= 0).sum() == len(found.next) - 1  # one chain from end to end


def test_markers_keep_their_distance_and_free_ends_are_drawn_in():
    scenario = loads(text(), "scene.toml")
    for viscosity in (1e-6, 1e-2):
        x = np.sort(markers(list(scenario.bodies), [], 1 / 24, viscosity).point[:, 0, 0])
        assert np.diff(x) == pytest.approx(SPACING, rel=0.06)
        assert x[-1] == pytest.approx(12.0 - inset((1.1, 0.60, 0.42, 2.8), viscosity))


def test_a_sharp_tip_has_no_marker_on_its_wrong_side():
    shape = '{ type = "ellipse", length = 1.0, width = 0.125 }'
    scenario = loads(text(shape), "scene.toml")
    points = markers(list(scenario.bodies), [], 1 / 48, 1e-6).point[:, 0]
    x, y = points.T
    assert ((x / 24) ** 2 + (y / 3) ** 2 < 1.0).all()
    turn = np.arctan2(y / 3, x / 24)
    order = np.argsort(turn)
    apart = np.linalg.norm(points[order] - np.roll(points[order], 1, axis=0), axis=1)
    assert apart.max() < 1.3 * SPACING
    assert apart.min() > 0.6
