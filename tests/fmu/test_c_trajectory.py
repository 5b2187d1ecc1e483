"""Co-Simulation steps are the core's, bit for bit; Model Exchange gives its derivatives."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from linkwind.native.multibody import Integrator, Multibody
from linkwind.spatial import Motion
from tests.fmu.c_model import DISCARD, OK, Instance, dynamics, pointer
from tests.fmu.conftest import spatial_mechanism

H = 1_000_000 / 1e9
NODE = np.zeros(1)


def forces(n: int, k: int) -> np.ndarray:
    phase = np.arange(6 * n).reshape(n, 6)
    return 3.0 * np.sin(0.01 * k + phase) + 0.1 * k / 1000


def added(n: int) -> np.ndarray:
    matrix = np.random.default_rng(5).normal(size=(n, 6, 6))
    return np.ascontiguousarray(0.1 * matrix @ matrix.transpose(0, 2, 1))


def set_wrench(fmu: Instance, wrench: np.ndarray) -> None:
    fmu.set("FORCE", wrench[:, :3])
    fmu.set("TORQUE", wrench[:, 3:])


@pytest.mark.parametrize(
    ("integrator", "substeps"),
    [
        (Integrator.RK4, 1),
        (Integrator.RK4, 3),
        (Integrator.EULER, 1),
        (Integrator.SEMI_IMPLICIT_EULER, 2),
        (Integrator.DOPRI5, 1),
        (Integrator.RADAU5, 2),
    ],
)
@pytest.mark.parametrize("mechanism", ["planar", "spatial"])
def test_thousand_steps_bit_for_bit(request, two_link, mechanism, integrator, substeps):
    model = request.getfixturevalue(f"{mechanism}_model")
    fmu = Instance(request.getfixturevalue(f"{mechanism}_library"), model)
    tables, q, v = (
        (two_link.tables, two_link.q0, two_link.v0) if mechanism == "planar" else spatial_mechanism()
    )
    core = Multibody(tables)
    state, motion = core.initial_state(q, v), Motion.at_rest(core.n)
    assert fmu.set_integer("INTEGRATOR", integrator) == fmu.set_integer("SUBSTEPS", substeps) == OK
    fmu.set("Q", state[: core.nq])
    fmu.initialize()
    a = added(core.n) if mechanism == "spatial" else None
    if a is not None:
        fmu.set("ADDED_INERTIA", a)
    for k in range(1000):
        wrench = forces(core.n, k)
        set_wrench(fmu, wrench)
        fmu.step(k * H, H)
        state, _ = core.advance(
            state, H, NODE, wrench[None].copy(), a, integrator=integrator, substeps=substeps
        )
        if k % 100 == 0 or k == 999:
            core.motion(state, motion)
            assert fmu.get("Q", "V").tobytes() == state[:-1].tobytes()
            poses = np.concatenate([part.ravel() for part in (motion.position, motion.orientation)])
            assert fmu.get("POSITION", "ORIENTATION").tobytes() == poses.tobytes()
            evaluation = core.evaluate(state, wrench, a)
            assert fmu.get("DER_V").tobytes() == evaluation.joint_acceleration.tobytes()
            assert fmu.get("REACTION_FORCE").tobytes() == evaluation.reaction[:, :3].tobytes()
            assert fmu.get("REACTION_TORQUE").tobytes() == evaluation.reaction[:, 3:].tobytes()
            assert fmu.get("LINEAR_ACCELERATION").tobytes() == evaluation.acceleration[:, :3].tobytes()
            assert fmu.get("KINETIC_ENERGY", "POTENTIAL_ENERGY").tolist() == list(core.energy(state))
    assert not fmu.messages
    fmu.free()


def test_parameter_changed_between_steps(planar_library, planar_model, two_link):
    fmu = Instance(planar_library, planar_model).initialize()
    fmu.step(0.0, H)
    mass = np.array([1.5, 0.25])
    fmu.set("MASS", mass)
    fmu.step(H, H)
    core, heavier = (
        Multibody(two_link.tables),
        Multibody(type(two_link.tables)(**{**vars(two_link.tables), "mass": mass})),
    )
    state = core.initial_state(two_link.q0, two_link.v0)
    for one in (core, heavier):
        state, _ = one.advance(state, H, NODE, np.zeros((1, 2, 6)), None, integrator=2)
    assert fmu.get("Q", "V").tobytes() == state[:-1].tobytes()
    fmu.free()


def test_intermediate_updates_leave_the_trajectory_alone(spatial_library, spatial_model):
    seen = []

    def update(_environment, time, set_requested, get_allowed, finished, can_return, _wish, _when):
        seen.append((time, set_requested, get_allowed, finished, can_return))
        fmus[1].get("POSITION")

    fmus = [Instance(spatial_library, spatial_model), Instance(spatial_library, spatial_model, update=update)]
    for fmu in fmus:
        fmu.set_integer("SUBSTEPS", 4)
        fmu.initialize()
        fmu.set("FORCE", np.linspace(-3.0, 3.0, 15))
        for k in range(5):
            fmu.step(k * 0.01, 0.01)
    assert fmus[0].get("Q", "V").tobytes() == fmus[1].get("Q", "V").tobytes()
    assert [row[1:] for row in seen[:4]] == [(True, True, True, False)] * 3 + [(False, True, True, False)]
    np.testing.assert_allclose([row[0] for row in seen], np.arange(1, 21) * 0.0025, rtol=1e-14)


def test_early_return(spatial_library, spatial_model):
    def update(_environment, time, _set, _get, _finished, can_return, wish, when):
        if can_return:
            wish[0], when[0] = True, 0.004

    fmu = Instance(spatial_library, spatial_model, update=update, early=True)
    fmu.set_integer("SUBSTEPS", 5)
    fmu.initialize()
    assert fmu.try_step(0.0, 0.01) == (OK, True, 0.004)
    plain = Instance(spatial_library, spatial_model)
    plain.set_integer("SUBSTEPS", 2)
    plain.initialize().step(0.0, 0.004)
    np.testing.assert_allclose(fmu.get("Q", "V"), plain.get("Q", "V"), rtol=1e-13, atol=1e-13)
    assert fmu.try_step(0.0, 0.01)[0] != OK
    assert "Expected currentCommunicationPoint = 0.004" in fmu.messages[-1][2]


def test_inputs_set_in_the_callback_hold_from_then_on(planar_library, planar_model):
    push = np.array([0.0, 4.0, 0.0, 0.0, 0.0, 0.0])

    def update(_environment, _time, set_requested, *_):
        if set_requested:
            fmu.set("FORCE", push)
        else:
            assert fmu.try_set("FORCE", push) != OK

    fmu = Instance(planar_library, planar_model, update=update)
    fmu.set_integer("SUBSTEPS", 2)
    fmu.initialize().step(0.0, 0.01)
    plain = Instance(planar_library, planar_model).initialize()
    plain.step(0.0, 0.005)
    plain.set("FORCE", push)
    plain.step(0.005, 0.005)
    assert fmu.get("Q", "V").tobytes() == plain.get("Q", "V").tobytes()


def test_a_step_that_fails_changes_nothing(planar_library, planar_model):
    fmu = Instance(planar_library, planar_model).initialize()
    fmu.step(0.0, H)
    before = fmu.get("Q", "V")
    fmu.set("FORCE", np.full(6, 1e300))
    status, _, last = fmu.try_step(H, 1e10)
    assert (status, last) == (DISCARD, H)
    assert fmu.messages[-1][1] == "logStatusDiscard"
    assert fmu.get("Q", "V").tobytes() == before.tobytes()
    fmu.set("FORCE", np.zeros(6))
    fmu.step(H, H)


def test_model_exchange_with_rk4_is_cosimulation(spatial_library, spatial_model):
    """The classical scheme written here, on the FMU's derivatives, against doStep."""
    exchange = Instance(spatial_library, spatial_model, exchange=True).initialize()
    steps = Instance(spatial_library, spatial_model).initialize()
    force = np.linspace(-2.0, 2.0, 15)
    exchange.do("EnterContinuousTimeMode")
    for fmu in (exchange, steps):
        fmu.set("FORCE", force)
    x = exchange.get("Q", "V")
    size = ctypes.c_size_t(x.size)

    def rate(at: np.ndarray) -> np.ndarray:
        at, out = np.ascontiguousarray(at), np.zeros(x.size)
        exchange.do("SetContinuousStates", pointer(at), size)
        exchange.do("GetContinuousStateDerivatives", pointer(out), size)
        return out

    h = 1e-4
    for k in range(20):
        k1 = rate(x)
        k2 = rate(x + h / 2 * k1)
        k3 = rate(x + h / 2 * k2)
        k4 = rate(x + h * k3)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        steps.step(k * h, h)
    np.testing.assert_allclose(x, steps.get("Q", "V"), rtol=0, atol=1e-13)
    exchange.free()


def test_scalars_and_arrays_are_the_same_values(compiler, two_link, planar_library, planar_model):
    model = dynamics(two_link.tables, two_link.q0, two_link.v0, scalar=True)
    library = compiler.library(model, 3, "planar_scalar")
    one, other = Instance(library, model).initialize(), Instance(planar_library, planar_model).initialize()
    assert len(model.references["INERTIA"]) == 12
    for fmu in (one, other):
        fmu.set("TORQUE", np.arange(6.0))
        fmu.step(0.0, H)
    names = [name for name in model.sizes if model.sizes[name]]
    assert one.get(*names).tobytes() == other.get(*names).tobytes()
