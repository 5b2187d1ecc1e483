"""What a response G buys: forces that follow the velocity, or its change, are stable in one exchange."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from linkwind.coupling import SCHEMES, Settings
from linkwind.errors import SimulationError
from tests.coupling.masses import Masses, answer

WEIGHT = np.ones((1, 6))
STIFFNESS = 4.0


def oscillator(mass, added, h, steps, *, given=True, scheme="pec"):
    """Positions of a mass on a spring whose fluid differences the motion: W = −m_a (v_end − v_start)/h.

    The mean over the step is exact; the provider returns it for the trial state, with G = m_a/h or without.
    """

    def fluid(step, iteration, accepted, trial):
        asked.append(step)
        force = -added * (trial[1] - accepted[1]) / h
        return answer(force, response=added / h if given else None)

    asked = []
    settings = Settings(WEIGHT, held=True)
    start = np.array([[1.0], [0.0]])
    try:
        points = list(SCHEMES[scheme](Masses(h, [mass], STIFFNESS), fluid, start, steps, settings))
    except (FloatingPointError, SimulationError):
        return np.array([np.inf])
    assert asked == list(range(steps + 1)), "one exchange a step"
    return np.array([point.state[0, 0] for point in points])


@pytest.mark.parametrize("mass", [10.0, 1.0, 0.1, 0.01, 0.0])
def test_added_mass_hidden_in_a_mean_wrench_is_right_down_to_no_mass_with_its_response(mass):
    added, errors = 1.0, []
    for h in (0.02, 0.01, 0.005):
        steps = round(10.0 / h)
        exact = np.cos(np.sqrt(STIFFNESS / (mass + added)) * h * np.arange(steps + 1))
        errors.append(np.abs(oscillator(mass, added, h, steps) - exact).max())
    assert errors[-1] < 5e-2
    for coarse, fine in pairwise(errors):
        assert fine < 0.6 * coarse, "converges at first order at least"


@pytest.mark.filterwarnings("ignore:.*encountered:RuntimeWarning")
@pytest.mark.parametrize("scheme", ["explicit", "pec"])
def test_without_the_response_the_same_fluid_blows_up_once_it_outweighs_the_mass(scheme):
    light = oscillator(0.3, 1.0, 0.01, 1000, given=False, scheme=scheme)
    heavy = oscillator(3.0, 1.0, 0.01, 1000, given=False, scheme=scheme)
    assert not np.abs(light).max() < 1e3
    assert np.abs(heavy).max() < 1.1


def braked(ratio, order, h=0.1, steps=200):
    """Velocities of a unit mass under the point force −c v + sin t, c h = ratio, with its response."""
    c = ratio / h

    def fluid(step, iteration, accepted, trial):
        return answer(-c * trial[1] + np.sin(h * step), response=c)

    start = np.array([[0.0], [1.0]])
    points = SCHEMES["pec"](
        Masses(h, [1.0]), fluid, start, steps, Settings(WEIGHT, order=order, adaptive=False)
    )
    times = h * np.arange(steps + 1)
    exact = (c * np.sin(times) - np.cos(times)) / (c * c + 1.0)
    exact += (1.0 + 1.0 / (c * c + 1.0)) * np.exp(-c * times)
    return np.array([point.state[1, 0] for point in points]) - exact


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("ratio", [0.2, 1.0, 1.5, 2.9, 3.1, 10.0, 100.0, 1000.0])
def test_stiff_damping_is_stable_where_it_could_not_be_without_the_response(ratio, order):
    """Without it, `pec` is stable up to c h/m = 0.5, 0.28, 0.15 with the degree fixed at 1, 2, 3."""
    assert np.abs(braked(ratio, order)[-10:]).max() < 3e-3


@pytest.mark.parametrize("order", [1, 2, 3])
def test_the_response_keeps_the_order_on_smooth_forces(order):
    steps = (0.04, 0.02, 0.01)
    errors = [np.abs(braked(h, order, h, round(4.0 / h))[-5:]).max() for h in steps]
    for coarse, fine in pairwise(errors):
        assert np.log2(coarse / fine) > order + 0.8
