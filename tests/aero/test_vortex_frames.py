"""Frames of model vortex: wings and wakes of one and the same time, due ones remembered."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from linkwind.aero.vortex import Vortex
from linkwind.errors import ProtocolError
from linkwind.frames import WakeFrame
from linkwind.scenario import Scenario, load
from linkwind.spatial import Motion, Wrench

STEP, SPEED = 1e-3, 10.0
SETTINGS = [f"coupling.step={STEP}", "time.end=0.03"]
SIZE = [f"aero.vortex.{name}" for name in ("chordwise=2", "spanwise=3", "wake=8")]


def scenario(frames: int) -> Scenario:
    return load("flapper", ["aero.model=vortex", *SETTINGS, *SIZE, f"aero.vortex.frames={frames}"])


def ahead(of: Scenario, t: float) -> Motion:
    """All bodies where they are at the start, but for going along x as one."""
    motion = Motion.at_rest(len(of.bodies))
    motion.position[:, 0] = SPEED * t - 0.2 * np.arange(len(of.bodies))
    motion.position[:, 1] = 0.5 * np.arange(len(of.bodies))
    half = 0.5 * np.radians(5.0)
    motion.orientation[:] = [np.cos(half), 0.0, 0.0, np.sin(half)]
    motion.linear[:, 0] = SPEED
    return motion


def fly(model: Vortex, of: Scenario, steps: range) -> list[WakeFrame]:
    """Evaluate and commit step after step as a provider does; return the frames."""
    wrench, shown = Wrench.zeros(len(of.providers[0].bodies)), []
    for step in steps:
        if step:
            model.commit((step - 1) * STEP, ahead(of, (step - 1) * STEP))
        model.evaluate(step * STEP, ahead(of, step * STEP), wrench)
        shown.append(model.frame())
        assert model.frame() is None  # each once
    return [frame for frame in shown if frame is not None]


def made(frames: int) -> tuple[Vortex, Scenario]:
    of = scenario(frames)
    return Vortex(of, of.providers[0]), of


def test_frames_are_due_evenly_and_grow_by_a_row_a_step() -> None:
    model, of = made(6)
    frames = fly(model, of, range(31))
    model.commit(30 * STEP, ahead(of, 30 * STEP))
    last = model.frame()
    assert last is not None
    assert [(f.step, f.time_ns) for f in [*frames, last]] == [(k, k * 1_000_000) for k in range(0, 31, 5)]
    assert [f.shape for f in frames] == [(3, 2 + min(f.step, 8), 3) for f in frames]
    assert {f.bound for f in frames} == {2}


def test_no_frames_are_shown_that_are_not_wanted() -> None:
    model, of = made(0)
    assert fly(model, of, range(12)) == []


def test_wing_and_wake_are_where_they_are_at_one_time() -> None:
    """All wings go ahead as one: a wake begins where rings end, its first line one step of flight behind."""
    model, of = made(30)
    frames = fly(model, of, range(12))
    for frame in frames[5:]:  # where rings end follows the speed, from a start without a wake
        edge, behind = frame.corner[:, 2], frame.corner[:, 3]
        left = np.array([SPEED * STEP, 0.0, 0.0])
        # What the fluid adds in a step is a small part of the speed of flight.
        assert np.linalg.norm(edge - left - behind, axis=-1).max() < 0.2 * SPEED * STEP
        moved = np.array([SPEED * frame.time_ns / 1e9, 0.0, 0.0])
        np.testing.assert_allclose(frame.corner[:, :2] - moved, frames[0].corner[:, :2], atol=1e-6)


def test_a_line_of_the_wake_goes_with_the_fluid_and_its_rings_keep_their_strength() -> None:
    model, of = made(30)
    frames = fly(model, of, range(12))
    for one, next_ in pairwise(frames[1:]):
        rows = min(one.shape[1], next_.shape[1] - 1) - 2
        assert np.array_equal(next_.strength[:, 3 : 3 + rows], one.strength[:, 2 : 2 + rows])
        # The ring that is shed is that of the last row on the wing.
        assert np.array_equal(next_.strength[:, 2], one.strength[:, 1])
        way = np.linalg.norm(next_.corner[:, 4 : 4 + rows] - one.corner[:, 3 : 3 + rows], axis=-1)
        assert 0.0 < way.max() < 0.2 * SPEED * STEP  # still air: far less than the wings


def test_a_frame_that_is_due_is_remembered() -> None:
    model, of = made(6)
    fly(model, of, range(11))
    model.commit(10 * STEP, ahead(of, 10 * STEP))
    again = Vortex(of, of.providers[0])
    again.restore(model.save())
    shown, expected = again.frame(), model.frame()
    assert shown is not None
    assert expected is not None
    assert shown.encode() == expected.encode()
    assert again.frame() is None
    assert again.save() == model.save()


def test_what_was_shown_is_remembered_and_without_frames_nothing_is_due() -> None:
    model, of = made(6)
    fly(model, of, range(11))
    model.commit(10 * STEP, ahead(of, 10 * STEP))
    without, _ = made(0)
    without.restore(model.save())
    assert without.frame() is None
    model.frame()
    again = Vortex(of, of.providers[0])
    again.restore(model.save())
    assert again.frame() is None


@pytest.mark.parametrize("size", [-1, 10**9, 100])
def test_a_damaged_frame_in_the_memory_is_refused(size: int) -> None:
    model, of = made(6)
    fly(model, of, range(11))
    model.commit(10 * STEP, ahead(of, 10 * STEP))
    blob = bytearray(model.save())
    blob[8:16] = size.to_bytes(8, "little", signed=True)
    with pytest.raises(ProtocolError, match="model vortex: expected a checkpoint of"):
        Vortex(of, of.providers[0]).restore(bytes(blob))
