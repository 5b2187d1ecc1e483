"""Loops in the core: forces that keep them, cutting, orders, long runs."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from linkwind.errors import SimulationError
from linkwind.native.multibody import Integrator, Multibody
from tests.native.loops import four_bars, matrix_of, random_loops
from tests.native.mechanisms import Body, motion_of, tables

KINDS = [
    ("spherical",), ("revolute",), ("prismatic",), ("planar",), ("fixed",), ("distance",),
    ("revolute", "distance"), ("spherical", "spherical", "distance"), ("distance",) * 4,
]  # fmt: skip
HELD = np.zeros(1)


def advance(multibody, state, h, steps, integrator=Integrator.RK4, **how):
    calm = np.zeros((1, multibody.n, 6))
    for _ in range(steps):
        state, _ = multibody.advance(state, h, HELD, calm, None, integrator=integrator, **how)
    return state


def loads(multibody, state, closures, result):
    """The reactions of the closures as wrenches on the bodies at their centres of mass."""
    motion = motion_of(multibody, state)
    wrench = np.zeros((multibody.n, 6))
    for closure, reaction in zip(closures, result.closure_reaction, strict=True):
        force, torque = reaction[:3], reaction[3:]
        point = np.array(closure.second_point, float)
        if closure.second >= 0:
            turn = matrix_of(motion, closure.second)
            point = motion.position[closure.second] + turn @ point
        for body, sign in ((closure.first, -1.0), (closure.second, 1.0)):
            if body >= 0:
                arm = point - motion.position[body]
                wrench[body] += sign * np.concatenate([force, torque + np.cross(arm, force)])
    return wrench


@pytest.mark.parametrize("kinds", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_cut_closures_with_their_reactions_move_alike(seed, kinds):
    rng = np.random.default_rng([seed, len(kinds)])
    bodies, closures, multibody, state = random_loops(rng, 6, kinds)
    added = rng.normal(size=(6, 6, 6))
    added = np.ascontiguousarray(added @ added.transpose(0, 2, 1))
    wrench = rng.normal(size=(6, 6))
    result = multibody.evaluate(state, wrench, added)
    cut = Multibody(tables(bodies, multibody.tables.gravity))
    free = cut.evaluate(state, wrench + loads(multibody, state, closures, result), added)
    scale = 1.0 + np.abs(free.acceleration).max()
    assert np.abs(free.acceleration - result.acceleration).max() < 1e-10 * scale
    assert np.abs(free.reaction - result.reaction).max() < 1e-9 * (1.0 + np.abs(free.reaction).max())


@pytest.mark.parametrize("kinds", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_the_loops_stay_closed(seed, kinds):
    """What each equation is violated by, as seen along the motion: zero with its first two derivatives."""
    rng = np.random.default_rng([seed, 7, len(kinds)])
    bodies, closures, multibody, state = random_loops(rng, 6, kinds)
    value, jacobian = multibody.violations(state)
    v = state[multibody.nq : -1]
    assert np.abs(value).max() < 1e-13
    assert np.abs(jacobian @ v).max() < 1e-11 * (1.0 + np.abs(v).max())
    result = multibody.evaluate(state, np.zeros((6, 6)))
    # The cut mechanism under the reactions of the start, a little further on: J v is zero to second order.
    cut, h = Multibody(tables(bodies, multibody.tables.gravity)), 1e-4
    held = loads(multibody, state, closures, result)[None]
    ahead = [cut.advance(state, k * h, HELD, held, None, integrator=Integrator.RK4)[0] for k in (1, 2)]
    rate, later = (multibody.violations(s)[1] @ s[multibody.nq : -1] for s in ahead)
    drift = (4.0 * rate - later) / (2.0 * h)
    size = 1.0 + np.abs(jacobian) @ np.abs(result.joint_acceleration)
    assert np.abs(drift / size).max() < 1e-4


@pytest.mark.parametrize("kinds", KINDS)
def test_closures_do_no_work_and_cannot_be_told_apart_from_a_rigid_whole(kinds):
    """On every motion that the loops allow the reactions are powerless."""
    rng = np.random.default_rng(len(kinds))
    _, closures, multibody, state = random_loops(rng, 6, kinds)
    result = multibody.evaluate(state, rng.normal(size=(6, 6)))
    wrench = loads(multibody, state, closures, result)
    other = state.copy()
    other[multibody.nq : -1] = rng.normal(size=multibody.nv)
    motion = motion_of(multibody, multibody.close(other))
    twist = np.hstack([motion.linear, motion.angular])
    assert abs((wrench * twist).sum()) < 1e-10 * (np.abs(wrench) * np.abs(twist)).sum() + 1e-12


def test_every_joint_of_the_tree_cut_with_its_reaction_moves_alike():
    rng = np.random.default_rng(3)
    bodies, closures, multibody, state = random_loops(rng, 6, ("revolute", "distance"))
    wrench = rng.normal(size=(6, 6))
    result, motion = multibody.evaluate(state, wrench), motion_of(multibody, state)
    loose = Multibody(tables([Body(-1, "free", b.mass, b.inertia) for b in bodies], multibody.tables.gravity))
    turning = [matrix_of(motion, i).T @ w for i, w in enumerate(motion.angular)]
    free = loose.initial_state(
        np.hstack([motion.position, motion.orientation]).ravel(), np.hstack([motion.linear, turning]).ravel()
    )
    loaded = wrench + loads(multibody, state, closures, result)
    for i, body in enumerate(bodies):
        arm = matrix_of(motion, i) @ body.child_point
        force, torque = result.reaction[i, :3], result.reaction[i, 3:]
        loaded[i] += np.r_[force, torque + np.cross(arm, force)]
        if body.parent >= 0:
            lever = motion.position[i] + arm - motion.position[body.parent]
            loaded[body.parent] -= np.r_[force, torque + np.cross(lever, force)]
    again = loose.evaluate(free, loaded)
    assert np.abs(again.acceleration - result.acceleration).max() < 1e-10 * np.abs(result.acceleration).max()


def reduced_four_bars(count: int, end: float) -> np.ndarray:
    """Angle and its rate: all cranks turn alike and the rods stay level, so that one angle is left."""
    inertia, gravity = (count + 1) / 3 + count, ((count + 1) / 2 + count) * 9.81
    result = solve_ivp(
        lambda t, y: [y[1], -gravity * np.cos(y[0]) / inertia],
        (0.0, end), [np.pi / 2, -1.0], method="DOP853", rtol=1e-13, atol=1e-14,
    )  # fmt: skip
    return result.y[:, -1]


@pytest.mark.parametrize("kept", [3, 31])
def test_four_bars_through_singular_positions(kept):
    """With the equations of the plane, and with those of space, of which most say nothing or the same."""
    multibody, state = four_bars(2, kept)
    state = advance(multibody, state, 1e-3, 10_000)
    angle, _ = reduced_four_bars(2, 10.0)
    tip = motion_of(multibody, state).position[0] * 2.0
    assert np.allclose(tip[:2], [np.cos(angle), np.sin(angle)], atol=1e-9, rtol=0)
    assert np.allclose(tip[:2], [0.3284581115, 0.9445185382], atol=1e-9, rtol=0)
    assert multibody.joint_gap(motion_of(multibody, state)) <= 1e-13


@pytest.mark.parametrize(
    ("integrator", "order", "coarse"),
    [
        (Integrator.EULER, 1, 40),
        (Integrator.SEMI_IMPLICIT_EULER, 1, 40),
        (Integrator.RK4, 4, 40),
        (Integrator.RADAU5, 5, 4),
    ],
)
def test_orders_on_loops(integrator, order, coarse):
    multibody, start = four_bars(1)
    start = advance(multibody, start, 1e-3, 300)
    exact, steps = reduced_four_bars(1, 0.6)[0], (coarse, 2 * coarse, 4 * coarse)
    errors = [abs(advance(multibody, start, 0.3 / n, n, integrator)[0] - exact) for n in steps]
    observed = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.abs(observed - order).max() < 0.2


def test_dopri5_on_loops():
    multibody, state = four_bars(1)
    state = advance(multibody, state, 0.1, 5, Integrator.DOPRI5, rtol=1e-10, atol=1e-12)
    assert abs(state[0] - reduced_four_bars(1, 0.5)[0]) < 1e-9


def test_long_runs_keep_energy_and_loops():
    multibody, state = four_bars(1)
    start, energy = state, sum(multibody.energy(state))
    end = advance(multibody, state, 2e-3, 50_000)  # 100 s
    assert abs(sum(multibody.energy(end)) - energy) < 1e-6 * abs(energy)
    assert multibody.joint_gap(motion_of(multibody, end)) < 1e-13
    assert not np.array_equal(start, end)


def test_a_loop_that_cannot_close_names_its_joint():
    multibody, state = four_bars(1)
    far = vars(multibody.tables) | {"closure_point": multibody.tables.closure_point * [[[9.0], [1.0]]]}
    torn = Multibody(type(multibody.tables)(**far), ["crank", "rod", "rocker"], ["pin"])
    with pytest.raises(SimulationError, match=r'joint "pin": expected bodies that close the loop'):
        torn.close(state)


def test_redundant_closures_change_nothing():
    """The same joint three times."""
    multibody, state = four_bars(2)
    t = multibody.tables
    thrice = {name: np.concatenate([getattr(t, name)] * 3) for name in vars(t) if name.startswith("closure_")}
    again = Multibody(type(t)(**(vars(t) | thrice)))
    once, more = (advance(m, state, 1e-3, 200) for m in (multibody, again))
    assert np.abs(once - more).max() < 1e-11
