"""Wrong use: an error, a message that tells what was expected, and nothing changed."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from tests.fmu.c_model import DISCARD, ERROR, OK, Instance, dynamics, pointer
from tests.native.mechanisms import Body, tables

size = ctypes.c_size_t
number = ctypes.c_double
COMMON = ["EnterInitializationMode", "ExitInitializationMode", "EnterEventMode", "Terminate", "Reset"]


@pytest.fixture
def fmu(planar_library, planar_model):
    instance = Instance(planar_library, planar_model)
    yield instance
    instance.free()


@pytest.fixture
def running(fmu):
    return fmu.initialize(0.0, 1.0)


def refused(fmu: Instance, status: int, *words: str) -> None:
    assert status == ERROR
    assert fmu.messages[-1][:2] == (ERROR, "logStatusError")
    for word in ("Expected", "but was", *words):
        assert word in fmu.messages[-1][2]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("section", ["FORCE", "GRAVITY"])
def test_numbers_that_are_not_finite(running, section, value):
    before = running.get(section)
    values = before + 1.0
    values[-1] = value
    refused(running, running.try_set(section, values), section, "a finite number")
    assert running.get(section).tobytes() == before.tobytes()  # not even the good part was taken


@pytest.mark.parametrize("step", [0.0, -0.1, np.nan, np.inf, 1e-300])
def test_step_sizes(running, step):
    running.step(0.0, 0.1)
    refused(running, running.try_step(0.1, step)[0], "fmi3DoStep: Expected communicationStepSize")
    running.step(0.1, 0.1)


def test_communication_points(running):
    refused(running, running.try_step(0.1, 0.1)[0], "currentCommunicationPoint = 0 but was 0.1")
    refused(running, running.try_step(np.nan, 0.1)[0], "currentCommunicationPoint")
    running.step(0.0, 0.1)
    refused(running, running.try_step(0.0, 0.1)[0], "currentCommunicationPoint = 0.1")
    refused(running, running.try_step(0.1, 1.0)[0], "ends by stopTime = 1 but was 1.1")
    running.step(np.nextafter(0.1, 1.0), 0.9)  # round-off of the environment's clock is none of these


def test_value_references_and_counts(running):
    values = np.zeros(6)
    for references, count, word in (
        ([9999], 1, "below"),
        ([2**32 - 1], 1, "below"),
        (running.vrs("FORCE"), 5, "= 6 but"),
    ):
        vrs = np.array(references, dtype=np.uint32)
        for call in ("GetFloat64", "SetFloat64"):
            refused(
                running, running.call(call, pointer(vrs), size(len(vrs)), pointer(values), size(count)), word
            )
    solver = running.vrs("SUBSTEPS")
    refused(
        running,
        running.call("GetFloat64", pointer(solver), size(1), pointer(values), size(1)),
        "SUBSTEPS",
        "Float64",
    )
    force = running.vrs("FORCE")
    refused(
        running, running.call("GetInt32", pointer(force), size(1), pointer(values), size(1)), "FORCE", "Int32"
    )
    refused(
        running,
        running.call("GetFloat64", None, size(1), pointer(values), size(1)),
        "pointer in valueReferences",
    )
    refused(running, running.call("GetFloat64", pointer(force), size(1), None, size(6)), "pointer in values")
    running.do("GetFloat64", None, size(0), None, size(0))


def test_what_may_be_set_when(fmu):
    fmu.set("PARENT_POINT", fmu.get("PARENT_POINT"))
    fmu.set("Q", fmu.get("Q"))
    refused(fmu, fmu.try_set("POSITION", np.zeros(6)), "POSITION")
    fmu.initialize()
    fmu.set("MASS", [1.0, 1.0])
    for section in ("PARENT_POINT", "Q", "V", "DER_V", "POSITION"):
        refused(fmu, fmu.try_set(section, fmu.get(section)), section, "may be set in this state")
    time = np.zeros(1, dtype=np.uint32)
    refused(fmu, fmu.call("SetFloat64", pointer(time), size(1), pointer(np.ones(1)), size(1)), "time")
    fmu.do("Terminate")
    refused(fmu, fmu.try_set("FORCE", np.zeros(6)), "Terminated")
    fmu.get("POSITION")


@pytest.mark.parametrize(
    ("section", "values", "words"),
    [
        ("MASS", [1.0, -2.0], ("MASS", "mass of zero or more but was -2")),
        (
            "INERTIA",
            [0, 0, 1, 0, 0, 0, 0, 0, -3, 0, 0, 0],
            ("INERTIA", "moment of inertia of zero or more but was -3"),
        ),
        ("RTOL", [-1.0], ("RTOL", "zero or more")),
        ("ATOL", [0.0], ("ATOL", "more than zero")),
    ],
)
def test_parameters_without_sense(running, section, values, words):
    before = running.get(section)
    running.set(section, values)
    refused(running, running.try_step(0.0, 0.1)[0], *words)
    running.set(section, before)
    running.step(0.0, 0.1)


@pytest.mark.parametrize(("name", "value"), [("INTEGRATOR", 5), ("INTEGRATOR", -1), ("SUBSTEPS", 0)])
def test_solver_without_sense(running, name, value):
    assert running.set_integer(name, value) == OK
    refused(running, running.try_step(0.0, 0.1)[0], name, f"but was {value}")


def test_variable_is_named_in_scalar_models_too(compiler, two_link):
    model = dynamics(two_link.tables, two_link.q0, two_link.v0, scalar=True)
    fmu = Instance(compiler.library(model, 3, "planar_scalar_names"), model)
    fmu.set("INERTIA", [0, 0, 1, 0, 0, 0, 0, 0, -3, 0, 0, 0])
    fmu.do("EnterInitializationMode", False, number(0), number(0), False, number(0))
    refused(fmu, fmu.call("ExitInitializationMode"), "INERTIA[8]: Expected a moment")


def test_numerical_trouble_is_a_discard(compiler):
    massless = tables([Body(-1, "revolute", 0.0, np.zeros((3, 3)))])
    model = dynamics(massless, [0.0], [0.0])
    fmu = Instance(compiler.library(model, 3, "massless"), model)
    fmu.do("EnterInitializationMode", False, number(0), number(0), False, number(0))
    assert fmu.call("ExitInitializationMode") == DISCARD
    assert fmu.messages[-1][1] == "logStatusDiscard"
    assert "inertia to move" in fmu.messages[-1][2]
    added = np.diag([1.0, 1.0, 1.0, 0.1, 0.1, 0.1])
    fmu.set("ADDED_INERTIA", added)
    fmu.do("ExitInitializationMode")


def test_order_of_calls(fmu):
    step = fmu.try_step(0.0, 0.1)[0]
    refused(fmu, step, "fmi3DoStep", "Instantiated of Co-Simulation")
    refused(fmu, fmu.call("ExitInitializationMode"), "Instantiated")
    refused(fmu, fmu.call("Terminate"))
    fmu.initialize()
    enter = fmu.call("EnterInitializationMode", False, number(0), number(0), False, number(0))
    refused(fmu, enter, "Step Mode of Co-Simulation")
    refused(fmu, fmu.call("EnterContinuousTimeMode"))
    refused(fmu, fmu.call("SetTime", number(1.0)))
    refused(fmu, fmu.call("GetContinuousStates", pointer(np.zeros(8)), size(8)), "Co-Simulation")
    fmu.step(0.0, 0.1)
    fmu.do("Terminate")
    refused(fmu, fmu.try_step(0.1, 0.1)[0], "Terminated")
    fmu.do("Reset")
    fmu.initialize().step(0.0, 0.1)


def test_order_of_calls_in_model_exchange(planar_library, planar_model):
    fmu = Instance(planar_library, planar_model, exchange=True)
    refused(fmu, fmu.call("EnterContinuousTimeMode"), "Instantiated of Model Exchange")
    fmu.initialize()
    x = np.zeros(8)
    refused(fmu, fmu.call("SetContinuousStates", pointer(x), size(8)), "Event Mode")
    fmu.do("EnterContinuousTimeMode")
    refused(fmu, fmu.call("GetContinuousStates", pointer(x), size(7)), "8 continuous states but was 7")
    refused(fmu, fmu.call("SetContinuousStates", pointer(np.full(8, np.nan)), size(8)), "Q", "finite")
    refused(fmu, fmu.call("GetContinuousStateDerivatives", None, size(8)), "NULL")
    refused(fmu, fmu.call("SetTime", number(np.nan)), "time")
    refused(fmu, fmu.try_step(0.0, 0.1)[0], "Continuous-Time Mode")
    refused(fmu, fmu.try_set("MASS", [1.0, 1.0]), "MASS")
    fmu.do("EnterEventMode")
    fmu.set("MASS", [1.0, 1.0])
    fmu.free()


def test_experiment(fmu):
    for start, stop, word in ((np.nan, None, "startTime"), (1.0, 0.5, "stopTime >= startTime")):
        arguments = (False, number(0), number(start), stop is not None, number(stop or 0.0))
        refused(fmu, fmu.call("EnterInitializationMode", *arguments), word)
    fmu.initialize(2.0).step(2.0, 0.1)


def test_instantiation(planar_library, planar_model):
    for arguments, word in (({"token": "{wrong}"}, "Expected the token {8c4e"),):
        fmu = Instance(planar_library, planar_model, logging=True, **arguments)
        assert not fmu.at
        assert word in fmu.messages[0][2]
    library = ctypes.CDLL(str(planar_library))
    library.fmi3InstantiateModelExchange.restype = ctypes.c_void_p
    token = planar_model.text.split('"')[3].encode()
    for name in (None, b"", b"  "):
        assert not library.fmi3InstantiateModelExchange(name, token, None, False, True, None, None)
    assert library.fmi3Reset(None) == ERROR
    library.fmi3FreeInstance(None)
    for function in ("fmi3GetFloat64", "fmi3DoStep", "fmi3GetFMUState", "fmi3EnterStepMode"):
        assert getattr(library, function)(None, None, None, None, None, None, None, None) == ERROR


def test_logging(planar_library, planar_model):
    fmu = Instance(planar_library, planar_model).initialize()

    def provoke() -> int:
        count = len(fmu.messages)
        assert fmu.try_step(0.0, -1.0)[0] == ERROR
        return len(fmu.messages) - count

    def categories(on: bool, *names: bytes) -> int:
        array = (ctypes.c_char_p * max(1, len(names)))(*names)
        return fmu.call("SetDebugLogging", on, size(len(names)), array if names else None)

    assert provoke() == 1
    assert categories(False, b"logStatusError") == OK
    assert provoke() == 0
    assert categories(True, b"logStatusWarning") == OK
    assert provoke() == 0
    assert categories(True) == OK
    assert provoke() == 1
    refused(fmu, categories(True, b"logNonsense"), "logNonsense")
    assert categories(False) == OK
    assert provoke() == 0
    silent = Instance(planar_library, planar_model, logging=False).initialize()  # no logger at all
    assert silent.try_step(0.0, -1.0)[0] == ERROR


@pytest.mark.parametrize("kind", ["Directional", "Adjoint"])
def test_derivatives_of_the_wrong_kind(running, kind):
    def ask(unknowns, knowns, n_unknowns, n_knowns) -> int:
        of, by = running.vrs(*unknowns), running.vrs(*knowns)
        n_seed, n_out = (n_knowns, n_unknowns) if kind == "Directional" else (n_unknowns, n_knowns)
        return running.call(
            f"Get{kind}Derivative",
            pointer(of),
            size(len(of)),
            pointer(by),
            size(len(by)),
            pointer(np.ones(99)),
            size(n_seed),
            pointer(np.zeros(99)),
            size(n_out),
        )

    assert ask(["DER_V"], ["FORCE"], 4, 6) == OK
    refused(running, ask(["DER_V"], ["FORCE"], 4, 5), "6 numbers for the knowns but was 5")
    refused(running, ask(["DER_V"], ["FORCE"], 3, 6), "4 numbers for the unknowns but was 3")
    refused(running, ask(["DER_V"], ["POSITION"], 4, 6), "POSITION: Expected an input, state or parameter")
    refused(running, ask(["SUBSTEPS"], ["FORCE"], 1, 6), "SUBSTEPS: Expected a Float64")


def test_what_the_model_does_not_have(running):
    one, values = np.zeros(1, dtype=np.uint32), np.zeros(4)
    for name in (
        "Float32",
        "Int8",
        "UInt8",
        "Int16",
        "UInt16",
        "UInt32",
        "Int64",
        "UInt64",
        "String",
    ):
        for verb in ("Get", "Set"):
            refused(running, running.call(verb + name, pointer(one), size(1), pointer(values), size(1)))
            running.do(verb + name, None, size(0), None, size(0))
    for verb in ("Get", "Set"):
        refused(running, running.call(f"{verb}Boolean", pointer(one), size(1), pointer(values), size(1)))
        running.do(f"{verb}Boolean", None, size(0), None, size(0))
    for name in ("GetClock", "SetClock", "GetBinary", "SetBinary", "GetIntervalDecimal", "SetShiftDecimal"):
        refused(running, running.call(name, pointer(one), size(1), pointer(values), pointer(values), size(1)))
    for name in (
        "EnterConfigurationMode",
        "ExitConfigurationMode",
        "EnterStepMode",
        "EvaluateDiscreteStates",
    ):
        refused(running, running.call(name))
    refused(running, running.call("ActivateModelPartition", 0, number(0.0)))
    refused(running, running.call("GetNumberOfVariableDependencies", 0, pointer(values)))
