"""Bounds of stability: wrenches that follow the velocity, and added mass."""

import numpy as np
import pytest

from linkwind.coupling import SCHEMES, Settings
from tests.coupling.masses import Masses, answer

BOUNDS = {0: 1.0, 1: 0.5, 2: 0.28, 3: 0.155}  # c h / m
WEIGHT = np.ones((1, 6))


def damped(ratio, steps=300, push=lambda t: 0.0, **settings):
    """Velocities of m dv/dt = push − c v, all of it exchanged, with c h/m = ratio."""
    h = 0.1

    def damper(step, iteration, accepted, trial):
        return answer(push(step * h) - ratio / h * trial[1])

    start = np.array([[0.0], [1.0]])
    run = SCHEMES["pec"](Masses(h, [1.0]), damper, start, steps, Settings(WEIGHT, **settings))
    return np.array([point.state[1, 0] for point in run])


@pytest.mark.parametrize("order", BOUNDS)
def test_bounds_of_a_fixed_degree(order):
    below, above = (damped(f * BOUNDS[order], order=order, adaptive=False) for f in (0.95, 1.07))
    assert np.abs(below[-50:]).max() < 0.01
    assert np.abs(above[-50:]).max() > 0.1
    assert np.abs(above[-50:]).max() > np.abs(above[100:150]).max()


@pytest.mark.parametrize("order", BOUNDS)
@pytest.mark.parametrize("ratio", [0.05, 0.14, 0.2, 0.3, 0.45, 0.6, 0.75, 0.9, 0.95])
def test_an_adaptive_degree_is_stable_up_to_the_bound_of_degree_0(order, ratio):
    velocity = damped(ratio, order=order)
    assert np.abs(velocity[-50:]).max() < 1e-5
    assert np.abs(velocity).max() < 1.0 + 1e-12, "nor does it overshoot at the start"


@pytest.mark.parametrize("ratio", [0.2, 0.4, 0.6, 0.9])
def test_an_adaptive_degree_is_about_as_accurate_as_degree_0_where_a_high_one_is_unstable(ratio):
    def push(t):
        return np.sin(0.5 * t)

    c = ratio / 0.1
    times = 0.1 * np.arange(1001)
    exact = (c * np.sin(0.5 * times) - 0.5 * np.cos(0.5 * times)) / (c * c + 0.25)
    errors = [np.abs(damped(ratio, 1000, push, order=order) - exact)[-500:].max() for order in (0, 3)]
    assert errors[1] < 2.0 * errors[0]


@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.parametrize(("mass", "added"), [(1.0, 0.5), (1.0, 5.0), (1.0, 50.0), (0.0, 2.0)])
def test_added_mass_is_stable_when_it_is_returned_as_added_inertia(scheme, mass, added):
    """m a + k x = −m_a a: oscillates at √(k / (m + m_a)); k is the plant's, so that only m_a is coupled."""
    h, stiffness = 0.05, 4.0

    def fluid(step, iteration, accepted, trial):
        return answer([0.0], added)

    start = np.array([[1.0], [0.0]])
    run = SCHEMES[scheme](Masses(h, [mass], stiffness), fluid, start, 400, Settings(WEIGHT))
    position = np.array([point.state[0, 0] for point in run])
    exact = np.cos(np.sqrt(stiffness / (mass + added)) * h * np.arange(401))
    np.testing.assert_allclose(position, exact, atol=1e-4)


@pytest.mark.parametrize(("mass", "added"), [(1.0, 0.5), (1.0, 50.0), (0.0, 2.0)])
def test_pec_with_spring_and_added_mass_both_coupled(mass, added):
    h, stiffness = 0.05, 4.0

    def fluid(step, iteration, accepted, trial):
        return answer(-stiffness * trial[0], added)

    start = np.array([[1.0], [0.0]])
    run = SCHEMES["pec"](Masses(h, [mass]), fluid, start, 400, Settings(WEIGHT))
    position = np.array([point.state[0, 0] for point in run])
    exact = np.cos(np.sqrt(stiffness / (mass + added)) * h * np.arange(401))
    np.testing.assert_allclose(position, exact, atol=1e-3)


@pytest.mark.parametrize(("added", "stable"), [(0.8, True), (1.2, False)])
def test_added_mass_that_is_differenced_instead_needs_a_heavier_body(added, stable):
    """Why A is exchanged: with the acceleration of the last step in the wrench, m_a < m is the limit."""
    h, last = 0.05, {}

    def fluid(step, iteration, accepted, trial):
        last[step] = trial[1]
        before = last.get(step - 1, trial[1])
        return answer(-added * (trial[1] - before) / h)

    start = np.array([[1.0], [0.0]])
    run = SCHEMES["explicit"](Masses(h, [1.0], 4.0), fluid, start, 200, Settings(WEIGHT))
    position = np.array([point.state[0, 0] for point in run])
    assert (np.abs(position).max() < 2.0) == stable
