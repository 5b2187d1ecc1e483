"""FMUs against the service that they come from, through FMPy."""

from __future__ import annotations

import ctypes
import shutil
from itertools import chain

import numpy as np
import pytest
from fmpy import extract, simulate_fmu
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model

from linkwind.fmi.slave import Slave, read_description
from linkwind.log.reader import open_log
from linkwind.mechanism import build
from linkwind.native.multibody import Integrator, Multibody
from linkwind.runs.run import run
from linkwind.scenario import load
from linkwind.spatial import Motion
from tests.fmi.conftest import scenario

POINTER = ctypes.POINTER(ctypes.c_double)
H = 1_000_000 / 1e9
STEPS = 1000
NODE = np.zeros(1)


def spread(slave: Slave, values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return values by the names that this FMU has: arrays, or their elements."""
    found = {}
    for name, value in values.items():
        if name in slave._variables:
            found[name] = value
            continue
        for index in np.ndindex(np.shape(value)):
            found[f"{name}[{','.join(str(i + 1) for i in index)}]"] = np.asarray(value)[index]
    return found


def collect(slave: Slave, names: list[str], sizes: list[int]) -> np.ndarray:
    """Return arrays in a row, whether the FMU has them as arrays or as elements."""
    found = [[name] if name in slave._variables else [f"{name}[{i + 1}]" for i in range(size)]
             for name, size in zip(names, sizes, strict=True)]  # fmt: skip
    return np.concatenate(list(slave.get(list(chain.from_iterable(found))).values()))


def forces(k: int, n: int) -> np.ndarray:
    return 3.0 * np.sin(0.013 * k + np.arange(6.0 * n).reshape(n, 6)) + 0.2 * (k % 7)


def test_thousand_steps_of_the_planar_mechanism_bit_for_bit(fmu):
    _compare_with_the_core(fmu("two_link", "3", "dynamics", "scalar"), "two_link")


def test_thousand_steps_of_the_spatial_mechanism_bit_for_bit(fmu):
    _compare_with_the_core(fmu("spatial", "3"), "spatial")


def _compare_with_the_core(file, name) -> None:
    settings, mechanism = scenario(name).dynamics, build(scenario(name))
    core = Multibody(mechanism.tables)
    state, motion = core.initial_state(mechanism.q0, mechanism.v0), Motion.at_rest(core.n)
    names = [f"{body}.{what}" for what in ("r", "orientation", "v", "w") for body in mechanism.bodies]
    sizes = [size for size in (3, 4, 3, 3) for _ in mechanism.bodies]
    with Slave(file) as slave:
        for k in range(STEPS):
            wrench = forces(k, core.n)
            for i, body in enumerate(mechanism.bodies):
                slave.set(spread(slave, {f"{body}.F": wrench[i, :3], f"{body}.T": wrench[i, 3:]}))
            slave.step(k, H)
            state, _ = core.advance(
                state, H, NODE, wrench[None].copy(), None,
                integrator=Integrator[settings.integrator.upper()], substeps=settings.substeps,
                time=k * 1_000_000 / 1e9,
            )  # fmt: skip
            if k % 50 == 0 or k == STEPS - 1:
                core.motion(state, motion)
                parts = (motion.position, motion.orientation, motion.linear, motion.angular)
                expected = np.concatenate([part.ravel() for part in parts])
                assert collect(slave, names, sizes).tobytes() == expected.tobytes(), k


@pytest.fixture(scope="module")
def explicit_run(tmp_path_factory):
    """The log of a real run of thousand steps: plate forces and added inertia, explicit scheme."""
    changes = ["coupling.scheme=explicit", "bus.transport=inprocess", "time.end=1.0"]
    outcome = run(load("two_link", changes), tmp_path_factory.mktemp("run") / "out", lambda step: None)
    log = open_log(outcome.log)
    states = [message.message for message in log.decoded("/state")]
    wrenches = [message.message for message in log.decoded("/wrench/aero")]
    assert len(states) == len(wrenches) == STEPS + 1
    return states, wrenches


def poses(message) -> bytes:
    parts = (message.position, message.orientation, message.linear, message.angular)
    return np.concatenate([np.array(part) for part in parts]).tobytes()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_cosimulation_is_the_service_s_explicit_run(fmu, explicit_run, fmi):
    """Given the forces that the run exchanged, the FMU moves as the service did, and tells the same."""
    states, wrenches = explicit_run
    bodies = ("link1", "link2")
    motion = [f"{body}.{what}" for what in ("r", "orientation", "v", "w") for body in bodies]
    sizes = [3, 3, 4, 4, 3, 3, 3, 3]
    with Slave(fmu("two_link", fmi)) as slave:
        for k in range(STEPS + 1):
            state, answer = states[k], wrenches[k]
            assert collect(slave, motion, sizes).tobytes() == poses(state.motion), k
            force, torque = (np.reshape(part, (2, 3)) for part in (answer.force, answer.torque))
            added = np.reshape(answer.added_inertia, (2, 6, 6))
            for i, body in enumerate(bodies):
                given = {f"{body}.F": force[i], f"{body}.T": torque[i]}
                slave.set(spread(slave, given | ({f"{body}.A": added[i]} if k == 0 else {})))
            if k % 100 == 0:
                _compare_accelerations(slave, state)
            slave.step(k, H)


def _compare_accelerations(slave: Slave, state) -> None:
    names = ["link1.a", "link1.alpha", "link2.a", "link2.alpha"]
    assert collect(slave, names, [3] * 4).tobytes() == np.array(state.acceleration).tobytes()
    reaction = np.reshape(state.reaction, (2, 6))[1]
    assert collect(slave, ["hinge.F", "hinge.T"], [3, 3]).tobytes() == reaction.tobytes()
    energies = np.array([state.kinetic_energy, state.potential_energy])
    assert collect(slave, ["kinetic_energy", "potential_energy"], [1, 1]).tobytes() == energies.tobytes()


def test_both_halves_together_are_the_explicit_run(fmu, explicit_run):
    """The mechanism's FMU and the force FMU, connected by equal names, are the whole service."""
    states, _ = explicit_run
    names = [f"{body}.{what}" for body in ("link1", "link2") for what in ("r", "orientation", "v", "w")]
    answers = [f"{body}.{what}" for body in ("link1", "link2") for what in ("F", "T", "A")]
    order = [f"{body}.{what}" for what in ("r", "orientation", "v", "w") for body in ("link1", "link2")]
    with Slave(fmu("two_link", "3")) as mechanism, Slave(fmu("two_link", "3", "aero")) as fluid:
        for k in range(STEPS):
            fluid.set(mechanism.get(names))
            mechanism.set(fluid.get(answers))
            mechanism.step(k, H)
            fluid.step(k, H)
        motion = collect(mechanism, order, [3, 3, 4, 4, 3, 3, 3, 3])
    assert motion.tobytes() == poses(states[STEPS].motion)


class Exchange:
    """An instance for Model Exchange, through FMPy."""

    def __init__(self, file, folder) -> None:
        description = read_description(file)
        extract(str(file), str(folder))
        self._two = description.fmiVersion == "2.0"
        self._reference = {v.name: v.valueReference for v in description.modelVariables}
        token = description.guid if self._two else description.instantiationToken
        self.fmu = (FMU2Model if self._two else FMU3Model)(
            guid=token, unzipDirectory=str(folder), modelIdentifier=description.modelExchange.modelIdentifier,
            instanceName="model",
        )  # fmt: skip
        self.fmu.instantiate()
        if self._two:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.fmu.enterContinuousTimeMode()
        self.size = description.numberOfContinuousStates

    def set(self, name: str, value: np.ndarray) -> None:
        if self._two:
            references = [self._reference[f"{name}[{i + 1}]"] for i in range(len(value))]
            self.fmu.setReal(references, value.tolist())
        else:
            self.fmu.setFloat64([self._reference[name]], value.tolist())

    def get(self, names: list[str]) -> np.ndarray:
        references = [self._reference[name] for name in names]
        if self._two:
            return np.array(self.fmu.getReal(references))
        return np.array(self.fmu.getFloat64(references, nValues=self.size))

    def states(self) -> np.ndarray:
        states = np.zeros(self.size)
        self.fmu.getContinuousStates(states.ctypes.data_as(POINTER), self.size)
        return states

    def rate(self, t: float, states: np.ndarray) -> np.ndarray:
        rates = np.zeros(self.size)
        self.fmu.setTime(t)
        self.fmu.setContinuousStates(states.ctypes.data_as(POINTER), self.size)
        get = self.fmu.getDerivatives if self._two else self.fmu.getContinuousStateDerivatives
        get(rates.ctypes.data_as(POINTER), self.size)
        return rates

    def close(self) -> None:
        self.fmu.terminate()
        self.fmu.freeInstance()


@pytest.fixture
def exchange(tmp_path):
    opened = []

    def make(file) -> Exchange:
        opened.append(Exchange(file, tmp_path / "model"))
        return opened[-1]

    yield make
    for model in opened:
        model.close()
    shutil.rmtree(tmp_path / "model")


@pytest.mark.parametrize("name", ["two_link", "spatial"])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_derivatives_are_the_core_s(fmu, exchange, name, fmi):
    mechanism = build(scenario(name))
    core = Multibody(mechanism.tables)
    model = exchange(fmu(name, fmi))
    start = core.initial_state(mechanism.q0, mechanism.v0)
    assert model.states().tobytes() == start[:-1].tobytes()
    wrench = forces(3, core.n)
    for i, body in enumerate(mechanism.bodies):
        model.set(f"{body}.F", wrench[i, :3])
        model.set(f"{body}.T", wrench[i, 3:])
    rates = model.rate(0.1, model.states())
    expected = core.evaluate(core.prescribe(start, 0.1), wrench, time=0.1).joint_acceleration
    assert rates[core.nq :].tobytes() == expected.tobytes()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_order_of_states_is_that_of_the_model_structure(fmu, exchange, fmi):
    """The i-th derivative that the model structure lists is the variable with the i-th value."""
    file = fmu("spatial", fmi)
    model = exchange(file)
    names = [unknown.variable.name for unknown in read_description(file).derivatives]
    rates = model.rate(0.0, model.states())
    assert len(set(rates.tolist())) > len(rates) // 2
    assert model.get(names).tobytes() == rates.tobytes()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_model_exchange_converges_to_cosimulation(fmu, exchange, fmi):
    """Runge-Kutta of order 4 on the derivatives against Dormand-Prince inside, forces held all the time."""
    model, end = exchange(fmu("two_link", fmi)), 0.4
    start = model.states()
    force = np.array([4.0, 30.0, 0.0])
    model.set("link2.F", force)
    solutions = {}
    for steps in (20, 40, 80):
        states, h = start.copy(), end / steps
        for k in range(steps):
            t = k * h
            k1 = model.rate(t, states)
            k2 = model.rate(t + h / 2, states + h / 2 * k1)
            k3 = model.rate(t + h / 2, states + h / 2 * k2)
            k4 = model.rate(t + h, states + h * k3)
            states = states + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        solutions[steps] = states
    errors = {steps: np.abs(states - _exact(force, end)).max() for steps, states in solutions.items()}
    assert np.log2(errors[20] / errors[40]) == pytest.approx(4.0, abs=0.3)
    assert np.log2(errors[40] / errors[80]) == pytest.approx(4.0, abs=0.3)


def _exact(force: np.ndarray, end: float) -> np.ndarray:
    mechanism = build(scenario("two_link"))
    core = Multibody(mechanism.tables)
    wrench = np.zeros((1, 2, 6))
    wrench[0, 1, :3] = force
    state, _ = core.advance(
        core.initial_state(mechanism.q0, mechanism.v0), end, NODE, wrench, None,
        integrator=Integrator.DOPRI5, substeps=1, rtol=1e-13, atol=1e-13,
    )  # fmt: skip
    return state[:-1]


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@pytest.mark.parametrize("fmi", ["2", "3"])
def test_five_lines_with_fmpy(fmu, kind, fmi):
    """A free fall: the centre of mass of both links moves by -g t²/2, whatever they do."""
    result = simulate_fmu(
        str(fmu("two_link", fmi)), stop_time=0.5, output_interval=0.01, fmi_type=kind, relative_tolerance=1e-8
    )
    columns = ("link1.r[2]", "link2.r[2]")
    heights = [result[name] if fmi == "2" else result[name[:7]][:, 1] for name in columns]
    fall = np.mean(heights, axis=0) - np.mean(heights, axis=0)[0]
    np.testing.assert_allclose(fall, -0.5 * 9.81 * result["time"] ** 2, atol=1e-5)
