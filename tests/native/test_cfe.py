"""Bodies with joints as forces between them move as the same mechanism in joint coordinates does."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linkwind.errors import SimulationError
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.multibody import Integrator, Multibody
from tests.native.mechanisms import (
    Body,
    motion_of,
    random_added,
    random_state,
    random_tree,
    space_mechanism,
    tables,
)
from tests.native.test_affine import positive

GRAVITY = (0.7, -2.1, -9.1)
HELD = np.zeros(1)
TIGHT = {"integrator": Integrator.DOPRI5, "rtol": 1e-12, "atol": 1e-12}


def cfe(multibody, stabilisation=Stabilisation.NONE, time=0.05):
    return Cfe(multibody.tables, stabilisation=stabilisation, time=time)


def arrays(multibody, state):
    motion = motion_of(multibody, state)
    return motion.position, motion.orientation, motion.linear, motion.angular


def same_start(multibody, state, joined):
    return joined.initial_state(*multibody.coordinates(state))


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.integers(1, 12), st.booleans())
def test_accelerations_and_reactions_on_random_trees(seed, n, with_added):
    """All joint types, springs, dampers and added inertia; and the energy, poses and joint coordinates."""
    rng = np.random.default_rng(seed)
    multibody = Multibody(tables(random_tree(rng, n, springs=True), GRAVITY))
    joined, state = cfe(multibody), random_state(rng, multibody)
    wrench, added = rng.normal(size=(n, 6)), random_added(rng, n) if with_added else None
    start = same_start(multibody, state, joined)
    expected, got = multibody.evaluate(state, wrench, added), joined.evaluate(start, wrench, added)
    size = max(1.0, np.abs(expected.reaction).max(), np.abs(expected.acceleration).max())
    for name in ("acceleration", "reaction", "total_wrench"):
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), atol=1e-10 * size, rtol=0)
    for ours, theirs in zip(joined.coordinates(start), multibody.coordinates(state), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)
    np.testing.assert_allclose(joined.energy(start), multibody.energy(state), rtol=1e-12)
    for ours, theirs in zip(arrays(joined, start), arrays(multibody, state), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-12)


def flight(multibody, state, end, steps, added, **options):
    rng = np.random.default_rng(8)
    wrench, work = rng.normal(size=(1, multibody.n, 6)), np.zeros(2)
    for _ in range(steps):
        state, done = multibody.advance(state, end / steps, HELD, wrench, added, **options)
        work += done
    return np.concatenate([np.ravel(array) for array in (*arrays(multibody, state), work)])


def space_case():
    rng = np.random.default_rng(5)
    multibody = Multibody(tables(space_mechanism(rng), GRAVITY))
    return multibody, random_state(rng, multibody), random_added(rng, multibody.n, 0.2)


@pytest.fixture(scope="module")
def limit():
    """Where the space mechanism is after 0.5 s, in joint coordinates."""
    multibody, state, added = space_case()
    return flight(multibody, state, 0.5, 20, added, **TIGHT)


@pytest.mark.parametrize("stabilisation", Stabilisation)
@pytest.mark.parametrize(
    ("integrator", "order", "steps"),
    [(Integrator.EULER, 1, 400), (Integrator.SEMI_IMPLICIT_EULER, 1, 400), (Integrator.RK4, 4, 80)],
)
def test_order_of_convergence_to_the_same_motion(limit, stabilisation, integrator, order, steps):
    """Poses, twists and work, under added inertia, springs and dampers."""
    multibody, state, added = space_case()
    joined = cfe(multibody, stabilisation)
    start = same_start(multibody, state, joined)
    errors = [
        np.abs(flight(joined, start, 0.5, count, added, integrator=integrator) - limit).max()
        for count in (steps, 2 * steps)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("stabilisation", Stabilisation)
def test_error_control_reaches_the_same_motion(limit, stabilisation):
    multibody, state, added = space_case()
    joined = cfe(multibody, stabilisation)
    got = flight(joined, same_start(multibody, state, joined), 0.5, 20, added, **TIGHT)
    np.testing.assert_allclose(got, limit, atol=1e-9)


def swinging_chain():
    """Three links on a ball joint, the last hinge across the others."""
    inertia, across = np.diag([0.02, 0.03, 0.04]), np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    ends = (0.25, 0.0, 0.0), (-0.25, 0.0, 0.0)
    return Multibody(
        tables(
            [
                Body(-1, "spherical", 1.0, inertia, child_point=ends[1]),
                Body(0, "revolute", 1.0, inertia, *ends),
                Body(1, "revolute", 1.0, inertia, *ends, across, across),
            ]
        )
    )


def test_drift_of_the_joints():
    """Left alone they open more and more; Baumgarte's method bounds that, projection leaves none."""
    multibody, wrench, gaps = swinging_chain(), np.zeros((1, 3, 6)), {}
    for stabilisation in Stabilisation:
        joined = cfe(multibody, stabilisation)
        state = joined.initial_state(np.array([1, 0, 0, 0, 0.3, -0.2]), np.array([1.0, 2, 0.5, 1, -1]))
        seen = []
        for _ in range(2000):
            state, _ = joined.advance(state, 5e-3, HELD, wrench, None, integrator=Integrator.RK4)
            seen.append(joined.joint_gap(motion_of(joined, state)))
        gaps[stabilisation] = np.reshape(seen, (4, 500)).max(axis=1)
    drift = gaps[Stabilisation.NONE]
    assert np.all(np.diff(drift) > 0.0)
    assert drift[-1] > 10 * drift[0] > 1e-5
    assert gaps[Stabilisation.BAUMGARTE].max() < drift[-1] / 100
    assert gaps[Stabilisation.PROJECTION].max() < 1e-14


