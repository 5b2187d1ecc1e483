"""Coupling iterations: what they cost, and what only they can do."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from linkwind.coupling import SCHEMES, Settings
from linkwind.coupling.acceleration import ACCELERATIONS
from linkwind.errors import SimulationError
from tests.coupling.masses import Masses, answer

WEIGHT = np.ones((1, 6))

# Two masses on springs to the ground with a spring between them, preCICE's partitioned oscillator
# (doi:10.12688/openreseurope.14445.2): m = 1, k = 4π², k₁₂ = 16π², u(0) = (1, 0), at rest.
GROUND, BETWEEN = 4.0 * np.pi**2, 16.0 * np.pi**2


def oscillator(h, end=1.0, scheme="implicit", **settings):
    """Run the left mass as the plant and the right one as the provider, which goes back for an iteration.

    Each has the spring between them as its own stiffness; exchanged are the displacements, as forces k₁₂ u on
    the other. Returns the left displacements and the number of exchanges a step.
    """
    right = Masses(h, [1.0], GROUND + BETWEEN, substeps=16)
    times, memory, pushes = [], {}, {}

    def provider(step, iteration, accepted, trial):
        """Let the right mass go along under the cubic through the left displacements that are known."""
        times.append(step)
        pushes[step] = BETWEEN * trial[0, 0]
        if step == 0:
            memory[0] = np.array([[0.0], [0.0]])
            return answer([0.0])
        pushes[step - 1] = BETWEEN * accepted[0, 0]
        nodes = np.arange(step, max(-1, step - 4), -1)
        wrenches = np.zeros((len(nodes), 1, 6))
        wrenches[:, 0, 0] = [pushes[k] for k in nodes]
        memory[step] = right.advance(memory[step - 1], nodes - step + 1.0, wrenches, None)
        return answer([BETWEEN * memory[step][0, 0]])

    left = Masses(h, [1.0], GROUND + BETWEEN, substeps=16)
    steps = round(end / h)
    start = np.array([[1.0], [0.0]])
    points = list(SCHEMES[scheme](left, provider, start, steps, Settings(WEIGHT, **settings)))
    displacement = np.array([point.state[0, 0] for point in points])
    return displacement, (len(times) - 1) / steps


def exact(h, end=1.0):
    """The left displacement: half the sum of the symmetric and the antisymmetric motion."""
    t = h * np.arange(round(end / h) + 1)
    return 0.5 * (np.cos(np.sqrt(GROUND) * t) + np.cos(np.sqrt(GROUND + 2.0 * BETWEEN) * t))


@pytest.mark.parametrize("acceleration", ACCELERATIONS)
def test_two_masses_with_a_spring_between_them_agree_to_third_order_in_a_few_iterations(acceleration):
    """preCICE, window 0.01: explicit 0.125; implicit with samples within the window 1.2e-7, 3.7 iterations.

    Here the window has samples at its ends only, and the first window no others before it.
    """
    found, exchanges = oscillator(0.01, acceleration=acceleration)
    error = np.abs(found - exact(0.01)).max()
    assert error < 2e-4
    assert exchanges < 5.0
    finer = np.abs(oscillator(0.0025, acceleration=acceleration)[0] - exact(0.0025)).max()
    assert finer < error / 50.0


@pytest.mark.parametrize("acceleration", ACCELERATIONS)
@pytest.mark.parametrize("ratio", [0.5, 2.0, 10.0, 50.0])
def test_added_mass_that_a_provider_hides_takes_a_few_iterations_whatever_its_ratio(ratio, acceleration):
    """A mean wrench W = −m_a (v_end − v_start)/h, no response: one exchange is stable up to m_a/m = 1."""
    h, stiffness, steps = 0.02, 4.0, 300
    asked = []

    def fluid(step, iteration, accepted, trial):
        asked.append(step)
        return answer(-ratio * (trial[1] - accepted[1]) / h)

    settings = Settings(WEIGHT, held=True, acceleration=acceleration)
    run = SCHEMES["implicit"](Masses(h, [1.0], stiffness), fluid, np.array([[1.0], [0.0]]), steps, settings)
    position = np.array([point.state[0, 0] for point in run])
    right = np.cos(np.sqrt(stiffness / (1.0 + ratio)) * h * np.arange(steps + 1))
    assert np.abs(position - right).max() < 0.05
    assert len(asked) / steps < 5.0


@pytest.mark.parametrize("order", [1, 2, 3])
def test_order_on_a_spring_and_damper_that_are_the_fluid_s(order):
    errors = []
    for h in (0.1, 0.05, 0.025):

        def fluid(step, iteration, accepted, trial):
            return answer(-4.0 * trial[0] - 0.5 * trial[1])

        steps = round(4.0 / h)
        settings = Settings(WEIGHT, order=order)
        points = SCHEMES["implicit"](Masses(h, [1.0]), fluid, np.array([[1.0], [0.0]]), steps, settings)
        end = list(points)[-1].state[0, 0]
        w = np.sqrt(4.0 - 0.0625)
        errors.append(abs(end - np.exp(-1.0) * (np.cos(4.0 * w) + 0.25 / w * np.sin(4.0 * w))))
    for coarse, fine in pairwise(errors):
        assert np.log2(coarse / fine) > min(order, 2) + 0.6


def test_a_step_is_accepted_with_the_motion_that_the_provider_saw_last():
    seen = []

    def fluid(step, iteration, accepted, trial):
        seen.append((step, iteration, accepted, trial))
        return answer(-3.0 * trial[1])

    points = list(
        SCHEMES["implicit"](Masses(0.1, [1.0]), fluid, np.array([[0.0], [1.0]]), 20, Settings(WEIGHT))
    )
    for point in points:
        last = [trial for step, _, _, trial in seen if step == point.step][-1]
        assert last is point.state
    for step in range(1, 21):
        iterations = [i for k, i, _, _ in seen if k == step]
        assert iterations == list(range(len(iterations)))
        assert all(accepted is points[step - 1].state for k, _, accepted, _ in seen if k == step)


def test_a_response_takes_the_place_of_the_acceleration():
    """With an exact one, the second exchange only confirms."""
    count = []

    def fluid(step, iteration, accepted, trial):
        count.append(step)
        return answer(-40.0 * trial[1] + 1.0, response=40.0)

    settings = Settings(WEIGHT, held=True)
    points = list(SCHEMES["implicit"](Masses(0.1, [0.0]), fluid, np.array([[0.0], [0.0]]), 20, settings))
    assert points[-1].state[1, 0] == pytest.approx(1.0 / 40.0, rel=1e-10)
    assert len(count) <= 1 + 2 * 20


def test_what_does_not_converge_stops_the_run_with_the_step_and_the_residual():
    def chaos(step, iteration, accepted, trial):
        return answer([np.sin(37.0 * (50.0 * step + iteration + 1.0))])

    settings = Settings(WEIGHT, iterations=7)
    run = SCHEMES["implicit"](Masses(0.1, [1.0]), chaos, np.array([[0.0], [0.0]]), 5, settings)
    with pytest.raises(
        SimulationError, match=r"step 1: coupling.iterations: expected .* within 7 iterations"
    ):
        list(run)
