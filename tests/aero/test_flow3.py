"""The model flow in three dimensions against invariants; longer cases: ``linkwind validate flow``."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.scenario import load
from tests.aero.flows3 import (
    BALL,
    CELLS,
    HEAVY,
    PLATE,
    ROD,
    SIDE,
    STEP,
    WIND,
    Driven,
    bits,
    driven,
    steady,
    still,
    swing,
    text,
    wrench_of,
)

SHAPES = pytest.mark.parametrize("shape", [PLATE, BALL, ROD], ids=["plate", "ball", "rod"])
CELL = 1.0 / CELLS
ROUNDING = 1e-4  # of the largest force: populations are single


@SHAPES
def test_evaluations_change_nothing(shape):
    flow = driven(shape=shape)
    flow.go(swing, 10)
    first = bits(flow.answer(swing, 11 * STEP))
    assert bits(flow.answer(swing, 11.5 * STEP, 0.1)) != first
    assert bits(flow.answer(swing, 11 * STEP)) == first


@SHAPES
@pytest.mark.parametrize("start_time", [0.0, 40 * STEP])
def test_a_response_is_minus_the_derivative_of_the_wrench(shape, start_time):
    """The wrench is affine in the twist: a large change tells the derivative as well as a small one."""
    flow = driven(f"providers.0.flow.start_time={start_time!r}", shape=shape)
    flow.go(swing, 20)
    here = flow.answer(swing, 21 * STEP)
    for axis in range(6):
        there = flow.answer(swing, 21 * STEP, 0.3 * np.eye(6)[axis])
        changed = (wrench_of(there) - wrench_of(here))[0]
        expected = -0.3 * here.response[:, axis]
        np.testing.assert_allclose(changed, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(there.response, here.response, rtol=1e-12)


@SHAPES
def test_a_response_is_symmetric_and_what_it_takes_is_not_negative(shape):
    flow = driven(shape=shape)
    flow.go(swing, 5)
    response = flow.answer(swing, 6 * STEP).response
    np.testing.assert_allclose(response, response.T, rtol=1e-12, atol=1e-12 * np.abs(response).max())
    assert np.linalg.eigvalsh(response).min() > 0.0


@SHAPES
def test_a_coarser_communication_step_comes_to_the_same(shape):
    """Several lattice steps in a communication step against one in each."""
    step = 0.019  # so that the stream goes 0.117 cells a step: four times that takes four lattice steps
    one, coarse = driven(shape=shape, step=step), driven(shape=shape, step=4 * step)
    assert one.model.capabilities.response_size == 36
    assert coarse.model.capabilities.response_size == 0
    means = one.go(swing, 80).reshape(20, 4, 6).mean(axis=1)
    found = coarse.go(swing, 20)[:, 0]
    assert coarse.answer(swing, 21 * coarse.h).diagnostics[3] == 4
    np.testing.assert_allclose(found, means, rtol=0.0, atol=3e-3 * np.abs(means).max())


def test_a_body_that_becomes_fast_shortens_the_lattice_step():
    """From rest to 0.2 cells a step; against a run whose steps are short from the start."""
    rate = 0.2 * CELL / STEP / (80 * STEP)

    def faster(t):
        along = np.eye(6)[0]
        return 0.5 * rate * t**2 * along + 1.2 * np.eye(6)[5], rate * t * along

    settings = {"body": HEAVY, "wind": (0.0, 0.0, 0.0), "window": (6.4, SIDE, SIDE)}
    long, short = driven(**settings), driven(**settings, step=round(0.25 * STEP, 9))
    found = long.go(faster, 80)[:, 0]
    expected = short.go(faster, 320)[:, 0].reshape(80, 4, 6).mean(axis=1)
    assert long.answer(faster, 81 * STEP).diagnostics[3] == 2
    assert short.answer(faster, 80.25 * STEP).diagnostics[3] == 1
    off = np.abs(found - expected) / np.abs(expected).max()
    assert off[60:].mean(axis=0).max() < 0.04
    assert off[20:].max() < 0.15  # the jolt of the change


@pytest.mark.parametrize("steps", [1, 4], ids=["one lattice step", "several"])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_window_follows_along_every_axis(steps, sign, monkeypatch):
    """By whole cells; as long as no sound comes back from its border nobody feels it."""
    velocity = sign * np.array([0.08, -0.06, 0.05]) * CELL / STEP
    window, still_air, count = (8.0, 7.2, 7.2), (0.0, 0.0, 0.0), 64 // steps
    flow = driven(wind=still_air, step=steps * STEP, window=window, body=HEAVY)
    found = flow.go(steady(*velocity), count)
    gone, offset = velocity * 64 * STEP / CELL, flow.model.fluid.offset
    assert (np.abs(gone - offset) <= 3.0).all()
    assert (sign * offset * [1, -1, 1] > 0).all()
    monkeypatch.setattr("linkwind.aero.flow.window.SLACK", 1e9)
    at_rest = driven(wind=still_air, step=steps * STEP, window=window, body=HEAVY)
    expected = at_rest.go(steady(*velocity), count)
    assert not at_rest.model.fluid.offset.any()
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * np.abs(expected).max())


def test_no_force_on_a_body_that_is_carried_by_the_stream():
    """Its scale: that of the same body held in the stream."""
    held = np.abs(driven(wind=WIND).go(still(), 30)).max()
    carried = driven(wind=WIND).go(steady(*WIND), 30)
    assert np.abs(carried).max() < 2e-4 * held


def test_only_the_motion_relative_to_the_fluid_counts():
    """Up to compressibility: the Mach number is 0.1, and the lattice's errors grow with its square."""
    wind = np.array(WIND)
    turned = still(0.0, 0.0, 0.0, 0.3, -0.2, 0.9)

    def moving(t):
        place, twist = turned(t)
        return place - [*wind * t, 0.0, 0.0, 0.0], twist - [*wind, 0.0, 0.0, 0.0]

    held = driven(wind=WIND).go(turned, 120)[40:, 0].mean(axis=0)
    moved = driven(wind=(0.0, 0.0, 0.0)).go(moving, 120)[40:, 0].mean(axis=0)
    np.testing.assert_allclose(moved[:3], held[:3], rtol=0.0, atol=0.03 * np.abs(held[:3]).max())
    np.testing.assert_allclose(moved[3:], held[3:], rtol=0.0, atol=0.06 * np.abs(held[3:]).max())