@pytest.mark.parametrize("joint", ["revolute", "planar"])
def test_springs_remember_whole_turns(joint):
    """A joint that turns five times against its spring is not taken for one that turned less."""
    body = Body(-1, joint, 1.0, np.diag([0.1, 0.1, 0.2]), child_point=(0.1, 0.2, 0.0), stiffness=0.02)
    multibody = Multibody(tables([body], (0, 0, 0)))
    joined = cfe(multibody, Stabilisation.PROJECTION)
    q, v = np.zeros(multibody.nq), np.zeros(multibody.nv)
    v[-1] = 12.0
    states = multibody.initial_state(q, v), joined.initial_state(q, v)
    ends = []
    for core, state in zip((multibody, joined), states, strict=True):
        for _ in range(400):
            state, _ = core.advance(state, 1e-2, HELD, np.zeros((1, 1, 6)), None, integrator=Integrator.RK4)
        ends.append(core.coordinates(state)[0])
    assert ends[0][-1] > 10 * np.pi
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-5)


def test_a_wrench_that_depends_on_the_twist():
    """The affine step serves bodies with joints as it serves joint coordinates."""
    multibody, state, added = space_case()
    rng, joined = np.random.default_rng(2), cfe(multibody, Stabilisation.PROJECTION)
    response, about = positive(rng, 6 * multibody.n, 50.0), rng.normal(size=(multibody.n, 6))
    wrench = rng.normal(size=(1, multibody.n, 6))
    starts = state, same_start(multibody, state, joined)
    new, _, met = multibody.advance_affine(starts[0], 1e-3, HELD, wrench, added, response, about, **TIGHT)
    got, _, met_too = joined.advance_affine(starts[1], 1e-3, HELD, wrench, added, response, about, **TIGHT)
    np.testing.assert_allclose(met_too.wrench, met.wrench, atol=1e-9 * np.abs(met.wrench).max())
    ours, theirs = motion_of(joined, got), motion_of(multibody, new)
    np.testing.assert_allclose(ours.linear, theirs.linear, atol=1e-11)


def test_a_step_done_again_gives_the_same_bits():
    multibody, state, added = space_case()
    joined, other = (cfe(multibody, Stabilisation.PROJECTION) for _ in range(2))
    start, wrench = same_start(multibody, state, joined), np.ones((1, multibody.n, 6))

    def step(core, begin):
        return core.advance(begin, 0.01, HELD, wrench, added, integrator=Integrator.DOPRI5)[0]

    first = step(joined, start)
    step(joined, first)
    assert step(joined, start.copy()).tobytes() == step(other, start).tobytes() == first.tobytes()


def test_a_body_without_inertia_is_named():
    bodies = [Body(-1, "revolute"), Body(0, "revolute", inertia=np.diag([0.0, 0.0, 1.4]))]
    multibody = Multibody(tables(bodies))
    joined = Cfe(multibody.tables, ["arm", "rod"], stabilisation=Stabilisation.NONE, time=1.0)
    with pytest.raises(SimulationError, match='"rod": expected inertia to move the body; got a singular'):
        joined.evaluate(joined.initial_state(np.zeros(2), np.zeros(2)), np.zeros((2, 6)))


def test_joints_that_cannot_be_closed_again_are_named():
    multibody = swinging_chain()
    joined = cfe(multibody, Stabilisation.PROJECTION)
    state = joined.initial_state(np.array([1, 0, 0, 0, 0.3, -0.2]), np.array([50.0, 80, 20, 90, -70]))
    with pytest.raises(SimulationError, match=r"joint of body \d: expected a motion that keeps it closed"):
        joined.advance(
            state, 10.0, HELD, np.zeros((1, 3, 6)), None, integrator=Integrator.EULER, substeps=100
        )
