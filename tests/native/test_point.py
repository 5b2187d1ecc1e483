"""An accepted point, written by one call, against the calls that tell its parts."""

from __future__ import annotations

import numpy as np
import pytest

from linkwind.dynamics.methods import multibody
from linkwind.errors import SimulationError
from linkwind.log.state import StateMessage
from linkwind.mechanism import build
from linkwind.native.point import AcceptedPoint
from linkwind.scenario import load
from linkwind.spatial import Motion

SCENARIOS = [
    ("two_link", ()),
    ("two_link", ("dynamics.method=incremental", "dynamics.integrator=euler")),
    ("two_link", ("dynamics.method=cfe",)),
    ("four_bar", ()),
    ("four_bar", ("dynamics.method=cfe",)),
    ("stage_separation", ()),
    ("flapper", ()),
    ("andrews", ()),
]


def prepared(name, overrides):
    """Return mechanism, core, message and what writes into it, a state off the start, and loads."""
    scenario = load(name, list(overrides))
    mechanism = build(scenario)
    core = multibody(mechanism, scenario)
    counts = (len(each) for each in (mechanism.closures, mechanism.events, mechanism.forces))
    message = StateMessage(core.n, len(mechanism.q0), len(mechanism.v0), *counts)
    rng = np.random.default_rng(5)
    state = core.initial_state(mechanism.q0, mechanism.v0)
    trial = state.copy()
    state[core.nq : core.nq + core.nv] += 0.1 * rng.normal(size=core.nv)
    half = 0.1 * rng.normal(size=(core.n, 6, 6))
    added = half @ half.transpose(0, 2, 1)
    return mechanism, core, message, state, trial, rng.normal(size=(core.n, 6)), added


@pytest.mark.parametrize(("name", "overrides"), SCENARIOS)
@pytest.mark.parametrize("is_added", [False, True])
def test_point_is_its_parts(name, overrides, is_added):
    mechanism, core, message, state, trial, wrench, added = prepared(name, overrides)
    added = added if is_added else None
    found = AcceptedPoint(core, message.motion, message.fields).evaluate(state, trial, wrench, added, 0.25)
    fields = {name: array.copy() for name, array in message.fields.items()}

    before, motion = Motion.at_rest(core.n), Motion.at_rest(core.n)
    core.motion(trial, before)
    core.motion(state, motion)
    for each in ("position", "orientation", "linear", "angular"):
        assert getattr(message.motion, each).tobytes() == getattr(motion, each).tobytes()
    result = core.evaluate(state, wrench, added, time=0.25)
    expected = {
        "acceleration": result.acceleration, "reaction": result.reaction, "wrench": result.total_wrench,
        "closure_reaction": result.closure_reaction, "force_effort": result.effort,
        "force_power": result.power, "event_time": state[len(state) - core.events :],
    }  # fmt: skip
    expected["q"], expected["v"] = core.coordinates(state)
    assert fields.keys() == expected.keys()
    for each, array in expected.items():
        assert fields[each].tobytes() == np.ascontiguousarray(array).tobytes(), each
    assert (found.kinetic_energy, found.potential_energy) == core.energy(state)
    assert found.joint_gap == core.joint_gap(motion)
    assert found.force == pytest.approx(np.linalg.norm(result.total_wrench[:, :3], axis=1).max(), rel=1e-14)

    linear, angular = motion.linear - before.linear, motion.angular - before.angular
    inertia = mechanism.tables.inertia[:, :3].mean(axis=1)
    squared = (mechanism.tables.mass[:, None] * linear**2).sum() + (inertia[:, None] * angular**2).sum()
    assert found.missed == pytest.approx(squared, rel=1e-13)
    power = (wrench * np.hstack([linear, angular])).sum()
    assert found.lost == pytest.approx(power, rel=1e-12, abs=1e-14)


def test_the_point_before_leaves_nothing():
    _, core, message, state, trial, wrench, added = prepared("two_link", ())
    point = AcceptedPoint(core, message.motion, message.fields)
    point.evaluate(state, trial, wrench, None, 0.0)
    alone = message.fields["acceleration"].copy()
    point.evaluate(trial, state, -wrench, added, 0.5)
    point.evaluate(state, trial, wrench, None, 0.0)
    assert message.fields["acceleration"].tobytes() == alone.tobytes()


def test_numbers_that_are_none_are_named():
    _, core, message, state, trial, wrench, _ = prepared("two_link", ())
    wrench[1, 2] = np.nan
    with pytest.raises(SimulationError, match=r'wrench on body "link2": expected finite numbers'):
        AcceptedPoint(core, message.motion, message.fields).evaluate(state, trial, wrench, None, 0.0)
