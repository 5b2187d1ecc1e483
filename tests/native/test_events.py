"""Release, lock and stops in the core: located within the step, nothing lost at release, impulses right."""

from dataclasses import replace

import numpy as np
import pytest

from linkwind.errors import MechanismError, SimulationError
from linkwind.native.multibody import NOT_YET, ORDERED, Integrator
from tests.native.happenings import Event, eventful, fly
from tests.native.loops import four_bars
from tests.native.mechanisms import Body, Closure, matrix, motion_of, random_tree, two_link

EVERY = list(Integrator)


def links():
    """The two links of the paper as flat discs: what a released body may turn about has inertia."""
    return [replace(body, inertia=np.diag([0.7, 0.7, 1.4])) for body in two_link()]


POINT = np.eye(3) * 1e-9


def momenta(multibody, state):
    """Linear momentum, and angular momentum about the origin."""
    t, motion = multibody.tables, motion_of(multibody, state)
    linear, angular = np.zeros(3), np.zeros(3)
    for i in range(multibody.n):
        xx, yy, zz, xy, xz, yz = t.inertia[i]
        turn = matrix(motion.orientation[i])
        inertia = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
        p = t.mass[i] * motion.linear[i]
        linear += p
        angular += inertia @ motion.angular[i] + np.cross(motion.position[i], p)
    return np.concatenate([linear, angular])


def happened(multibody, states):
    """The time of the first event in the last state."""
    return states[-1][multibody.nq + multibody.nv + 1]


@pytest.mark.parametrize("integrator", EVERY)
def test_a_release_at_a_time_leaves_two_free_bodies(integrator):
    """After it each centre of mass is on a parabola, and each body turns steadily."""
    multibody = eventful(links(), [Event(1, threshold=0.02345)])
    q, v = np.zeros(multibody.nq), np.zeros(multibody.nv)
    q[3], v[:4] = 0.7, [1.0, 2.0, 3.0, -8.0]
    states, _ = fly(multibody, multibody.initial_state(q, v), 1e-3, 60, integrator)
    assert happened(multibody, states) == pytest.approx(0.02345, abs=1e-15)
    first, last = motion_of(multibody, states[24]), motion_of(multibody, states[-1])
    t = 0.036
    fall = first.position + t * first.linear + [0, -9.81 * t * t / 2, 0]
    exact = 1e-12 if integrator not in (Integrator.EULER, Integrator.SEMI_IMPLICIT_EULER) else 1e-3
    assert np.abs(last.position - fall).max() < exact
    assert np.abs(last.angular - first.angular).max() < 1e-13
    result = multibody.evaluate(states[-1], np.zeros((2, 6)))
    assert np.abs(result.reaction[1]).max() < 1e-13


@pytest.mark.parametrize("joint", ["fixed", "revolute", "prismatic", "planar", "spherical"])
@pytest.mark.parametrize("seed", range(3))
def test_momentum_and_motion_go_on_through_a_release(joint, seed):
    """Released at once: poses and twists of all bodies are what they were, to round-off."""
    rng = np.random.default_rng(seed)
    bodies = random_tree(rng, 6)
    bodies[2].joint = joint
    multibody = eventful(bodies, [Event(2, occasion="command")])
    q, v = rng.normal(size=multibody.nq), rng.normal(size=multibody.nv)
    before = multibody.initial_state(q, v)
    ordered = before.copy()
    ordered[-1] = ORDERED
    after, _ = fly(multibody, ordered, 1e-13, 1)
    one, other = motion_of(multibody, before), motion_of(multibody, after[-1])
    for name in ("position", "linear", "angular"):
        assert np.abs(getattr(one, name) - getattr(other, name)).max() < 1e-10
    assert np.abs(one.orientation - other.orientation).max() < 1e-12
    assert np.abs(momenta(multibody, before) - momenta(multibody, after[-1])).max() < 1e-10
    assert after[-1][-1] == pytest.approx(0.0, abs=1e-13)
    still, _ = fly(multibody, before, 1e-13, 1)
    assert still[-1][-1] == NOT_YET


def test_the_spring_of_a_released_joint_is_gone_with_its_energy():
    body = Body(-1, "prismatic", 2.0, 0.1 * np.eye(3), stiffness=50.0, damping=0.3)
    multibody = eventful([body], [Event(0, occasion="position", threshold=0.0, side=-1)], gravity=(0, 0, 0))
    start = multibody.initial_state(np.r_[0.1, np.zeros(6)], np.zeros(6))
    held = eventful([body], [Event(0, occasion="position", threshold=0.06, side=-1)], gravity=(0, 0, 0))
    for mechanism, left in ((multibody, 0.0), (held, 0.06)):
        states, works = fly(mechanism, start, 1e-3, 600)
        energies = [sum(mechanism.energy(s)) for s in (states[0], states[-1])]
        assert works[-1][1] == pytest.approx(energies[0] - energies[1], abs=1e-10)
        assert np.ptp(states[-200:, 9]) < 1e-14  # it flies on
        assert works[-1][1] > 0.5 * 50.0 * left**2


