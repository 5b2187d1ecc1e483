"""Inputs of force elements, and events on command: FMPy as a controller of an arm."""

from __future__ import annotations

from ctypes import POINTER, c_double
from functools import cache

import numpy as np
import pytest
from fmpy import simulate_fmu
from fmpy.fmi1 import FMICallException
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.dynamics.plant import MechanismPlant
from linkwind.fmi.slave import Slave, read_description
from linkwind.mechanism import build
from linkwind.native.multibody import Integrator, Multibody
from linkwind.scenario import loads
from linkwind.spatial import Motion
from tests.fmi.conftest import scenario
from tests.fmi.scenes import SERVO
from tests.fmi.test_trajectories import NODE, H, collect, exchange  # noqa: F401

BODIES = ("upper", "lower", "load")
MOTION = [f"{body}.{what}" for what in ("r", "orientation", "v", "w") for body in BODIES]
SIZES = [size for size in (3, 4, 3, 3) for _ in BODIES]
BRAKE, DROP = 0.1, 0.25  # s
KP, KD, TARGET = 20.0, 2.0, 0.3
END = 0.4
FORMS = pytest.mark.parametrize("fmi", ["2", "3"])


def poses(multibody: Multibody, state: np.ndarray) -> bytes:
    motion = Motion.at_rest(multibody.n)
    multibody.motion(state, motion)
    parts = (motion.position, motion.orientation, motion.linear, motion.angular)
    return np.concatenate([part.ravel() for part in parts]).tobytes()


def of(slave: Slave, name: str) -> float:
    return float(slave.get([name])[name][0])


# ---- without anybody who sets them, and with values of their own ----


@FORMS
def test_with_inputs_at_their_start_and_commands_the_bits_are_those_of_a_run(fmu, fmi):
    """Commands at communication points, as `linkwind happen` gives them to a run."""
    plant = MechanismPlant(build(scenario("servo")), scenario("servo"), lambda: "")
    plant.order(0, round(BRAKE / H))
    plant.order(1, round(DROP / H))
    state, calm = plant.initial, np.zeros((1, 3, 6))
    with Slave(fmu("servo", fmi)) as slave:
        for k in range(round(END / H)):
            commands = {"brake.command": k * H >= BRAKE - H / 2, "drop.command": k * H >= DROP - H / 2}
            slave.set({name: np.array(value) for name, value in commands.items()})
            slave.step(k, H)
            state = plant.advance(state, NODE, calm, None)
            assert collect(slave, MOTION, SIZES).tobytes() == poses(plant.multibody, state.values), k
        assert of(slave, "brake.time") == state.values[-2] == pytest.approx(BRAKE, abs=1e-12)
        assert of(slave, "drop.time") == state.values[-1] == pytest.approx(DROP, abs=1e-12)


def given(k: int) -> np.ndarray:
    """Values of all inputs in step k."""
    return np.array([3.0 * np.sin(0.1 * k), 0.5 + 0.1 * np.cos(0.2 * k), 2.0, 0.02 * k])


@FORMS
def test_inputs_are_held_over_a_step_as_the_core_holds_them(fmu, fmi):
    mechanism = build(scenario("servo"))
    names = [f"{mechanism.forces[i]}.{name}" for i, name in mechanism.inputs]
    assert names == ["motor.u", "spring.gain", "spring.target", "jet.throttle"]
    core = Multibody(mechanism.tables)
    state = core.initial_state(mechanism.q0, mechanism.v0)
    with Slave(fmu("servo", fmi)) as slave:
        for k in range(200):
            slave.set(dict(zip(names, given(k), strict=True)))
            slave.step(k, H)
            state, _ = core.advance(
                state, H, NODE, np.zeros((1, 3, 6)), None, integrator=Integrator.RK4,
                time=k * 1_000_000 / 1e9, inputs=given(k)[None],
            )  # fmt: skip
        assert collect(slave, MOTION, SIZES).tobytes() == poses(core, state)
        effort = core.evaluate(state, np.zeros((3, 6)), time=0.2).effort  # of the inputs at the start
        assert of(slave, "motor.effort") - given(199)[0] == pytest.approx(effort[0], abs=1e-12)


