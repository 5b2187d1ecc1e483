"""Observed orders, error control and reproducibility of the integrators."""

import numpy as np
import pytest

from linkwind.errors import SimulationError
from linkwind.native.multibody import Integrator, Multibody
from tests.native.mechanisms import Body, random_added, random_state, space_mechanism, tables, two_link

ORDER = dict(zip(Integrator, (1, 1, 4, 5, 5), strict=True))
NODES = np.array([-2.0, -1.0, 0.0, 1.0])
TIGHT = {"integrator": Integrator.DOPRI5, "rtol": 1e-13, "atol": 1e-13}


# Step counts at which the leading term of the error rules and round-off does not.
STEPS = {
    ("planar", 1): 1600, ("planar", 4): 80, ("planar", 5): 80,
    ("space", 1): 800, ("space", 4): 80, ("space", 5): 40,
}  # fmt: skip


def case(name):
    """A mechanism, its start, a wrench as coefficients of a cubic in time, A, and how long to fly [s]."""
    rng = np.random.default_rng(3)
    multibody = Multibody(tables(two_link() if name == "planar" else space_mechanism(rng)))
    state = random_state(rng, multibody, {"planar": 3.0, "space": 1.0}[name])
    load = rng.normal(size=(4, multibody.n, 6)) * np.reshape([3.0, 1.0, 0.3, 0.1], (4, 1, 1))
    return multibody, state, load, random_added(rng, multibody.n, 0.2), {"planar": 2.0, "space": 0.4}[name]


def fly(multibody, state, load, added, end, steps, **options):
    """March under a wrench that is one cubic in time, resampled at the nodes of every step."""
    h, work = end / steps, np.zeros(2)
    for k in range(steps):
        t = (k + NODES) * h
        wrenches = np.einsum("pm,pnj->mnj", t ** np.arange(4)[:, None], load)
        state, done = multibody.advance(state, h, NODES, wrenches, added, **options)
        work += done
    return state[:-1], work


@pytest.mark.parametrize("name", ["planar", "space"])
@pytest.mark.parametrize("integrator", Integrator)
def test_observed_order(name, integrator):
    multibody, state, load, added, end = case(name)
    exact, exact_work = fly(multibody, state, load, added, end, 400, **TIGHT)
    loose = {"integrator": integrator, "rtol": 1e9, "atol": 1e9}
    coarse = STEPS[name, ORDER[integrator]]
    runs = [fly(multibody, state, load, added, end, steps, **loose) for steps in (coarse, 2 * coarse)]
    errors = [np.abs(got - exact).max() for got, _ in runs]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(ORDER[integrator], abs=0.2)
    errors = [np.abs(work - exact_work).max() for _, work in runs]
    assert np.log2(errors[0] / errors[1]) > ORDER[integrator] - 0.3  # the quadratures keep up


@pytest.mark.parametrize("integrator", [i for i in Integrator if i != Integrator.DOPRI5])
def test_substeps_are_steps(integrator):
    """4 substeps of one macro step are 4 macro steps, but for the rounding of the times."""
    multibody, state, load, added, end = case("space")
    one, work = fly(multibody, state, load, added, end, 5, integrator=integrator, substeps=4)
    four, work4 = fly(multibody, state, load, added, end, 20, integrator=integrator)
    np.testing.assert_allclose(one, four, atol=1e-12)
    np.testing.assert_allclose(work, work4, atol=1e-12)


def test_euler_moves_with_the_old_velocity_and_semi_implicit_with_the_new():
    multibody = Multibody(tables([Body(-1, "prismatic", 2.0)], (0, 0, 0)))
    push = np.array([[[0, 0, 6.0, 0, 0, 0]]])
    state = multibody.initial_state([1.0], [0.5])
    expected = {Integrator.EULER: 1.05, Integrator.SEMI_IMPLICIT_EULER: 1.08}
    for integrator, q in expected.items():
        end, _ = multibody.advance(state, 0.1, np.zeros(1), push, None, integrator=integrator)
        np.testing.assert_allclose(end, [q, 0.8, 0.0], rtol=1e-15)


@pytest.mark.parametrize("integrator", [Integrator.RK4, Integrator.DOPRI5, Integrator.RADAU5])
def test_wrench_is_the_polynomial_through_its_nodes(integrator):
    """A cubic force is integrated exactly, whatever the nodes: m v(1) = integral, m x(1) likewise."""
    multibody = Multibody(tables([Body(-1, "prismatic", 2.0)], (0, 0, 0)))
    nodes = np.array([-1.7, -0.4, 0.1, 1.0])
    wrenches = np.zeros((4, 1, 6))
    wrenches[:, 0, 2] = 1.0 - 2.0 * nodes + 3.0 * nodes**2 - 4.0 * nodes**3
    end, _ = multibody.advance(
        multibody.initial_state([0.0], [0.0]), 1.0, nodes, wrenches, None, integrator=integrator, substeps=1
    )
    assert end[1] == pytest.approx((1 - 1 + 1 - 1) / 2, abs=1e-13)
    # two integrals of the cubic: orders 4 and 5 of the methods are exact to degree 4 and 5 of x(t)
    exact = (1 / 2 - 1 / 3 + 1 / 4 - 1 / 5) / 2
    assert end[0] == pytest.approx(exact, abs=2e-2 if integrator == Integrator.RK4 else 1e-13)