def test_a_release_on_a_force():
    """A pendulum let go from the horizontal pulls with 3 m g sin(angle): at 2 m g the sine is 2/3."""
    bodies = [Body(-1, "revolute", 1.5, POINT, (0, 0, 0), (-2.0, 0, 0))]
    multibody = eventful(bodies, [Event(0, occasion="force", threshold=2 * 1.5 * 9.81)])
    states, _ = fly(multibody, multibody.initial_state(np.zeros(7), np.zeros(6)), 1e-3, 1200)
    time = happened(multibody, states)
    k = int(time / 1e-3)
    rest, _ = fly(multibody, states[k], time - k * 1e-3 - 1e-12, 1, start=k * 1e-3)
    assert np.sin(-rest[-1][0]) == pytest.approx(2 / 3, abs=1e-9)
    speed = np.sqrt(2 * 9.81 * 2.0 * 2 / 3)
    linear = motion_of(multibody, states[k + 1]).linear[0]
    fallen = speed * np.sqrt(5) / 3 + 9.81 * ((k + 1) * 1e-3 - time)
    assert linear == pytest.approx([-speed * 2 / 3, -fallen, 0.0], abs=1e-8)


@pytest.mark.parametrize("integrator", EVERY)
def test_a_lock_keeps_the_momenta_and_loses_the_right_energy(integrator):
    multibody = eventful(links(), [Event(1, "lock", "position", 0.5)], gravity=(0.0, 0.0, 0.0))
    q, v = np.zeros(multibody.nq), np.zeros(multibody.nv)
    v[:4] = [0.3, -0.2, 1.0, 4.0]
    start = multibody.initial_state(q, v)
    states, works = fly(multibody, start, 1e-3, 300, integrator)
    end = states[-1]
    assert end[multibody.nq + 3] == 0.0
    assert end[3] == pytest.approx(0.5, abs=1e-13)
    before, after = momenta(multibody, start), momenta(multibody, end)
    tolerance = 1e-11 if integrator in (Integrator.RK4, Integrator.DOPRI5, Integrator.RADAU5) else 0.05
    assert np.abs(after - before).max() < tolerance
    lost = multibody.energy(start)[0] - multibody.energy(end)[0]
    assert lost > 0.5
    assert works[-1][1] == pytest.approx(lost, abs=tolerance * 10)


def test_the_velocity_after_a_lock_is_that_of_the_rigid_whole():
    """Angular momentum about the common centre of mass over the inertia of both links together."""
    multibody = eventful(links(), [Event(1, "lock", "command")], gravity=(0.0, 0.0, 0.0))
    state = multibody.initial_state(np.array([0.0, 0.0, 0.0, 0.5]), np.array([0.3, -0.2, 1.0, 4.0]))
    motion = motion_of(multibody, state)
    centre, drift = motion.position.mean(axis=0), motion.linear.mean(axis=0)
    arms, speeds = motion.position - centre, motion.linear - drift
    spin = (1.4 * motion.angular[:, 2]).sum() + 2.0 * np.cross(arms, speeds)[:, 2].sum()
    inertia = 2 * 1.4 + 2.0 * (arms**2).sum()
    state[-1] = ORDERED
    after = motion_of(multibody, fly(multibody, state, 1e-12, 1)[0][-1])
    assert after.angular[:, 2] == pytest.approx([spin / inertia] * 2, abs=1e-12)
    assert after.linear.mean(axis=0) == pytest.approx(drift, abs=1e-12)


