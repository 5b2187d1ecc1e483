"""Inverse dynamics of the forward dynamics, added inertia, and motion as the derivative of pose."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from linkwind.native.multibody import NV, Integrator, Multibody
from tests.native.mechanisms import (
    AXES,
    IDENTITY,
    Body,
    matrix,
    motion_of,
    random_added,
    random_inertia,
    random_rotation,
    random_state,
    random_tree,
    space_mechanism,
    tables,
)

GRAVITY = np.array([0.7, -2.1, -9.1])
seeds = st.integers(0, 10_000)
TIGHT = {"integrator": Integrator.DOPRI5, "rtol": 1e-13, "atol": 1e-13}
fast = settings(max_examples=25, deadline=None, derandomize=True)


def cross_matrix(r):
    return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])


def newton_euler_residual(bodies, motion, result, total):
    """Per body: reactions + wrench + gravity - rate of momentum, at the centre of mass."""
    residual = np.zeros((len(bodies), 6))
    for i, body in enumerate(bodies):
        rotation, omega = matrix(motion.orientation[i]), motion.angular[i]
        inertia = rotation @ body.inertia @ rotation.T
        a, alpha = result.acceleration[i, :3], result.acceleration[i, 3:]
        residual[i, :3] += total[i, :3] + body.mass * (GRAVITY - a) + result.reaction[i, :3]
        residual[i, 3:] += total[i, 3:] - inertia @ alpha - np.cross(omega, inertia @ omega)
        joint = motion.position[i] + rotation @ body.child_point
        force, torque = result.reaction[i, :3], result.reaction[i, 3:]
        residual[i, 3:] += torque + np.cross(joint - motion.position[i], force)
        if body.parent >= 0:
            residual[body.parent, :3] -= force
            residual[body.parent, 3:] -= torque + np.cross(joint - motion.position[body.parent], force)
    return residual


def whole_wrench(motion, wrench, added, acceleration):
    turn = np.zeros((len(wrench), 6, 6))
    for i, quaternion in enumerate(motion.orientation):
        turn[i, :3, :3] = turn[i, 3:, 3:] = matrix(quaternion)
    return wrench - np.einsum("nij,njk,nlk,nl->ni", turn, added, turn, acceleration)


@fast
@given(seeds, st.integers(1, 12))
def test_newton_euler_of_every_body(seed, n):
    rng = np.random.default_rng(seed)
    bodies = random_tree(rng, n, springs=True)
    multibody = Multibody(tables(bodies, GRAVITY))
    state, wrench, added = random_state(rng, multibody), rng.normal(size=(n, 6)), random_added(rng, n)
    result, motion = multibody.evaluate(state, wrench, added), motion_of(multibody, state)
    total = whole_wrench(motion, wrench, added, result.acceleration)
    size = max(1.0, np.abs(result.reaction).max(), np.abs(result.acceleration).max())
    np.testing.assert_allclose(result.total_wrench, total, atol=1e-11 * size)
    residual = newton_euler_residual(bodies, motion, result, total)
    np.testing.assert_allclose(residual, 0.0, atol=1e-11 * size)


def joint_axes(body, motion, i):
    """World directions of the joint's translations and rotations."""
    child = matrix(motion.orientation[i]) @ body.child_rotation
    parent = body.parent_rotation
    if body.parent >= 0:
        parent = matrix(motion.orientation[body.parent]) @ parent
    slides, turns = AXES[body.joint]
    return parent[:, slides], (child if len(turns) == 3 else parent)[:, turns]


@fast
@given(seeds)
def test_reactions_do_no_work_but_that_of_dampers(seed):
    rng = np.random.default_rng(seed)
    bodies = random_tree(rng, 9)
    for body in bodies:
        body.damping = rng.uniform(0.0, 2.0, NV[body.joint])
    multibody = Multibody(tables(bodies, GRAVITY))
    state, wrench = random_state(rng, multibody), rng.normal(size=(9, 6))
    result, motion = multibody.evaluate(state, wrench), motion_of(multibody, state)
    size = max(1.0, np.abs(result.reaction).max())
    for i, body in enumerate(bodies):
        slides, turns = joint_axes(body, motion, i)
        along = np.concatenate([slides.T @ result.reaction[i, :3], turns.T @ result.reaction[i, 3:]])
        v = state[multibody.nq + multibody.tables.v_index[i] :][: NV[body.joint]]
        np.testing.assert_allclose(along, -body.damping * v, atol=1e-12 * size)


