"""The model flow in three dimensions gives the same bits: twice, on threads, restored, evaluated again."""

import os
import subprocess
import sys

import numpy as np
import pytest

from linkwind.errors import ProtocolError
from tests.aero.flows3 import BALL, CELLS, HEAVY, PLATE, STEP, bits, driven, motion, swing

MODES = pytest.mark.parametrize("lattice_steps", [1, 3])
CELL = 1.0 / CELLS


def flow(lattice_steps, *overrides, **settings):
    made = driven(*overrides, step=round(STEP * (1 if lattice_steps == 1 else 8), 9), **settings)
    assert bool(made.model.capabilities.response_size) == (lattice_steps == 1)
    assert made.model._substeps == lattice_steps
    return made


def faster(t):
    """A course from rest to so many cells that the lattice step is halved, at about the tenth of STEP."""
    rate, along = 0.12 * CELL / STEP / (10 * STEP), np.eye(6)[1]
    return 0.5 * rate * t**2 * along + 0.4 * np.eye(6)[5], rate * t * along


def on(made, course=swing, steps=10):
    """Some steps more: all that they answer, and what is kept at their end, as bytes."""
    out = []
    for k in range(made.at + 1, made.at + steps + 1):
        out.append(bits(made.answer(course, k * made.h)))
        made.model.commit(k * made.h, motion(*course(k * made.h)))
    return [*out, made.model.save()]


def again(made, at):
    """The same flow, whose model has gone so many steps already."""
    made.at = at
    return made


@MODES
def test_twice_and_on_threads(lattice_steps):
    runs = [flow(lattice_steps, f"providers.0.flow.threads={n}") for n in (1, 1, 2, 3)]
    one, *others = (run.go(swing, 20).tobytes() + run.model.save() for run in runs)
    assert all(other == one for other in others)


@MODES
@pytest.mark.parametrize("shape", [PLATE, BALL], ids=["plate", "ball"])
def test_a_state_that_is_restored_goes_on_alike(lattice_steps, shape):
    made = flow(lattice_steps, shape=shape)
    made.go(swing, 9)
    blob = made.model.save()
    expected = on(made)
    made.model.restore(blob)
    assert on(made) == expected
    fresh = again(flow(lattice_steps, "providers.0.flow.threads=2", shape=shape), 9)
    fresh.model.restore(blob)
    assert fresh.model.save() == blob
    assert on(fresh) == expected


def test_before_and_after_the_lattice_step_is_halved():
    made = flow(1, body=HEAVY, wind=(0.0, 0.0, 0.0))
    made.go(faster, 7)
    before = made.model.save()
    made.go(faster, 8)
    after = made.model.save()
    assert made.model._substeps == 2
    expected = on(made, faster)
    fresh = again(flow(1, body=HEAVY, wind=(0.0, 0.0, 0.0)), 7)
    fresh.model.restore(before)
    fresh.go(faster, 8)
    assert fresh.model.save() == after
    other = again(flow(1, body=HEAVY, wind=(0.0, 0.0, 0.0)), 15)
    for model in (fresh, other):
        model.model.restore(after)
        assert model.model._substeps == 2
        assert on(model, faster) == expected
    other.model.restore(before)  # back to where a step is one
    assert other.model._substeps == 1
    again(other, 7).go(faster, 8)
    assert other.model.save() == after


@MODES
def test_a_state_saved_between_evaluation_and_commit(lattice_steps):
    made = flow(lattice_steps)
    made.go(swing, 9)
    before = made.model.save()
    made.answer(swing, 10 * made.h)
    between = made.model.save()
    made.model.restore(before)
    expected = on(made)
    made.model.restore(between)
    assert on(made) == expected


@MODES
def test_evaluated_again_for_another_iteration(lattice_steps):
    made, plain = flow(lattice_steps), flow(lattice_steps)
    for one in (made, plain):
        one.go(swing, 9)
    first = bits(made.answer(swing, 10 * made.h))
    assert bits(made.answer(swing, 10.2 * made.h, 0.05)) != first
    assert bits(made.answer(swing, 10 * made.h)) == first
    assert on(made) == on(plain)


KERNELS = """
import hashlib
from tests.aero import flows, flows3
shapes = (flows3.BALL, flows3.ROD, flows3.KITE)
runs = [flows3.driven(shape=shape, step=step) for shape in shapes for step in STEPS]
found = [run.go(flows3.swing, 5) for run in runs]
found.append(flows.driven(shape='{ type = "ellipse", length = 1.0, width = 0.3 }').go(flows.swing, 5).wrench)
print([hashlib.sha256(wrench.tobytes()).hexdigest() for wrench in found])
""".replace("STEPS", f"({STEP}, {8 * STEP})")


def test_the_kernels_of_blas_change_nothing():
    """OpenBLAS takes those of another processor if it is told to; with fused sums and without they differ."""
    found = []
    for kernels in ("Haswell", "Prescott"):
        environment = os.environ | {"OPENBLAS_CORETYPE": kernels}
        command = [sys.executable, "-c", KERNELS]
        found.append(
            subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout
        )
    assert found[0].count(",") == 6
    assert found[0] == found[1]


def test_a_state_from_the_beginning():
    made = flow(1)
    made.model.restore(b"")
    one = made.go(swing, 5).tobytes()
    made.model.restore(b"")
    assert again(made, 0).go(swing, 5).tobytes() == one


def test_a_blob_of_something_else_is_refused():
    made, plane = flow(1), driven(window=(6.4, 4.8, 4.8))
    for one in (made, plane):
        one.go(swing, 1)
    with pytest.raises(ProtocolError, match="model flow: expected a checkpoint; got 3 bytes"):
        made.model.restore(b"abc")
    with pytest.raises(ProtocolError, match=r"model flow: expected a checkpoint of \(48, 48, 48\) cells"):
        made.model.restore(bytes(1000))
    with pytest.raises(ProtocolError, match=r"model flow: expected a checkpoint of \(48, 48, 48\) cells"):
        made.model.restore(plane.model.save())
    with pytest.raises(ProtocolError, match="model flow: checkpoint: state: expected"):
        made.model.restore(made.model.save()[:-4])
