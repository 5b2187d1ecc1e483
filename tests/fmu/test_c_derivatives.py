"""Directional and adjoint derivatives against differences of the core's own evaluation, and exact ones."""

from __future__ import annotations

import ctypes
from itertools import pairwise

import numpy as np
import pytest

from linkwind.native.multibody import Multibody
from linkwind.spatial import Motion
from tests.fmu.c_model import OK, Instance, pointer
from tests.fmu.conftest import spatial_mechanism
from tests.fmu.test_c_trajectory import added

OUTPUTS = [
    "DER_Q",
    "DER_V",
    "POSITION",
    "ORIENTATION",
    "LINEAR",
    "ANGULAR",
    "LINEAR_ACCELERATION",
    "ANGULAR_ACCELERATION",
    "REACTION_FORCE",
    "REACTION_TORQUE",
    "KINETIC_ENERGY",
    "POTENTIAL_ENERGY",
]
TOLERANCE = 1e-7


@pytest.fixture
def core():
    return Multibody(spatial_mechanism()[0])


@pytest.fixture
def fmu(spatial_library, spatial_model):
    instance = Instance(spatial_library, spatial_model).initialize()
    instance.set("FORCE", np.linspace(-3.0, 4.0, 15))
    instance.set("TORQUE", np.linspace(1.0, -1.0, 15))
    instance.set("ADDED_INERTIA", added(5))
    yield instance
    instance.free()


def evaluate(core: Multibody, values: dict[str, np.ndarray]) -> np.ndarray:
    """Outputs from the known values, through the binding of the core."""
    state = np.concatenate([values["Q"], values["V"], [0.0]])
    wrench = np.hstack([values["FORCE"].reshape(-1, 3), values["TORQUE"].reshape(-1, 3)])
    found = core.evaluate(
        state, np.ascontiguousarray(wrench), values["ADDED_INERTIA"].reshape(-1, 6, 6).copy()
    )
    motion = Motion.at_rest(core.n)
    core.motion(state, motion)
    rates = (motion.position, motion.orientation, motion.linear, motion.angular)
    six = (found.acceleration, found.reaction)
    parts = [found.joint_acceleration, *rates, *(half for part in six for half in (part[:, :3], part[:, 3:]))]
    return np.concatenate([*(part.ravel() for part in parts), core.energy(state)])


def extrapolated(function, step: float) -> np.ndarray:
    """Derivative at 0 by Richardson's extrapolation of central differences: not the FMU's formula."""
    table = [(function(h) - function(-h)) / (2 * h) for h in (step, step / 2, step / 4)]
    first = [(4 * b - a) / 3 for a, b in pairwise(table)]
    return (16 * first[1] - first[0]) / 15


@pytest.mark.parametrize(
    "knowns", [["FORCE", "TORQUE"], ["Q"], ["V"], ["ADDED_INERTIA"], ["Q", "V", "FORCE"]]
)
def test_directional_adjoint_and_differences_agree(fmu, core, knowns):
    random = np.random.default_rng(sum(map(len, knowns)))
    names = ["FORCE", "TORQUE", "ADDED_INERTIA", "Q", "V"]
    values = {name: fmu.get(name) for name in names}
    seed = random.normal(size=fmu.size(*knowns))
    if knowns == ["ADDED_INERTIA"]:  # keep it symmetric: of its diagonal blocks the core reads one half
        matrix = seed.reshape(-1, 6, 6)
        seed = (matrix + matrix.transpose(0, 2, 1)).ravel()
    at = np.split(seed, np.cumsum([fmu.size(name) for name in knowns])[:-1])

    def moved(distance: float) -> np.ndarray:
        shifted = {name: values[name] + distance * part for name, part in zip(knowns, at, strict=True)}
        return evaluate(core, values | shifted)

    expected = extrapolated(moved, 1e-2)
    outputs = OUTPUTS[1:]
    found = fmu.derivative("Directional", outputs, knowns, seed)
    scale = np.maximum(1.0, np.abs(expected))
    assert np.max(np.abs(found - expected) / scale) < TOLERANCE

    weights = random.normal(size=found.size)
    gradient = fmu.derivative("Adjoint", outputs, knowns, weights)
    assert gradient @ seed == pytest.approx(weights @ found, rel=1e-9, abs=1e-8)


