"""The model flow gives the same bits: twice, on two threads, after save and restore, evaluated again."""

import pytest

from linkwind.errors import ProtocolError
from linkwind.runs.validate.driven import motion
from linkwind.spatial import Wrench
from tests.aero.flows import STEP, answer, driven, swing

MODES = pytest.mark.parametrize("lattice_steps", [1, 3])


def flow(lattice_steps, *overrides):
    step = round(STEP * (1 if lattice_steps == 1 else 6), 9)  # 6 of them are done in 3, of 0.1 cells
    made = driven(*overrides, step=step)
    assert bool(made.model.capabilities.response_size) == (lattice_steps == 1)
    return made


@MODES
def test_twice_and_on_two_threads(lattice_steps):
    runs = [flow(lattice_steps, f"aero.flow.threads={n}") for n in (1, 1, 2)]
    one, again, two = (run.go(swing, steps=30).wrench.tobytes() for run in runs)
    assert one == again == two


@MODES
def test_a_state_that_is_restored_goes_on_alike(lattice_steps):
    made = flow(lattice_steps)
    made.go(swing, steps=12)
    blob = made.model.save()
    on = _go_on(made, 12)
    made.model.restore(blob)
    assert _go_on(made, 12) == on
    fresh = flow(lattice_steps)
    fresh.model.restore(blob)
    assert _go_on(fresh, 12) == on


@MODES
def test_a_state_saved_between_evaluation_and_commit(lattice_steps):
    made = flow(lattice_steps)
    made.go(swing, steps=12)
    before = made.model.save()
    answer(made.model, 13 * made.h)
    between = made.model.save()
    made.model.restore(before)
    on = _go_on(made, 12)
    made.model.restore(between)
    assert _go_on(made, 12) == on


@MODES
def test_evaluated_again_for_another_iteration(lattice_steps):
    made = flow(lattice_steps)
    made.go(swing, steps=12)
    first = answer(made.model, 13 * made.h)
    answer(made.model, 13.2 * made.h)
    assert answer(made.model, 13 * made.h) == first


def _go_on(made, at):
    """Ten steps more; the wrenches as bytes."""
    wrench, out = Wrench.zeros(1), b""
    for k in range(at + 1, at + 11):
        made.model.evaluate(k * made.h, motion(*swing(k * made.h), 1), wrench)
        made.model.commit(k * made.h, motion(*swing(k * made.h), 1))
        out += wrench.force.tobytes() + wrench.torque.tobytes()
    return out


def test_a_blob_of_something_else_is_refused():
    made = flow(1)
    made.go(swing, steps=1)
    with pytest.raises(ProtocolError, match="model flow: expected a checkpoint; got 3 bytes"):
        made.model.restore(b"abc")
    with pytest.raises(ProtocolError, match="model flow: expected a checkpoint of"):
        made.model.restore(bytes(1000))
