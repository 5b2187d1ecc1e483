"""Mechanisms with loops, by two derivations: closures of a tree; joints as forces on free bodies."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from linkwind.errors import MechanismError
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.incremental import Incremental
from linkwind.native.multibody import Integrator
from tests.native.loops import four_bars, random_loops
from tests.native.mechanisms import KEPT, motion_of, random_added

HELD = np.zeros(1)
TIGHT = {"integrator": Integrator.DOPRI5, "rtol": 1e-11, "atol": 1e-11}


def cfe(multibody, stabilisation=Stabilisation.NONE):
    return Cfe(multibody.tables, stabilisation=stabilisation, time=0.05)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.integers(0, 10_000), st.integers(3, 9), st.lists(st.sampled_from([*KEPT]), min_size=1, max_size=3))
def test_accelerations_and_reactions_of_random_loops(seed, n, kinds):
    """All kinds of closure, redundant ones too; where none is, the reactions are settled as well."""
    rng = np.random.default_rng(seed)
    *_, multibody, state = random_loops(rng, n, tuple(kinds))
    joined, wrench, added = cfe(multibody), rng.normal(size=(n, 6)), random_added(rng, n)
    start = joined.initial_state(*multibody.coordinates(state))
    expected, got = multibody.evaluate(state, wrench, added), joined.evaluate(start, wrench, added)
    size = max(1.0, np.abs(expected.acceleration).max(), np.abs(expected.closure_reaction).max())
    np.testing.assert_allclose(got.acceleration, expected.acceleration, atol=1e-10 * size, rtol=0)
    _, jacobian = multibody.violations(state)
    if np.linalg.matrix_rank(jacobian, tol=1e-3) == multibody.rows:
        np.testing.assert_allclose(got.reaction, expected.reaction, atol=1e-8 * size, rtol=0)
        np.testing.assert_allclose(got.closure_reaction, expected.closure_reaction, atol=1e-8 * size, rtol=0)


@pytest.mark.parametrize("seed", range(6))
def test_flights_of_random_loops(seed):
    """The same motion to the tolerance of both, joints and loops closed to round-off."""
    rng = np.random.default_rng(seed)
    kinds = rng.choice(["spherical", "revolute", "distance", "planar"], 2)
    *_, multibody, state = random_loops(rng, 7, tuple(kinds))
    joined, wrench = cfe(multibody, Stabilisation.PROJECTION), rng.normal(size=(1, 7, 6))
    other = joined.initial_state(*multibody.coordinates(state))
    for _ in range(10):
        state, _ = multibody.advance(state, 0.02, HELD, wrench, None, **TIGHT)
        other, _ = joined.advance(other, 0.02, HELD, wrench, None, **TIGHT)
    ours, theirs = motion_of(joined, other), motion_of(multibody, state)
    size = max(1.0, np.abs(theirs.linear).max())
    np.testing.assert_allclose(ours.position, theirs.position, atol=1e-8 * size)
    np.testing.assert_allclose(ours.linear, theirs.linear, atol=1e-7 * size)
    assert joined.joint_gap(ours) < 1e-13 * max(1.0, np.abs(theirs.position).max())


def test_windows_that_fold_to_a_line_and_open_again():
    """The N-four-bar mechanism passes positions where its loops are redundant for an instant."""
    multibody, state = four_bars(2)
    joined, wrench = cfe(multibody, Stabilisation.PROJECTION), np.zeros((1, multibody.n, 6))
    state = joined.initial_state(*multibody.coordinates(state))
    before = sum(joined.energy(state))
    for _ in range(2000):
        state, _ = joined.advance(state, 1e-3, HELD, wrench, None, integrator=Integrator.RK4)
    assert sum(joined.energy(state)) == pytest.approx(before, abs=1e-6)
    assert joined.joint_gap(motion_of(joined, state)) < 1e-14


def test_the_paper_has_no_loops():
    with pytest.raises(MechanismError, match=r'loop "last": expected none'):
        Incremental(four_bars(1)[0].tables, closures=["last"])
