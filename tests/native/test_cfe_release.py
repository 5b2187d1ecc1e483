"""Joints released in flight, by two derivations: a joint that becomes free, a force that goes away."""

import numpy as np
import pytest

from linkwind.errors import MechanismError
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Integrator
from tests.native.happenings import Event, eventful, fly
from tests.native.mechanisms import motion_of, random_tree, two_link

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


def test_a_joint_that_breaks_under_its_force():
    """Not at first, and at the same instant by both."""
    rng = np.random.default_rng(3)
    bodies = random_tree(rng, 6)
    bodies[1].parent, bodies[1].joint, bodies[1].rest = 0, "revolute", None
    tight = eventful(bodies, [Event(1, occasion="force", threshold=1e9)])
    q, v = rng.normal(size=tight.nq), 3 * rng.normal(size=tight.nv)
    states, _ = fly(tight, tight.initial_state(q, v), H, STEPS)
    seen = [np.linalg.norm(tight.evaluate(s, np.zeros((6, 6))).reaction[1, :3]) for s in states]
    multibody = eventful(bodies, [Event(1, occasion="force", threshold=0.5 * (seen[0] + max(seen)))])
    times = []
    for core in (multibody, cfe(multibody)):
        states, _ = fly(core, core.initial_state(q, v), H, STEPS)
        times.append(states[-1][-1])
    assert 0.0 < times[0] < H * STEPS
    assert times[1] == pytest.approx(times[0], abs=1e-9)


@pytest.mark.parametrize(
    "event",
    [Event(1, "lock"), Event(1, "stop", "position", 0.5), Event(1, occasion="position", threshold=0.5)],
)
def test_other_events_are_refused(event):
    multibody = eventful(two_link(), [event])
    with pytest.raises(MechanismError, match=r'event "clamp": expected the release of a joint'):
        cfe(multibody, events=["clamp"])
    with pytest.raises(MechanismError, match="events: expected none, for the method incremental"):
        Incremental(multibody.tables)
