"""Pictures of the fluid in a box: where, in which units, when."""

import numpy as np
import pytest

from linkwind.aero.flow.drift import Frame
from linkwind.frames import VolumeFrame
from tests.aero.flows3 import BALL, CELLS, HEAVY, PLATE, SIDE, STEP, WIND, driven, motion, steady, still

CELL = 1.0 / CELLS
EACH = "providers.0.flow.frames=1000"  # a picture each step, of the few that there are


def shown(flow, course, steps):
    """The last picture after so many steps, and the mean force in the second half of them."""
    force = flow.go(course, steps)[steps // 2 :, 0, :3].mean(axis=0)
    return flow.model.frame(), force


def centres(frame):
    """Of the cells [m], shape (nz, ny, nx, 3)."""
    nz, ny, nx = frame.velocity.shape[:3]
    z, y, x = np.meshgrid(*map(np.arange, (nz, ny, nx)), indexing="ij")
    return np.array(frame.origin) + frame.cell * np.stack([x, y, z], axis=-1)


def test_an_undisturbed_stream_is_the_wind():
    frame, _ = shown(driven(EACH, f"time.end={100 * STEP!r}"), steady(*WIND), 5)
    assert isinstance(frame, VolumeFrame)
    assert (frame.step, frame.time_ns) == (5, round(5 * STEP * 1e9))
    assert frame.velocity.shape == (48, 48, 48, 3)
    assert frame.cell == pytest.approx(CELL)
    np.testing.assert_allclose(frame.velocity, np.broadcast_to(WIND, frame.velocity.shape), atol=2e-5)
    assert np.abs(frame.pressure).max() < 1e-3 * 0.5 * np.dot(WIND, WIND)


def test_inside_a_body_the_fluid_moves_with_it_wherever_the_window_went():
    """In still air a ball drags along what is inside; that is the fastest and lies around its centre."""
    velocity = np.array([0.08, -0.06, 0.05]) * CELL / STEP
    flow = driven(EACH, f"time.end={200 * STEP!r}", wind=(0.0, 0.0, 0.0), shape=BALL, body=HEAVY)
    frame, _ = shown(flow, steady(*velocity), 80)
    assert flow.model.fluid.offset.any()
    at = centres(frame) - velocity * 80 * STEP
    inside = (np.abs(at) < [0.25, 0.2, 0.15]).all(axis=-1)
    assert np.count_nonzero(inside) >= 3 * 2 * 2
    mean = frame.velocity[inside].mean(axis=0)
    np.testing.assert_allclose(mean, velocity, atol=0.15 * np.linalg.norm(velocity))
    far = (np.abs(at) > 1.2).any(axis=-1)
    assert np.abs(frame.velocity[far]).max() < 0.35 * np.linalg.norm(velocity)


@pytest.mark.parametrize("axis", range(3))
def test_the_drag_of_a_plate_across_the_stream_is_the_pressure_on_it(axis):
    """Summed two cells in front of it and behind; friction has no part in it."""
    speed, place = 0.6, np.zeros(6)
    if axis != 1:  # the plate's normal is y: turn it to x about z, to z about x
        place[5 if axis == 0 else 3] = 0.5 * np.pi
    flow = driven(EACH, f"time.end={200 * STEP!r}", wind=speed * np.eye(3)[axis])
    frame, force = shown(flow, still(*place), 150)
    at = centres(frame)
    across = [k for k in range(3) if k != axis]
    over = (np.abs(at[..., across]) < 0.6).all(axis=-1)
    ahead, behind = (over & (np.abs(at[..., axis] - away) < 0.5 * CELL) for away in (-0.2, 0.2))
    jump = frame.pressure[ahead].sum() - frame.pressure[behind].sum()
    assert jump * CELL**2 == pytest.approx(force[axis], rel=0.15)


def test_half_the_lattice_step_shows_the_same():
    long = driven(EACH, f"time.end={200 * STEP!r}", shape=PLATE)
    frame, _ = shown(long, still(), 60)
    long.model.fluid.halve(1e-2)
    half = long.model.fluid.picture(1.0, 60, frame.time_ns, Frame(np.zeros(3), np.zeros(3)))
    speed = np.linalg.norm(WIND)
    np.testing.assert_allclose(half.velocity, frame.velocity, atol=1e-5 * speed)
    np.testing.assert_allclose(half.pressure, frame.pressure, atol=1e-3 * speed**2)


def test_a_large_box_is_shown_in_blocks_and_at_the_same_place():
    large = driven(EACH, f"time.end={100 * STEP!r}", window=(9.6, 8.0, 8.0), shape=BALL)
    small = driven(EACH, f"time.end={100 * STEP!r}", shape=BALL)
    (coarse, _), (fine, _) = shown(large, still(), 5), shown(small, still(), 5)
    assert coarse.velocity.shape == (40, 40, 48, 3)
    assert coarse.cell == pytest.approx(2 * CELL)
    for frame in (coarse, fine):  # the slowest fluid is at the ball, which stands at the origin
        inside = (np.abs(centres(frame)) < 0.21).all(axis=-1)
        slow = np.linalg.norm(frame.velocity[inside], axis=-1)
        assert slow.max() < 0.7 * np.linalg.norm(WIND)
    low, high = coarse.extent
    np.testing.assert_allclose(np.subtract(high, low), (9.6, 8.0, 8.0), rtol=1e-12)


def test_a_picture_comes_once_each_when_it_is_due():
    flow = driven("providers.0.flow.frames=4", f"time.end={20 * STEP!r}")
    steps = []
    for k in range(21):
        there = still()(0.0)
        if k:
            flow.answer(still(), k * STEP)
            steps += [frame.step for frame in [flow.model.frame()] if frame]
        flow.model.commit(k * STEP, motion(*there))
        steps += [frame.step for frame in [flow.model.frame()] if frame]
        assert flow.model.frame() is None
    assert steps == [0, 5, 10, 15, 20]
    none = driven("providers.0.flow.frames=0")
    none.go(still(), 2)
    assert none.model.frame() is None
    assert none.model.fluid.size == (round(SIDE / CELL),) * 3