def test_forces_exactly(fmu, core):
    """Accelerations are affine in the wrench: a difference of one newton is the derivative."""
    values = {name: fmu.get(name) for name in ("FORCE", "TORQUE", "ADDED_INERTIA", "Q", "V")}
    base = evaluate(core, values)[: core.nv]
    for k in (0, 7, 14):
        unit = np.eye(15)[k]
        exact = evaluate(core, values | {"FORCE": values["FORCE"] + unit})[: core.nv] - base
        found = fmu.derivative("Directional", ["DER_V"], ["FORCE"], unit)
        np.testing.assert_allclose(found, exact, rtol=1e-10, atol=1e-11)


@pytest.mark.parametrize(
    "parameter", ["MASS", "INERTIA", "GRAVITY", "STIFFNESS", "DAMPING", "REST", "CHILD_POINT"]
)
def test_parameters(fmu, spatial_library, spatial_model, parameter):
    """Against differences of instances that were started with other parameters."""
    seed = np.random.default_rng(4).normal(size=fmu.size(parameter))
    base, names = fmu.get(parameter), ["DER_V", "REACTION_TORQUE", "POTENTIAL_ENERGY"]

    def moved(distance: float) -> np.ndarray:
        other = Instance(spatial_library, spatial_model)
        other.set(parameter, base + distance * seed)
        other.initialize()
        for name in ("FORCE", "TORQUE", "ADDED_INERTIA"):
            other.set(name, fmu.get(name))
        return other.get(*names)

    expected = extrapolated(moved, 2e-3)
    found = fmu.derivative("Directional", names, [parameter], seed)
    scale = np.maximum(1.0, np.abs(expected).max())
    assert np.max(np.abs(found - expected)) < TOLERANCE * scale
    assert fmu.get(parameter).tobytes() == base.tobytes()


def test_nothing_is_left_behind(fmu, spatial_library, spatial_model):
    twin = Instance(spatial_library, spatial_model).initialize()
    for name in ("FORCE", "TORQUE", "ADDED_INERTIA"):
        twin.set(name, fmu.get(name))
    for k in range(20):
        fmu.derivative(
            "Directional", ["DER_V", "POSITION"], ["Q", "MASS"], np.arange(1.0, fmu.size("Q", "MASS") + 1)
        )
        fmu.derivative("Adjoint", ["REACTION_FORCE"], ["V", "STIFFNESS"], np.ones(15))
        for one in (fmu, twin):
            one.step(k * 0.01, 0.01)
    everything = [name for name in fmu.model.sizes if fmu.model.sizes[name]]
    assert fmu.get(*everything).tobytes() == twin.get(*everything).tobytes()


def test_states_and_inputs_as_unknowns(fmu):
    seed = np.arange(1.0, fmu.size("Q", "FORCE") + 1)
    found = fmu.derivative("Directional", ["FORCE", "Q", "V"], ["Q", "FORCE"], seed)
    nq = fmu.size("Q")
    assert found.tolist() == [*seed[nq:], *seed[:nq], *[0.0] * fmu.size("V")]
    assert not fmu.derivative("Directional", OUTPUTS, ["Q"], np.zeros(nq)).any()


def test_output_derivatives_along_the_motion(fmu, spatial_library, spatial_model):
    """Of every output with respect to time, against a short stretch of the motion itself."""
    outputs = [*OUTPUTS, "Q", "V"]
    vrs = fmu.vrs(*outputs)
    orders, found = np.ones(len(vrs), dtype=np.int32), np.zeros(fmu.size(*outputs))
    fmu.do(
        "GetOutputDerivatives",
        pointer(vrs),
        ctypes.c_size_t(len(vrs)),
        pointer(orders),
        pointer(found),
        ctypes.c_size_t(found.size),
    )

    def after(h: float) -> np.ndarray:
        other = Instance(spatial_library, spatial_model).initialize()
        for name in ("FORCE", "TORQUE", "ADDED_INERTIA"):
            other.set(name, fmu.get(name))
        if h:
            other.step(0.0, h)
        return other.get(*outputs)

    h = 1e-4  # one-sided: third-order formula
    expected = (-11 * after(0.0) + 18 * after(h) - 9 * after(2 * h) + 2 * after(3 * h)) / (6 * h)
    np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
    for order in (0, 2):
        assert (
            fmu.call(
                "GetOutputDerivatives",
                pointer(vrs),
                ctypes.c_size_t(len(vrs)),
                pointer(order * orders),
                pointer(found),
                ctypes.c_size_t(found.size),
            )
            != OK
        )