def test_a_lock_in_a_loop_stops_it():
    crank, _ = four_bars(1)
    bodies = [
        Body(-1, "revolute", 1.0, np.diag([1 / 24, 1 / 24, 1 / 12]), (0, 0, 0), (-0.5, 0, 0)),
        Body(-1, "revolute", 1.0, np.diag([1 / 24, 1 / 24, 1 / 12]), (1, 0, 0), (-0.5, 0, 0)),
        Body(0, "revolute", 1.0, np.diag([1 / 24, 1 / 24, 1 / 12]), (0.5, 0, 0), (-0.5, 0, 0)),
    ]
    loop = [Closure(2, 1, 3, (0.5, 0, 0), (0.5, 0, 0))]
    multibody = eventful(bodies, [Event(1, "lock", "time", 0.05)], closures=loop)
    start = multibody.initial_state(np.array([np.pi / 2, np.pi / 2, -np.pi / 2]), np.array([-1.0, -1.0, 1.0]))
    states, works = fly(multibody, start, 1e-2, 10)
    assert np.abs(states[-1][3:6]).max() < 1e-13
    assert states[-1][0] == pytest.approx(states[-1][1], abs=1e-12)
    energy = [sum(multibody.energy(s)) for s in (states[0], states[-1])]
    assert works[-1][1] == pytest.approx(energy[0] - energy[1], abs=1e-9)
    assert crank.rows == multibody.rows


def bouncer(restitution, height=1.0, gravity=9.81):
    """A mass on a vertical guide above a stop at zero."""
    axis = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    bodies = [Body(-1, "prismatic", 2.0, POINT, parent_rotation=axis, child_rotation=axis)]
    stop = Event(0, "stop", "position", 0.0, -1, restitution)
    multibody = eventful(bodies, [stop], gravity=(0, 0, 0))
    pull = np.zeros((1, 1, 6))
    direction = axis[:, 2]
    pull[0, 0, :3] = -2.0 * gravity * direction
    return multibody, multibody.initial_state(np.array([height]), np.zeros(1)), pull


@pytest.mark.parametrize("integrator", [Integrator.RK4, Integrator.DOPRI5, Integrator.RADAU5])
@pytest.mark.parametrize("restitution", [1.0, 0.5])
def test_bounces_reach_the_heights_of_the_textbook(integrator, restitution):
    multibody, state, pull = bouncer(restitution)
    fall = np.sqrt(2 / 9.81)
    top = fall * (1 + restitution)  # time of the first apex
    steps = 64
    states, _ = fly(multibody, state, top / steps, steps, integrator, pull)
    assert states[-1][0] == pytest.approx(restitution**2, abs=1e-10)
    assert states[-1][1] == pytest.approx(0.0, abs=1e-10)
    assert states[:, 0].min() > -1e-9


def test_a_mass_comes_to_rest_on_its_stop_and_leaves_it_again():
    multibody, state, pull = bouncer(0.5)
    states, works = fly(multibody, state, 1e-2, 200, wrench=pull)
    rest = states[-1]
    assert rest[0] == pytest.approx(0.0, abs=1e-9)
    assert rest[1] == 0.0
    settled = np.sqrt(2 / 9.81) * (1 + 2 * 0.5 / (1 - 0.5))  # the geometric series of all bounces
    assert rest[-1] == pytest.approx(settled, abs=0.02)
    assert works[-1][1] == pytest.approx(2.0 * 9.81, abs=1e-6)  # all that it had
    up, _ = fly(multibody, rest, 1e-2, 50, wrench=-pull, start=2.0)
    assert up[-1][0] == pytest.approx(9.81 * 0.5**2 / 2, abs=1e-9)
    assert up[-1][-1] == NOT_YET


def test_a_hinge_between_two_stops_conserves_energy_if_elastic():
    """A pendulum bouncing to and fro for many swings."""
    bodies = [Body(-1, "revolute", 1.0, np.diag([0.1, 0.1, 0.1]), (0, 0, 0), (-1.0, 0, 0))]
    stops = [Event(0, "stop", "position", s * 1.0 - np.pi / 2, int(s), 1.0) for s in (1, -1)]
    multibody = eventful(bodies, stops)
    start = multibody.initial_state(np.array([-np.pi / 2]), np.array([6.0]))
    states, _ = fly(multibody, start, 2e-3, 3000)
    energies = [sum(multibody.energy(s)) for s in states]
    assert np.ptp(energies) < 1e-6
    assert np.abs(states[:, 0] + np.pi / 2).max() < 1.0 + 1e-9
    assert (np.diff(np.sign(states[:, 1])) != 0).sum() > 15


