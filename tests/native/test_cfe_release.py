"""Joints released in flight, by two derivations: a joint that becomes free, a force that goes away."""

import numpy as np
import pytest

from linkwind.errors import MechanismError
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Integrator, Multibody
from tests.native.happenings import Event, eventful, fly, with_events
from tests.native.loops import four_bars
from tests.native.mechanisms import motion_of, random_body, random_tree, two_link

H, STEPS = 2e-3, 40


def cfe(multibody, stabilisation=Stabilisation.PROJECTION, events=()):
    return Cfe(multibody.tables, events=events, stabilisation=stabilisation, time=0.05)


@pytest.mark.parametrize("stabilisation", Stabilisation)
@pytest.mark.parametrize("joint", ["fixed", "revolute", "prismatic", "planar", "spherical"])
def test_a_joint_released_at_a_time(joint, stabilisation):
    """Within a step; poses, twists, joint coordinates and forces after it, and the work of the wrench."""
    rng = np.random.default_rng(7)
    bodies = random_tree(rng, 6)
    bodies[2].joint, bodies[2].rest = joint, None
    multibody = eventful(bodies, [Event(2, threshold=0.0311)])
    joined, wrench = cfe(multibody, stabilisation), rng.normal(size=(1, 6, 6))
    q, v = rng.normal(size=multibody.nq), rng.normal(size=multibody.nv)
    ends = []
    for core in (multibody, joined):
        states, works = fly(core, core.initial_state(q, v), H, STEPS, Integrator.DOPRI5, wrench)
        motion, result = motion_of(core, states[-1]), core.evaluate(states[-1], wrench[0])
        forces = result.acceleration, result.reaction
        parts = (
            motion.position,
            motion.linear,
            motion.angular,
            *core.coordinates(states[-1]),
            *forces,
            works[-1],
        )
        ends.append(np.concatenate([np.ravel(part) for part in parts]))
        assert states[-1][-1] == pytest.approx(0.0311, abs=1e-14)
        assert np.abs(result.reaction[2]).max() < 1e-12
    size = np.abs(ends[0]).max()
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-8 * size)


def instants(multibody, q, v):
    """When the event happens, by both methods; and its poses a little later."""
    times, places = [], []
    for core in (multibody, cfe(multibody)):
        states, _ = fly(core, core.initial_state(q, v), H, STEPS)
        times.append(states[-1][-1])
        places.append(motion_of(core, states[-1]).position)
    assert H < times[0] < H * STEPS - H
    assert times[1] == pytest.approx(times[0], abs=1e-8)
    np.testing.assert_allclose(places[1], places[0], atol=1e-8)


def force(core, state):
    return core.evaluate(state, np.zeros((core.n, 6))).reaction[1]


def coordinate(core, state, of_rate=0):
    """The first one of body 1."""
    return core.coordinates(state)[of_rate][(core.tables.q_index, core.tables.v_index)[of_rate][1]]


@pytest.mark.parametrize(
    ("occasion", "joint", "seen"),
    [
        ("force", "spherical", lambda core, state: np.linalg.norm(force(core, state)[:3])),
        ("torque", "fixed", lambda core, state: np.linalg.norm(force(core, state)[3:])),
        ("position", "prismatic", coordinate),
        ("position", "revolute", coordinate),
        ("speed", "revolute", lambda core, state: coordinate(core, state, 1)),
        ("distance", "prismatic", lambda core, state: abs(coordinate(core, state))),
    ],
)
def test_what_a_release_waits_for(occasion, joint, seen):
    """It is what a quarter of the flight without it comes to."""
    rng = np.random.default_rng(11)
    bodies = [random_body(rng, "spherical", -1), random_body(rng, joint, 0), random_body(rng, "revolute", 1)]
    event = Event(1, occasion=occasion, threshold=1e9)
    waiting = eventful(bodies, [event])
    q, v = rng.normal(size=waiting.nq), rng.normal(size=waiting.nv)
    states, _ = fly(waiting, waiting.initial_state(q, v), H, STEPS)
    path = [seen(waiting, state) for state in states]
    event.threshold, event.side = path[STEPS // 4], 1 if path[STEPS // 4] > path[0] else -1
    instants(eventful(bodies, [event]), q, v)


@pytest.mark.parametrize("occasion", ["force", "time"])
def test_a_loop_that_opens(occasion):
    multibody, start = four_bars(1)
    q, v = multibody.coordinates(start)
    states, _ = fly(multibody, start, H, STEPS)
    loads = [np.linalg.norm(multibody.evaluate(s, np.zeros((3, 6))).closure_reaction[0, :3]) for s in states]
    threshold = {"force": loads[STEPS // 2], "time": 0.0333}[occasion]
    side = 1 if occasion == "time" or threshold > loads[0] else -1
    instants(Multibody(with_events(multibody.tables, [Event(3, "release", occasion, threshold, side)])), q, v)


@pytest.mark.parametrize(
    "event",
    [Event(1, "lock"), Event(1, "stop", "position", 0.5)],
)
def test_other_events_are_refused(event):
    multibody = eventful(two_link(), [event])
    with pytest.raises(MechanismError, match=r'event "clamp": expected a release'):
        cfe(multibody, events=["clamp"])
    with pytest.raises(MechanismError, match="event 0: expected none"):
        Incremental(multibody.tables)
