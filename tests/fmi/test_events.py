"""Loops and events in FMUs: Co-Simulation against the core, Model Exchange under a solver of its own."""

import numpy as np
import pytest
from fmpy import simulate_fmu

from linkwind.fmi.slave import Slave
from linkwind.mechanism import build
from linkwind.native.multibody import Integrator, Multibody
from linkwind.spatial import Motion
from tests.fmi.conftest import scenario
from tests.fmi.test_trajectories import NODE, H, collect

END = 0.4


@pytest.fixture(scope="module")
def flown():
    """The core's states every millisecond, and the mechanism."""
    mechanism = build(scenario("eventful"))
    core = Multibody(mechanism.tables)
    states, calm = [core.initial_state(mechanism.q0, mechanism.v0)], np.zeros((1, core.n, 6))
    for k in range(round(END / H)):
        time = k * 1_000_000 / 1e9
        state, _ = core.advance(states[-1], H, NODE, calm, None, integrator=Integrator.RK4, time=time)
        states.append(state)
    return mechanism, core, states


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_cosimulation_has_the_bits_of_the_core(fmu, flown, fmi):
    mechanism, core, states = flown
    names = [f"{body}.{what}" for what in ("r", "orientation", "v", "w") for body in mechanism.bodies]
    sizes = [size for size in (3, 4, 3, 3) for _ in mechanism.bodies]
    motion = Motion.at_rest(core.n)
    with Slave(fmu("eventful", fmi)) as slave:
        assert slave.get(["drop.time"])["drop.time"] == -1.0
        for k in range(len(states) - 1):
            slave.step(k, H)
            if k % 40 == 0 or k == len(states) - 2:
                core.motion(states[k + 1], motion)
                parts = (motion.position, motion.orientation, motion.linear, motion.angular)
                expected = np.concatenate([part.ravel() for part in parts])
                assert collect(slave, names, sizes).tobytes() == expected.tobytes(), k
        assert slave.get(["drop.time"])["drop.time"] == pytest.approx(0.1234, abs=1e-15)
        reaction = core.evaluate(states[-1], np.zeros((core.n, 6))).closure_reaction[0, :3]
        assert collect(slave, ["loop.F"], [3]).tobytes() == reaction.tobytes()


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_model_exchange_finds_the_events_by_itself(fmu, flown, fmi):
    mechanism, core, states = flown
    arrays = fmi == "3"
    bodies = ("crank", "payload", "ball")
    places = [f"{body}.r" if arrays else f"{body}.r[{i}]" for body in bodies for i in (1, 2, 3)]
    places = list(dict.fromkeys(places))
    result = simulate_fmu(
        str(fmu("eventful", fmi)), fmi_type="ModelExchange", stop_time=END, output_interval=0.01,
        relative_tolerance=1e-9, output=["drop.time", *places],
    )  # fmt: skip
    last = result[-1]
    numbers = np.concatenate([np.ravel(last[name]) for name in places])
    motion = Motion.at_rest(core.n)
    core.motion(states[-1], motion)
    which = [mechanism.bodies.index(body) for body in bodies]
    assert last["drop.time"] == pytest.approx(0.1234, abs=1e-9)
    assert numbers == pytest.approx(motion.position[which].ravel(), abs=2e-5)