@fast
@given(seeds)
def test_springs_are_the_gradient_of_their_energy(seed):
    """Anisotropic ones too: the power of the joint forces is minus the rate of the spring energy."""
    rng = np.random.default_rng(seed)
    bodies = random_tree(rng, 7)
    for body in bodies:
        body.stiffness = rng.uniform(0.5, 5.0, NV[body.joint])
    multibody = Multibody(tables(bodies, (0, 0, 0)))
    state, no_load = random_state(rng, multibody), np.zeros((1, 7, 6))

    def spring_energy(after):
        return multibody.energy(multibody.advance(state, after, np.zeros(1), no_load, None, integrator=2)[0])[
            1
        ]

    result, motion = multibody.evaluate(state, no_load[0]), motion_of(multibody, state)
    power = 0.0
    for i, body in enumerate(bodies):
        slides, turns = joint_axes(body, motion, i)
        along = np.concatenate([slides.T @ result.reaction[i, :3], turns.T @ result.reaction[i, 3:]])
        power += along @ state[multibody.nq + multibody.tables.v_index[i] :][: NV[body.joint]]
    h, rates = 1e-3, []
    for step in (h, h / 2):  # Richardson: the rate at the start from one-sided differences
        ahead = [spring_energy(step), spring_energy(2 * step)]
        rates.append((4 * ahead[0] - ahead[1] - 3 * multibody.energy(state)[1]) / (2 * step))
    rate = (4 * rates[1] - rates[0]) / 3
    assert abs(power + rate) <= 1e-5 * max(1.0, abs(power), np.abs(result.acceleration).max())


def test_twist_and_acceleration_are_derivatives():
    """Central differences of pose and twist along a trajectory; their error falls with the square."""
    rng = np.random.default_rng(3)
    multibody = Multibody(tables(space_mechanism(rng), GRAVITY))
    begin, no_load = random_state(rng, multibody), np.zeros((1, 5, 6))

    def difference(h):
        middle = multibody.advance(begin, h, np.zeros(1), no_load, None, **TIGHT)[0]
        end = multibody.advance(middle, h, np.zeros(1), no_load, None, **TIGHT)[0]
        a, m, b = (motion_of(multibody, s) for s in (begin, middle, end))
        result = multibody.evaluate(middle, no_load[0])
        turns = [
            (Rotation.from_matrix(matrix(q) @ matrix(p).T)).as_rotvec()
            for p, q in zip(a.orientation, b.orientation, strict=True)
        ]
        return np.concatenate([
            np.ravel((b.position - a.position) / (2 * h) - m.linear),
            np.ravel(np.array(turns) / (2 * h) - m.angular),
            np.ravel((b.linear - a.linear) / (2 * h) - result.acceleration[:, :3]),
            np.ravel((b.angular - a.angular) / (2 * h) - result.acceleration[:, 3:]),
        ])  # fmt: skip

    coarse, fine = np.abs(difference(4e-4)).max(), np.abs(difference(2e-4)).max()
    assert fine < 2e-5
    assert 3.0 < coarse / fine < 5.0