def test_the_run_of_a_scenario_with_other_values_is_that_of_the_fmu(fmu):
    """`--set forces.motor.inputs.u=0.7` is an input that is 0.7 all the time."""
    other = loads(SERVO, "servo.toml", ["forces.motor.inputs.u=0.7"])
    mechanism = build(other)
    core = Multibody(mechanism.tables)
    state = core.initial_state(mechanism.q0, mechanism.v0)
    with Slave(fmu("servo", "3")) as slave:
        for k in range(50):
            slave.set({"motor.u": np.array(0.7)})
            slave.step(k, H)
            state, _ = core.advance(
                state, H, NODE, np.zeros((1, 3, 6)), None, integrator=Integrator.RK4, time=k * 1e6 / 1e9
            )
        assert collect(slave, MOTION, SIZES).tobytes() == poses(core, state)


def test_inputs_with_derivatives_are_polynomials_in_time(fmu):
    """Of FMI 2, up to the third order: against the same cubic at four nodes."""
    mechanism, h = build(scenario("servo")), 0.05
    core = Multibody(mechanism.tables)
    nodes, factors = np.array([0.0, 0.4, 0.7, 1.0]), (1.0, -20.0, 300.0, 4000.0)
    inputs = np.tile(mechanism.tables.force_constants[mechanism.tables.force_input], (4, 1))
    inputs[:, 0] = [sum(f * (s * h) ** k / max(1, k * (k - 1)) for k, f in enumerate(factors)) for s in nodes]
    state, _ = core.advance(
        core.initial_state(mechanism.q0, mechanism.v0), h, nodes, np.zeros((4, 3, 6)), None,
        integrator=Integrator.RK4, inputs=inputs,
    )  # fmt: skip
    with Slave(fmu("servo", "2")) as slave:
        slave.set({"motor.u": np.array(factors[0])})
        reference = [slave._variables["motor.u"].valueReference]
        for order in (1, 2, 3):
            slave._fmu.setRealInputDerivatives(reference, [order], [factors[order]])
        slave.step(0, h)
        expected = np.frombuffer(poses(core, state))
        np.testing.assert_allclose(collect(slave, MOTION, SIZES), expected, rtol=0, atol=1e-13)


# ---- a controller ----


@cache
def controlled() -> np.ndarray:
    """Shoulder and elbow angle at the end, with the controller's law as the actuator's expression."""
    law = f'force = "{KP}*({TARGET} - q) - {KD}*v - 0.05*v"'
    mechanism = build(loads(SERVO.replace('inputs = { u = 0.0 }\nforce = "u - 0.05*v"', law), "servo.toml"))
    core = Multibody(mechanism.tables)
    state, _ = core.advance(
        core.initial_state(mechanism.q0, mechanism.v0), END, NODE, np.zeros((1, 3, 6)), None,
        integrator=Integrator.DOPRI5, rtol=1e-13, atol=1e-13,
    )  # fmt: skip
    return state[:2]


def torque(q: float, v: float) -> float:
    return KP * (TARGET - q) - KD * v


def orders(errors: list[float]) -> np.ndarray:
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def flight(file, steps: int, prepare) -> float:
    """Return the error at the end of steps before each of which the controller acts."""
    with Slave(file) as slave:
        for k in range(steps):
            prepare(slave, of(slave, "shoulder.q"), of(slave, "shoulder.v"))
            slave.step(k, END / steps)
        return float(np.abs([of(slave, "shoulder.q"), of(slave, "elbow.q")] - controlled()).max())


@FORMS
def test_a_controller_whose_torque_is_held_is_of_first_order(fmu, fmi):
    def hold(slave, q, v):
        slave.set({"motor.u": np.array(torque(q, v))})

    errors = [flight(fmu("servo", fmi), steps, hold) for steps in (100, 200, 400)]
    assert orders(errors) == pytest.approx([1.0, 1.0], abs=0.2)
    assert errors[-1] < 2e-3


def test_a_controller_that_gives_its_derivative_is_of_second_order(fmu):
    def predict(slave, q, v):
        slave.set({"motor.u": np.array(torque(q, v))})
        rate = -KP * v - KD * of(slave, "der(shoulder.v)")
        slave._fmu.setRealInputDerivatives([slave._variables["motor.u"].valueReference], [1], [rate])

    errors = [flight(fmu("servo", "2"), steps, predict) for steps in (100, 200, 400)]
    assert orders(errors) == pytest.approx([2.0, 2.0], abs=0.2)
    assert errors[-1] < 2e-5


