"""What FMI 2 has of its own: derivatives of inputs and outputs, the step's status, its logger."""

from __future__ import annotations

import ctypes
from math import factorial

import numpy as np
import pytest

from linkwind.native.multibody import Multibody
from tests.fmu.c_model import DISCARD, ERROR, OK, TOKEN, WARNING, dynamics, pointer

H = 0.01
Logger2 = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_char_p, ctypes.c_char_p
)  # variadic in C; nothing follows the message


class Callbacks(ctypes.Structure):
    _fields_ = [
        ("logger", ctypes.c_void_p),
        *[(name, ctypes.c_void_p) for name in ("a", "f", "s")],
        ("environment", ctypes.c_void_p),
    ]


class Instance2:
    def __init__(self, library, model, *, exchange=False) -> None:
        self.library, self.model, self.messages = ctypes.CDLL(str(library)), model, []
        self._logger = Logger2(
            lambda _e, _n, status, category, text: self.messages.append(
                (status, category.decode(), text.decode())
            )
        )
        self._callbacks = Callbacks(ctypes.cast(self._logger, ctypes.c_void_p))
        instantiate = self.library.fmi2Instantiate
        instantiate.restype = ctypes.c_void_p
        kind = 0 if exchange else 1
        self.at = ctypes.c_void_p(
            instantiate(b"two", kind, TOKEN.encode(), None, ctypes.byref(self._callbacks), False, True)
        )

    def call(self, name, *arguments) -> int:
        return getattr(self.library, f"fmi2{name}")(self.at, *arguments)

    def do(self, name, *arguments) -> None:
        status = self.call(name, *arguments)
        assert status == OK, (name, status, self.messages[-1:])

    def initialize(self) -> Instance2:
        zero = ctypes.c_double(0.0)
        self.do("SetupExperiment", False, zero, zero, False, zero)
        self.do("EnterInitializationMode")
        self.do("ExitInitializationMode")
        return self

    def vrs(self, *sections) -> np.ndarray:
        return np.array([r for s in sections for r in self.model.references[s]], dtype=np.uint32)

    def get(self, *sections) -> np.ndarray:
        vrs = self.vrs(*sections)
        values = np.zeros(len(vrs))
        self.do("GetReal", pointer(vrs), ctypes.c_size_t(len(vrs)), pointer(values))
        return values

    def set(self, section, values) -> None:
        vrs, values = self.vrs(section), np.ascontiguousarray(np.ravel(values), float)
        self.do("SetReal", pointer(vrs), ctypes.c_size_t(len(vrs)), pointer(values))

    def set_derivative(self, section, order: int, values) -> int:
        vrs, values = self.vrs(section), np.ascontiguousarray(np.ravel(values), float)
        orders = np.full(len(vrs), order, dtype=np.int32)
        return self.call(
            "SetRealInputDerivatives",
            pointer(vrs),
            ctypes.c_size_t(len(vrs)),
            pointer(orders),
            pointer(values),
        )

    def step(self, point, size) -> int:
        return self.call("DoStep", ctypes.c_double(point), ctypes.c_double(size), True)


@pytest.fixture(scope="module")
def model(two_link):
    return dynamics(two_link.tables, two_link.q0, two_link.v0, scalar=True)


@pytest.fixture(scope="module")
def library(compiler, model):
    return compiler.library(model, 2, "two_link_2")


@pytest.fixture
def fmu(library, model):
    instance = Instance2(library, model).initialize()
    yield instance
    instance.call("FreeInstance")


@pytest.mark.parametrize("order", [1, 2, 3])
def test_input_derivatives_are_a_polynomial_in_time(fmu, two_link, order):
    """Against the core with the polynomial sampled at other nodes than the FMU's."""
    core = Multibody(two_link.tables)
    coefficients = np.random.default_rng(order).normal(size=(order + 1, 2, 6)) * [[[10.0]]]
    wrench = lambda t: sum(c * t**k / factorial(k) for k, c in enumerate(coefficients))  # noqa: E731
    nodes = np.linspace(-1.0, 2.0, order + 1)
    state = core.initial_state(two_link.q0, two_link.v0)
    samples = np.stack([wrench(node * H) for node in nodes])
    expected, _ = core.advance(state, H, nodes, samples, None, integrator=2, substeps=2)
    vr = np.array(fmu.vrs("SUBSTEPS"))
    fmu.do("SetInteger", pointer(vr), ctypes.c_size_t(1), pointer(np.array([2], dtype=np.int32)))
    for section, half in (("FORCE", slice(0, 3)), ("TORQUE", slice(3, 6))):
        fmu.set(section, coefficients[0][:, half])
        for k in range(1, order + 1):
            assert fmu.set_derivative(section, k, coefficients[k][:, half]) == OK
    assert fmu.step(0.0, H) == OK
    np.testing.assert_allclose(fmu.get("Q", "V"), expected[:-1], rtol=1e-14, atol=1e-14)
    held, _ = core.advance(expected, H, np.zeros(1), coefficients[:1], None, integrator=2, substeps=2)
    assert fmu.step(H, H) == OK  # derivatives were those of one step
    np.testing.assert_allclose(fmu.get("Q", "V"), held[:-1], rtol=1e-13, atol=1e-13)