# ---- the axes are alike ----

EARLY = 20  # steps in which no sound comes back from the border, to which it is not as far on all sides
TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # x to y, about z
CYCLE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # x to y to z
TURNS = {
    "x": CYCLE @ TURN @ CYCLE.T,
    "y": CYCLE.T @ TURN @ CYCLE,
    "z": TURN,
    "diagonal": CYCLE,
    "back": CYCLE.T,
}


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
@SHAPES
def test_turning_everything_turns_the_forces(turn, shape):
    """By a quarter about an axis of the lattice, or by a third about its diagonal: up to rounding."""

    def turned(t):
        place, twist = swing(t)
        orientation = Rotation.from_matrix(turn) * Rotation.from_rotvec(place[3:])
        return np.concatenate([turn @ place[:3], orientation.as_rotvec()]), _both(turn, turn, twist)

    expected = _both(turn, turn, driven(shape=shape).go(swing, EARLY)[:, 0])
    found = driven(shape=shape, wind=tuple(turn @ WIND)).go(turned, EARLY)[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * np.abs(expected).max())


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("shape", [PLATE, ROD], ids=["plate", "rod"])
def test_a_mirror_image_feels_the_mirror_image(axis, shape):
    """The markers of these shapes are their own image; turns and torques, which are axial, are reversed."""
    mirror = np.eye(3)
    mirror[axis, axis] = -1.0

    def mirrored(t):
        return tuple(_both(mirror, -mirror, part) for part in swing(t))

    expected = _both(mirror, -mirror, driven(shape=shape).go(swing, EARLY)[:, 0])
    found = driven(shape=shape, wind=tuple(mirror @ WIND)).go(mirrored, EARLY)[:, 0]
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=ROUNDING * np.abs(expected).max())