def test_a_released_closure_lets_go():
    """The four-bar becomes a double pendulum and a pendulum: the loop's reaction is gone, the bodies part."""
    rod = np.diag([1 / 24, 1 / 24, 1 / 12])
    bodies = [
        Body(-1, "revolute", 1.0, rod, (0, 0, 0), (-0.5, 0, 0)),
        Body(0, "revolute", 1.0, rod, (0.5, 0, 0), (-0.5, 0, 0)),
        Body(-1, "revolute", 1.0, rod, (1, 0, 0), (-0.5, 0, 0)),
    ]
    loop = [Closure(1, 2, 3, (0.5, 0, 0), (0.5, 0, 0))]
    multibody = eventful(bodies, [Event(3, threshold=0.1)], closures=loop)
    start = multibody.initial_state(np.array([np.pi / 2, -np.pi / 2, np.pi / 2]), np.array([-1.0, 1.0, -1.0]))
    states, works = fly(multibody, start, 1e-2, 40)
    gap = [multibody.violations(s)[0] for s in states[10:]]
    assert np.abs(gap).max() == 0.0  # it is no equation any more
    assert np.abs(multibody.evaluate(states[-1], np.zeros((3, 6))).closure_reaction).max() == 0.0
    free = eventful(bodies, [])
    alone, _ = fly(free, states[10][: free.state_size], 1e-2, 30)
    assert np.abs(alone[-1][:6] - states[-1][:6]).max() < 1e-9
    energies = [sum(multibody.energy(s)) for s in (states[0], states[-1])]
    assert energies[1] == pytest.approx(energies[0], abs=1e-6)
    assert works[-1][1] == pytest.approx(0.0, abs=1e-12)


def test_distance_locks_what_has_come_near():
    """Two bodies fly together, the joint between them, released at once, locks when its points meet."""
    bodies = [Body(-1, "free", 2.0), Body(0, "fixed", 1.0)]
    events = [Event(1, "release", "command"), Event(1, "lock", "distance", 0.05, -1)]
    multibody = eventful(bodies, events, gravity=(0, 0, 0))
    state = multibody.initial_state(np.r_[np.zeros(3), 1, 0, 0, 0, np.zeros(7)], np.zeros(12))
    state[7:14] = [1.0, 0, 0, 1, 0, 0, 0]
    state[multibody.nq + 6] = -1.0
    state[-2] = 0.0
    states, works = fly(multibody, state, 0.1, 20)
    motion = motion_of(multibody, states[-1])
    assert states[-1][-1] == pytest.approx(0.95, abs=1e-12)
    assert motion.linear == pytest.approx(np.tile([-1 / 3, 0, 0], (2, 1)), abs=1e-12)
    assert motion.position[1, 0] - motion.position[0, 0] == pytest.approx(0.05, abs=1e-12)
    assert works[-1][1] == pytest.approx(0.5 * (2 / 3) * 1.0**2, abs=1e-12)


def test_the_same_step_again_gives_the_same_bits():
    """A step that is redone from before an event knows nothing of it."""
    multibody = eventful(links(), [Event(1, threshold=0.005)])
    rng = np.random.default_rng(1)
    q, v = np.zeros(multibody.nq), np.zeros(multibody.nv)
    q[:4], v[:4] = rng.normal(size=4), rng.normal(size=4)
    start = multibody.initial_state(q, v)
    first, _ = fly(multibody, start, 1e-2, 3)
    again, _ = fly(multibody, start, 1e-2, 3)
    assert np.array_equal(first, again)
    untouched, _ = fly(eventful(links(), [Event(1, threshold=1e9)]), start, 1e-2, 1)
    assert np.array_equal(untouched[1][4:10], start[4:10])


WRONG = [
    (Event(9), "event_joint"),
    (Event(0, "stop", "position"), "event_action"),
    (Event(1, "stop", "time"), "event_action"),
    (Event(0, "lock", "position"), "event_occasion"),
    (Event(1, threshold=np.nan), "event_threshold"),
    (Event(1, side=0), "event_side"),
    (Event(1, "stop", "position", restitution=1.5), "event_restitution"),
]


@pytest.mark.parametrize(("event", "table"), WRONG)
def test_wrong_events_are_refused(event, table):
    with pytest.raises(MechanismError, match=rf"tables\.{table}\[0\]: expected"):
        eventful(two_link(), [event])


def test_a_release_needs_room():
    made = eventful(two_link(), [Event(1)]).tables
    with pytest.raises(MechanismError, match=r"index\[1\]"):
        type(eventful(two_link(), []))(type(made)(**(vars(made) | {"q_index": [0, 1]})))


def test_too_many_bounces_in_a_step_end_the_run():
    """A mass to and fro between two stops a millimetre apart."""
    stops = [Event(0, "stop", "position", side * 5e-4, side, 1.0) for side in (1, -1)]
    multibody = eventful([Body(-1, "prismatic", 2.0, POINT)], stops, gravity=(0, 0, 0))
    with pytest.raises(
        SimulationError, match=r"event \d: expected a few times within a step; got a thousand"
    ):
        fly(multibody, multibody.initial_state(np.zeros(1), np.array([10.0])), 1.0, 1)