@fast
@given(seeds)
def test_added_inertia_is_a_body_that_is_fixed_on(seed):
    """A equals a rigidly attached mass from which gravity and its velocity terms are taken away."""
    rng = np.random.default_rng(seed)
    bodies = random_tree(rng, 7)
    n, carrier = len(bodies), int(rng.integers(7))
    mass, inertia, offset = 1.7, random_inertia(rng), rng.normal(size=3) * 0.3
    turn = random_rotation(rng)
    heavier = [*bodies, Body(carrier, "fixed", mass, inertia, offset, (0, 0, 0), turn, IDENTITY)]

    c = cross_matrix(offset)
    added = np.zeros((n, 6, 6))
    in_body = turn @ inertia @ turn.T
    added[carrier] = np.block([[mass * IDENTITY, -mass * c], [mass * c, in_body - mass * c @ c]])

    light, heavy = Multibody(tables(bodies, GRAVITY)), Multibody(tables(heavier, GRAVITY))
    state, wrench = random_state(rng, light), rng.normal(size=(n, 6))
    motion = motion_of(heavy, state)
    omega, arm = motion.angular[carrier], matrix(motion.orientation[carrier]) @ offset
    world = matrix(motion.orientation[n]) @ inertia @ matrix(motion.orientation[n]).T
    force = mass * (np.cross(omega, np.cross(omega, arm)) - GRAVITY)
    extra = np.concatenate([force, np.cross(omega, world @ omega)])
    expected = heavy.evaluate(state, np.vstack([wrench, extra])).joint_acceleration
    got = light.evaluate(state, wrench, added).joint_acceleration
    np.testing.assert_allclose(got, expected, atol=1e-10 * max(1.0, np.abs(expected).max()))


def test_massless_body_moves_by_its_added_inertia():
    body = Body(-1, "free", 0.0, np.zeros((3, 3)))
    multibody = Multibody(tables([body], (0, 0, -9.81)))
    added = 2.0 * np.eye(6)[None]
    state = multibody.initial_state([0, 0, 0, 1, 2, 3, 4], np.zeros(6))
    result = multibody.evaluate(state, np.array([[4.0, 0, 0, 0, 6.0, 0]]), added)
    np.testing.assert_allclose(result.acceleration, [[2, 0, 0, 0, 3, 0]], atol=1e-14)


def test_joint_gap_is_round_off_and_sees_a_gap():
    rng = np.random.default_rng(8)
    bodies = random_tree(rng, 12)
    multibody = Multibody(tables(bodies, GRAVITY))
    state = random_state(rng, multibody)
    for _ in range(200):
        state, _ = multibody.advance(
            state, 1e-2, np.zeros(1), np.zeros((1, 12, 6)), None, integrator=Integrator.RK4, substeps=2
        )
    motion = motion_of(multibody, state)
    assert multibody.joint_gap(motion) <= 1e-12 * max(1.0, np.abs(motion.position).max())
    hinged = next(i for i, body in enumerate(bodies) if body.joint == "revolute")
    leaf = not any(body.parent == hinged for body in bodies)
    motion.position[hinged] += [3e-6, 0.0, 4e-6]
    assert multibody.joint_gap(motion) >= 4.9e-6
    assert not leaf or multibody.joint_gap(motion) <= 5.1e-6


def test_gap_leaves_out_what_the_joint_allows():
    for joint, allowed, forbidden in (("prismatic", [0, 0, 1], [0, 1, 0]), ("planar", [1, 1, 0], [0, 0, 1])):
        multibody = Multibody(tables([Body(-1, joint)]))
        motion = motion_of(multibody, multibody.initial_state(np.zeros(multibody.nq), np.zeros(multibody.nv)))
        motion.position[0] = allowed
        assert multibody.joint_gap(motion) == 0.0
        motion.position[0] = forbidden
        assert multibody.joint_gap(motion) == 1.0


def test_quaternion_of_a_turning_link_is_continuous():
    bodies = [Body(-1, "planar"), Body(0, "revolute", child_rotation=np.diag([-1.0, 1.0, -1.0]))]
    multibody = Multibody(tables(bodies))
    turns = [
        motion_of(multibody, multibody.initial_state([0, 0, t, 2 * t], np.zeros(4))).orientation
        for t in np.linspace(-30.0, 30.0, 400)
    ]
    steps = np.einsum("kni,kni->kn", np.array(turns[1:]), np.array(turns[:-1]))
    assert steps.min() > 0.9