@FORMS
def test_a_controller_in_model_exchange_is_as_good_as_its_solver(fmu, exchange, fmi):  # noqa: F811
    file = fmu("servo", fmi)
    model = exchange(file)
    reference = {v.name: v.valueReference for v in read_description(file).modelVariables}
    get, put = (getattr(model.fmu, f"{verb}{'Real' if fmi == '2' else 'Float64'}") for verb in ("get", "set"))

    def rate(t: float, states: np.ndarray) -> np.ndarray:
        model.fmu.setTime(t)
        model.fmu.setContinuousStates(states.ctypes.data_as(POINTER(c_double)), model.size)
        put([reference["motor.u"]], [torque(*get([reference["shoulder.q"], reference["shoulder.v"]]))])
        return model.rate(t, states)

    start, errors = model.states(), []
    for steps in (50, 100, 200):
        states, h = start.copy(), END / steps
        for k in range(steps):
            t = k * h
            k1 = rate(t, states)
            k2 = rate(t + h / 2, states + h / 2 * k1)
            k3 = rate(t + h / 2, states + h / 2 * k2)
            states = states + h / 6 * (k1 + 2 * k2 + 2 * k3 + rate(t + h, states + h * k3))
        errors.append(np.abs(states[:2] - controlled()).max())
    assert orders(errors) == pytest.approx([4.0, 4.0], abs=0.4)


@FORMS
def test_derivatives_by_inputs(fmu, fmi):
    """Of accelerations, against torques of 1 N·m; the spring's is a sine of its target."""
    mechanism = build(scenario("servo"))
    core = Multibody(mechanism.tables)
    state = core.initial_state(mechanism.q0, mechanism.v0)
    q, calm = core.coordinates(state)[0], np.zeros((3, 6))

    def pushed(name: str) -> np.ndarray:
        text = SERVO.replace(f'"{law[name]}"', f'"{law[name]} + 1"')
        return Multibody(build(loads(text, "servo.toml")).tables).evaluate(state, calm).joint_acceleration

    law = {"motor": "u - 0.05*v", "spring": "gain*sin(target - q) - 0.1*v"}
    base = core.evaluate(state, calm).joint_acceleration
    with Slave(fmu("servo", fmi)) as slave:
        rates = [v for v in slave._variables if v.startswith("der(") and ".v" in v]
        where = {name: slave._variables[name].valueReference for name in [*rates, "motor.u", "spring.target"]}
        function = slave._fmu.getDirectionalDerivative
        for known, name, factor in (
            ("motor.u", "motor", 1.0),
            ("spring.target", "spring", 2.0 * np.cos(0.4 - q[1])),
        ):
            expected = factor * (pushed(name) - base)
            unknowns = [where[rate] for rate in rates]
            if fmi == "2":
                found = function(unknowns, [where[known]], [1.0])
            else:
                found = np.zeros(len(expected))
                found = slave._fmu.getDirectionalDerivative(unknowns, [where[known]], [1.0], len(expected))
            np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


# ---- commands ----


def signals(*rows):
    return np.array(list(rows), dtype=[("time", float), ("brake.command", bool), ("motor.u", float)])


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
@FORMS
def test_five_lines_with_fmpy(fmu, fmi, kind):
    """A command and a torque as input signals; the elbow keeps its angle from then on."""
    result = simulate_fmu(
        str(fmu("servo", fmi)), fmi_type=kind, stop_time=0.3, output_interval=0.01, step_size=0.01,
        input=signals((0.0, False, 1.0), (0.1, False, 1.0), (0.1, True, 1.0), (0.3, True, 1.0)),
        output=["brake.time", "elbow.q", "shoulder.q"], relative_tolerance=1e-9,
    )  # fmt: skip
    before, after = result[result["time"] < 0.095], result[result["time"] > 0.115]
    assert result["brake.time"][-1] == pytest.approx(0.1, abs=0.0101 if kind == "CoSimulation" else 1e-9)
    assert (before["brake.time"] == -1.0).all()
    assert np.ptp(before["elbow.q"]) > 0.01
    assert np.ptp(after["elbow.q"]) < 1e-12
    assert np.ptp(after["shoulder.q"]) > 0.01