def test_input_derivatives_belong_to_the_state(fmu):
    fmu.set("FORCE", np.ones(6))
    assert fmu.set_derivative("FORCE", 2, np.arange(6.0)) == OK
    handle = ctypes.c_void_p()
    fmu.do("GetFMUstate", ctypes.byref(handle))
    assert fmu.step(0.0, H) == OK
    after = fmu.get("Q", "V")
    fmu.do("SetFMUstate", handle)
    assert fmu.step(0.0, H) == OK
    assert fmu.get("Q", "V").tobytes() == after.tobytes()


def test_wrong_input_derivatives(fmu):
    assert fmu.set_derivative("ADDED_INERTIA", 1, np.ones(72)) == WARNING
    assert "held" in fmu.messages[-1][2]
    for section, order, values in (
        ("MASS", 1, [1.0, 1.0]),
        ("FORCE", 0, np.ones(6)),
        ("FORCE", 4, np.ones(6)),
        ("FORCE", 1, np.full(6, np.nan)),
    ):
        assert fmu.set_derivative(section, order, values) == ERROR
        assert section in fmu.messages[-1][2]


def test_output_derivatives(fmu):
    vrs, values = fmu.vrs("POSITION", "ANGULAR"), np.zeros(12)
    orders = np.ones(12, dtype=np.int32)
    size = ctypes.c_size_t(12)
    fmu.do("GetRealOutputDerivatives", pointer(vrs), size, pointer(orders), pointer(values))
    assert values.tobytes() == fmu.get("LINEAR", "ANGULAR_ACCELERATION").tobytes()
    for order in (0, 2):
        assert (
            fmu.call("GetRealOutputDerivatives", pointer(vrs), size, pointer(order * orders), pointer(values))
            == ERROR
        )


def test_status_of_the_last_step(fmu):
    status, when, flag = ctypes.c_int(9), ctypes.c_double(), ctypes.c_int(9)
    assert fmu.step(0.0, H) == OK
    assert fmu.step(0.0, H) == ERROR
    fmu.do("GetStatus", 0, ctypes.byref(status))
    fmu.do("GetRealStatus", 2, ctypes.byref(when))
    fmu.do("GetBooleanStatus", 3, ctypes.byref(flag))
    assert (status.value, when.value, flag.value) == (ERROR, H, 0)
    for name in ("GetStatus", "GetRealStatus", "GetIntegerStatus", "GetBooleanStatus", "GetStringStatus"):
        assert fmu.call(name, 1, ctypes.byref(status)) == DISCARD
        assert fmu.call(name, 1, None) == ERROR
    assert fmu.call("CancelStep") == ERROR


def test_percent_signs_are_safe_in_a_format(compiler, two_link):
    plain = dynamics(two_link.tables, two_link.q0, two_link.v0, scalar=True)
    model = type(plain)(**{**vars(plain), "text": plain.text.replace("FORCE[0]", "100%n%s")})
    fmu = Instance2(compiler.library(model, 2, "percent"), model).initialize()
    vrs = fmu.vrs("FORCE")
    assert fmu.call("SetReal", pointer(vrs), ctypes.c_size_t(1), pointer(np.array([np.nan]))) == ERROR
    assert fmu.messages[-1][2] == "fmi2SetReal: 100%%n%%s: Expected a finite number but was nan."


def test_model_exchange(library, model):
    fmu = Instance2(library, model, exchange=True)
    assert fmu.call("GetReal", None, ctypes.c_size_t(0), None) == ERROR  # not before initialization
    fmu.initialize()
    assert fmu.step(0.0, H) == ERROR
    info = (ctypes.c_char * 32)(*b"\xff" * 32)
    fmu.do("NewDiscreteStates", info)
    assert bytes(info)[:20] == bytes(20)
    fmu.do("EnterContinuousTimeMode")
    x, rates, nominals = np.zeros(8), np.zeros(8), np.zeros(8)
    fmu.do("GetContinuousStates", pointer(x), ctypes.c_size_t(8))
    fmu.do("GetDerivatives", pointer(rates), ctypes.c_size_t(8))
    fmu.do("GetNominalsOfContinuousStates", pointer(nominals), ctypes.c_size_t(8))
    assert x.tobytes() == fmu.get("Q", "V").tobytes()
    assert rates.tobytes() == fmu.get("DER_Q", "DER_V").tobytes()
    assert (nominals > 0).all()
    enter, stop = ctypes.c_int(9), ctypes.c_int(9)
    fmu.do("CompletedIntegratorStep", True, ctypes.byref(enter), ctypes.byref(stop))
    assert (enter.value, stop.value) == (0, 0)


def test_instantiate_without_callbacks(library):
    handle = ctypes.CDLL(str(library))
    handle.fmi2Instantiate.restype = ctypes.c_void_p
    at = handle.fmi2Instantiate(b"x", 1, TOKEN.encode(), None, None, False, True)
    assert at
    assert handle.fmi2DoStep(ctypes.c_void_p(at), ctypes.c_double(0), ctypes.c_double(1), False) == ERROR
    handle.fmi2FreeInstance(ctypes.c_void_p(at))
    assert not handle.fmi2Instantiate(b"x", 7, TOKEN.encode(), None, None, False, True)
    assert not handle.fmi2Instantiate(b"x", 1, b"{wrong}", None, None, False, True)