def _both(linear, angular, six):
    """Linear and angular parts (…, 6), each by its matrix."""
    return np.concatenate([six[..., :3] @ linear.T, six[..., 3:] @ angular.T], axis=-1)


# ---- several bodies ----

SECOND = """
[[bodies]]
name = "other"
mass = 1.0
inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
position = [0.2, 0.35, 0.1]
shape = { type = "ellipsoid", size = [0.8, 0.5, 0.5] }
"""


def test_the_order_of_the_bodies_of_a_provider_changes_only_the_order():
    """A body between those of the flow has no part in it."""
    between = SECOND.replace("other", "none").replace("position = [0.2, 0.35, 0.1]", "position = [9.0, 0.0]")
    found = {}
    for order in (["body", "other"], ["other", "body"]):
        scene = text().replace("[[providers]]\n", between + SECOND + "[[providers]]\n", 1)
        flow = Driven(scene, f"providers.0.bodies={order}".replace("'", '"'))
        flow.go(three, 20)
        found[order[0]] = flow.answer(three, 21 * STEP)
    one, other = found["body"], found["other"]
    assert one.response[:6, 6:].any()  # they feel each other
    scale = np.abs(wrench_of(one)).max()
    np.testing.assert_allclose(wrench_of(other)[::-1], wrench_of(one), rtol=0.0, atol=1e-4 * scale)
    swapped = np.roll(np.roll(other.response, 6, axis=0), 6, axis=1)
    scale = np.abs(one.response).max()
    np.testing.assert_allclose(swapped, one.response, rtol=0.0, atol=1e-4 * scale)


def three(t):
    """The courses of a body, one that is nowhere, and another beside the first."""
    place, twist = swing(t)
    away, beside = np.array([9.0, 0, 0, 0, 0, 0]), np.array([0.2, 0.45, 0.1, 0, 0, 0])
    return np.array([place, away, beside]), np.array([twist, 0 * twist, 0 * twist])


def test_bodies_far_apart_hardly_feel_each_other():
    alone = driven(window=(SIDE, 8.0, SIDE)).go(swing, 20)[:, 0]
    scene = text(window=(SIDE, 8.0, SIDE)).replace("[[providers]]\n", SECOND + "[[providers]]\n", 1)

    def both(t):
        place, twist = swing(t)
        return np.array([place, [0.0, 3.0, 0, 0, 0, 0]]), np.array([twist, 0 * twist])

    found = Driven(scene).go(both, 20)[:, 0]
    assert np.abs(found - alone).max() < 0.02 * np.abs(alone).max()


def test_a_planar_mechanism_in_a_flow_in_space(tmp_path):
    """Two plates on a hinge, a roof in a stream along -x, stay in their plane, which halves the flow."""
    settings = [
        "bus.transport=inprocess", "aero.flow.dimensions=3", "aero.flow.cells=20", "aero.flow.frames=0",
        "aero.flow.window=[3.2, 2.4, 2.8]", "coupling.step=4e-4", "time.end=0.04",
    ]  # fmt: skip
    done = run(load("two_link_flow", settings), tmp_path / "out", lambda step: None, report=False)
    path = open_log(done.log).trajectory()
    assert not path.position[:, :, 2].any()
    wrench = path.wrench[50:]
    drag, side = -wrench[:, :, 0].sum(axis=1), np.abs(wrench[:, :, 2:5])
    assert (drag > 0.0).all()
    assert side.max() < 1e-3 * drag.min()