def command(slave: Slave, value: bool, name: str = "drop") -> None:
    slave.set({f"{name}.command": np.array(value)})


@FORMS
def test_an_event_happens_once_at_the_first_rising_edge(fmu, fmi):
    with Slave(fmu("servo", fmi)) as slave:
        command(slave, True)
        command(slave, False)  # no step has seen it
        slave.step(0, H)
        assert of(slave, "drop.time") == -1.0
        command(slave, True)
        slave.step(1, H)
        assert of(slave, "drop.time") == pytest.approx(H, abs=1e-12)
        for k, value in enumerate((False, True, True)):
            command(slave, value)
            slave.step(2 + k, H)
        assert of(slave, "drop.time") == pytest.approx(H, abs=1e-12)
        assert of(slave, "brake.time") == -1.0


@FORMS
def test_commands_belong_to_the_state(fmu, fmi):
    get, set_ = ("getFMUstate", "setFMUstate") if fmi == "2" else ("getFMUState", "setFMUState")
    with Slave(fmu("servo", fmi)) as slave:
        slave.step(0, H)
        command(slave, True)
        waiting = getattr(slave._fmu, get)()
        slave.step(1, H)
        dropped, end = getattr(slave._fmu, get)(), collect(slave, MOTION, SIZES).tobytes()
        for state, time in ((waiting, -1.0), (dropped, H)):
            getattr(slave._fmu, set_)(state)
            assert of(slave, "drop.time") == pytest.approx(time, abs=1e-12)
        getattr(slave._fmu, set_)(waiting)
        slave.step(1, H)
        assert collect(slave, MOTION, SIZES).tobytes() == end
        slave._fmu.reset()
        slave._initialize(0.0)
        slave.step(0, H)
        assert of(slave, "drop.time") == -1.0


@FORMS
def test_a_step_that_fails_has_not_seen_the_command(fmu, fmi):
    with Slave(fmu("servo", fmi)) as slave:
        command(slave, True)
        slave.set({"motor.u": np.array(1e300)})
        with pytest.raises(FMICallException):
            slave.step(0, H)
        slave.set({"motor.u": np.array(0.0)})
        assert of(slave, "drop.time") == -1.0
        slave.step(0, H)
        assert of(slave, "drop.time") == pytest.approx(0.0, abs=1e-12)


@FORMS
def test_a_command_in_model_exchange_counts_from_the_next_event_on(fmu, exchange, fmi):  # noqa: F811
    """Also one that is set in Continuous-Time Mode, as FMPy does."""
    file = fmu("servo", fmi)
    model = exchange(file)
    reference = {v.name: v.valueReference for v in read_description(file).modelVariables}

    def dropped() -> float:
        get = model.fmu.getReal if fmi == "2" else model.fmu.getFloat64
        return get([reference["drop.time"]])[0]

    model.fmu.setTime(0.2)
    model.fmu.setBoolean([reference["drop.command"]], [True])
    assert list(model.fmu.getBoolean([reference["drop.command"]])) == [True]
    assert dropped() == -1.0
    model.fmu.enterEventMode()
    assert dropped() == -1.0
    event = model.fmu.newDiscreteStates() if fmi == "2" else model.fmu.updateDiscreteStates()
    assert dropped() == 0.2
    assert event[3]  # values of continuous states have changed: the joint is a free one


def test_info_shows_inputs_and_commands(fmu):
    done = CliRunner().invoke(app, ["fmu", "info", str(fmu("servo", "3"))], env={"COLUMNS": "200"})
    rows = {line.split()[1]: line for line in done.stdout.splitlines() if line.startswith("│")}
    assert "Boolean" in rows["drop.command"]
    assert "discrete" in rows["drop.command"]
    assert "Lets drop happen when it becomes true" in rows["drop.command"]
    assert "input" in rows["motor.u"]
    assert "0.4" in rows["spring.target"]


def test_documentation_shows_the_laws_that_use_them(unpacked):
    page = (unpacked("servo", "dynamics", "2", "native") / "documentation" / "index.html").read_text()
    for text in ("gain*sin(target - q) - 0.1*v", "<td>motor</td><td>actuator</td>", "drop.command", "false"):
        assert text in page