def test_dopri5_error_follows_the_tolerance():
    multibody, state, load, added, _ = case("space")
    exact, _ = fly(multibody, state, load, added, 2.0, 200, **TIGHT)
    tolerances = 10.0 ** np.arange(-4, -11, -2)
    ends = [fly(multibody, state, load, added, 2.0, 1, integrator=3, rtol=t, atol=t)[0] for t in tolerances]
    errors = [np.abs(got - exact).max() for got in ends]
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    assert 0.8 < slope < 1.2
    assert errors[-1] < 1e-7


def test_dopri5_remembers_its_step():
    multibody, state, load, added, _ = case("space")
    wrenches = np.ascontiguousarray(load[:1])
    tolerance = {"integrator": Integrator.DOPRI5, "rtol": 1e-8, "atol": 1e-8}
    after, _ = multibody.advance(state, 0.5, np.zeros(1), wrenches, added, **tolerance)
    assert 0.0 < after[-1] < 0.5
    short, _ = multibody.advance(after, 1e-5 * after[-1], np.zeros(1), wrenches, added, **tolerance)
    assert short[-1] == after[-1]  # a step cut short by the macro step says nothing


@pytest.mark.parametrize("integrator", Integrator)
def test_a_step_done_again_gives_the_same_bits(integrator):
    multibody, state, load, added, _ = case("space")
    wrenches = np.ascontiguousarray(load)

    def step(start):
        return multibody.advance(start, 0.05, NODES, wrenches, added, integrator=integrator, substeps=2)

    first, work = step(state)
    step(first)  # something else in between
    multibody.evaluate(first, wrenches[0])
    again, work_again = step(state.copy())
    assert first.tobytes() == again.tobytes()
    assert work.tobytes() == work_again.tobytes()
    other = Multibody(multibody.tables)
    fresh, _ = other.advance(state, 0.05, NODES, wrenches, added, integrator=integrator, substeps=2)
    assert fresh.tobytes() == first.tobytes()


def test_dopri5_gives_up_where_no_step_is_small_enough():
    """A stiffness beyond what the smallest substep can follow."""
    multibody = Multibody(tables([Body(-1, "prismatic", 1e-12, stiffness=1e30)], (0, 0, 0)))
    with pytest.raises(SimulationError, match="dopri5"):
        multibody.advance(
            multibody.initial_state([1.0], [0.0]), 1.0, np.zeros(1), np.zeros((1, 1, 6)), None,
            integrator=Integrator.DOPRI5,
        )  # fmt: skip


def test_joint_coordinates_may_have_room_between_them():
    """Coordinates that no joint uses keep their value and change nothing."""
    multibody, state, load, added, end = case("planar")
    t = multibody.tables
    wide = {"q_index": np.array([0, 5]), "v_index": np.array([1, 6])}
    arrays = vars(t) | wide
    arrays |= {"rest": np.zeros(7), "stiffness": np.zeros(8), "damping": np.zeros(8)}
    roomy = Multibody(type(t)(**arrays))
    q, v = np.full(7, 9.0), np.full(8, 7.0)
    q[[0, 1, 2, 5]], v[[1, 2, 3, 6]] = state[:4], state[4:8]
    for integrator in Integrator:
        got, _ = fly(multibody, state, load, added, end, 3, integrator=integrator)
        wide, _ = fly(roomy, roomy.initial_state(q, v), load, added, end, 3, integrator=integrator)
        used = [0, 1, 2, 5, 8, 9, 10, 13]
        if integrator != Integrator.DOPRI5:  # its error norm is a mean over all coordinates
            assert wide[used].tobytes() == got.tobytes()
        np.testing.assert_array_equal(np.delete(wide, used), [9, 9, 9, 7, 7, 7, 7])


def test_a_trial_that_cannot_be_evaluated_is_shortened():
    """At first trial of this step the mechanism flies so far that its inertia drowns in round-off."""
    rng = np.random.default_rng(11)
    multibody = Multibody(tables(space_mechanism(rng)))
    state, wrenches = random_state(rng, multibody), 10.0 * rng.normal(size=(4, 5, 6))
    with pytest.raises(SimulationError, match="singular"):
        multibody.advance(state, 100.0, NODES, wrenches, None, integrator=Integrator.RK4)
    options = {"integrator": Integrator.DOPRI5, "rtol": 1e-9, "atol": 1e-9}
    end, (work, dissipated) = multibody.advance(state, 100.0, NODES, wrenches, None, **options)
    change = sum(multibody.energy(end)) - sum(multibody.energy(state))
    assert change == pytest.approx(work - dissipated, abs=1e-6 * max(abs(work), dissipated))
