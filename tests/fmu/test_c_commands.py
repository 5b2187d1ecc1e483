"""Commands of events and inputs of force elements in the C layers: substeps, states, wrong use."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from linkwind.mechanism import build
from tests.fmi.scenes import servo
from tests.fmu.c_model import ERROR, OK, Instance, dynamics, pointer

H = 0.01
BRAKE = [True, False]


@pytest.fixture(scope="module")
def arm(compiler):
    mechanism = build(servo())
    model = dynamics(mechanism.tables, mechanism.q0, mechanism.v0, substeps=4)
    return compiler.library(model, 3, "arm"), model


@pytest.fixture
def start(arm):
    made = []

    def make(**how) -> Instance:
        made.append(Instance(*arm, **how))
        return made[-1].initialize()

    yield make
    for fmu in made:
        fmu.free()


def everything(fmu: Instance) -> bytes:
    sections = [name for name, size in fmu.model.sizes.items() if size and name != "EVENT_COMMAND"]
    return fmu.get(*sections).tobytes()


def test_a_command_is_for_all_substeps_of_a_step_and_not_for_one_that_has_begun(start):
    within = []

    def update(*_):
        within.append(updated.try_command(BRAKE))

    plain, updated = start(), start(update=update)
    for fmu in (plain, updated):
        fmu.step(0.0, H)
        assert fmu.try_command(BRAKE) == OK
        fmu.step(H, H)
        assert fmu.get("EVENT_TIME").tolist() == [pytest.approx(H, abs=1e-12), -1.0]
    assert set(within) == {ERROR}
    assert everything(plain) == everything(updated)


def test_commands_and_inputs_go_with_the_bytes_of_a_state(start):
    one, other = start(), start()
    one.step(0.0, H)
    one.set("FORCE_INPUT", [2.0, 1.0, 0.5, 3.0])
    one.try_command(BRAKE)
    status, state = other.deserialize(one.serialize(one.get_state()))
    assert status == OK
    other.do("SetFMUState", state)
    assert other.commands() == BRAKE
    for fmu in (one, other):
        fmu.step(H, H)
        assert fmu.get("EVENT_TIME")[0] == pytest.approx(H, abs=1e-12)
    assert everything(one) == everything(other)
    done = one.get_state()
    one.try_command([False, False])
    one.step(2 * H, H)
    one.do("SetFMUState", done)
    assert one.commands() == BRAKE


def test_reset_takes_both_back(start):
    fmu, fresh = start(), start()
    fmu.set("FORCE_INPUT", np.ones(4))
    fmu.try_command([True, True])
    fmu.step(0.0, H)
    fmu.do("Reset")
    fmu.initialize()
    assert fmu.commands() == [False, False]
    for each in (fmu, fresh):
        each.step(0.0, H)
    assert everything(fmu) == everything(fresh)


def test_wrong_use(start):
    fmu = start()
    references, values = fmu.vrs("EVENT_COMMAND"), np.zeros(3, dtype=np.bool_)
    assert (
        fmu.call("SetBoolean", pointer(references), ctypes.c_size_t(2), pointer(values), ctypes.c_size_t(3))
        == ERROR
    )
    assert "Expected nValues = 2 but was 3" in fmu.messages[-1][2]
    inputs = fmu.vrs("FORCE_INPUT")
    assert (
        fmu.call("SetBoolean", pointer(inputs), ctypes.c_size_t(1), pointer(values), ctypes.c_size_t(1))
        == ERROR
    )
    assert "Expected a variable of type Boolean but was Float64" in fmu.messages[-1][2]
    number = np.ones(1)
    assert (
        fmu.call("SetFloat64", pointer(references), ctypes.c_size_t(1), pointer(number), ctypes.c_size_t(1))
        == ERROR
    )
    assert "Expected a variable of type Float64 but was Boolean" in fmu.messages[-1][2]
    assert fmu.try_set("FORCE_INPUT", [1.0, np.nan, 0.0, 0.0]) == ERROR
    assert fmu.get("FORCE_INPUT").tolist() == [0.0, 2.0, 0.4, 0.5]
    fmu.do("Terminate")
    assert fmu.try_command(BRAKE) == ERROR
