"""Observed orders of the schemes, and the identity of `explicit` with the paper's update."""

import numpy as np
import pytest

from linkwind.coupling import SCHEMES, Answer, Settings
from tests.coupling import two_link_reference as two_link
from tests.coupling.masses import Masses, answer

ORDERS = {0: 2, 1: 2, 2: 3, 3: 4}


def accepted(scheme, plant, exchange, initial, steps, weight, **settings):
    run = SCHEMES[scheme](plant, exchange, initial, steps, Settings(weight, **settings))
    return np.array([point.state for point in run])


def slopes(errors):
    return np.log2(np.array(errors[:-1]) / np.array(errors[1:]))


def fly(scheme, field, steps, method="rk4", **settings):
    h = two_link.END / steps
    plant, exchange = two_link.TwoLink(h, method), two_link.exchange(field, h)
    return accepted(scheme, plant, exchange, two_link.START, steps, two_link.WEIGHT, **settings)


@pytest.fixture(scope="module")
def breeze():
    return two_link.reference(two_link.breeze, 60)


@pytest.mark.parametrize("adaptive", [True, False])
@pytest.mark.parametrize("order", ORDERS)
def test_order_of_pec_where_the_wrench_depends_on_the_motion(order, adaptive, breeze):
    errors = []
    for fine in (1, 2, 4):
        states = fly("pec", two_link.breeze, 60 * fine, order=order, adaptive=adaptive)[::fine]
        errors.append(np.abs(states - breeze).sum())
    assert slopes(errors) == pytest.approx(ORDERS[order], abs=0.2)


def test_explicit_is_of_first_order_whatever_the_integrator(breeze):
    errors = [
        np.abs(fly("explicit", two_link.breeze, 60 * fine)[::fine] - breeze).sum() for fine in (1, 2, 4)
    ]
    assert slopes(errors) == pytest.approx(1, abs=0.2)


@pytest.mark.parametrize("method", ["euler", "semi_implicit_euler"])
def test_explicit_is_the_paper_s_update(method):
    h, z = 1e-3, two_link.START
    states = fly("explicit", two_link.f1, 1200, method)
    for k in range(100):
        velocity = z[4:] + h * two_link.acceleration(z, two_link.f1(k * h, z))
        z = np.concatenate([z[:4] + h * (z[4:] if method == "euler" else velocity), velocity])
        np.testing.assert_allclose(states[k + 1], z, rtol=1e-14, atol=1e-14)


def test_mean_wrenches_keep_the_impulse():
    h, steps = 0.02, 50

    def mean(step, iteration, accepted, trial):
        return answer([(np.cos(5 * h * (step - 1)) - np.cos(5 * h * step)) / (5 * h)])

    states = accepted("pec", Masses(h, [2.0]), mean, np.zeros((2, 1)), steps, np.full((1, 6), 0.5), held=True)
    times = h * np.arange(steps + 1)
    np.testing.assert_allclose(states[:, 1, 0], (1 - np.cos(5 * times)) / 5 / 2.0, atol=1e-13)


def oscillator(scheme, **settings):
    """Largest errors of two masses, ground springs 4π², a spring 16π² between; preCICE's `oscillator`.

    The pull of the other mass is what is exchanged; window 0.01, to t = 1.
    """
    h, between = 0.01, 16 * np.pi**2
    plant = Masses(h, [1.0, 1.0], 4 * np.pi**2 + between)
    states = accepted(
        scheme,
        plant,
        lambda step, iteration, accepted, trial: answer(between * trial[0, ::-1]),
        np.array([[1.0, 0.0], [0.0, 0.0]]),
        100,
        np.ones((2, 6)),
        **settings,
    )
    times = h * np.arange(101)
    slow, fast = np.cos(2 * np.pi * times), np.cos(6 * np.pi * times)
    return np.abs(states[:, 0] - np.stack([slow + fast, slow - fast], axis=1) / 2).max(axis=0)


def test_explicit_has_the_error_of_precice_s_parallel_explicit_scheme():
    assert oscillator("explicit") == pytest.approx([0.293, 0.404], abs=6e-4)


@pytest.mark.parametrize("adaptive", [True, False])
def test_pec_of_order_3_is_four_thousand_times_better_with_as_many_exchanges(adaptive):
    better = oscillator("explicit") / oscillator("pec", order=3, adaptive=adaptive)
    assert better.min() > 4000


@pytest.mark.parametrize("order", range(4))
def test_an_adaptive_degree_does_no_harm_where_the_steps_are_too_coarse(order):
    """F0 at 12 ms: half a period of its 40 Hz. Fixed at 3 it is an order of magnitude worse than at 0."""
    field = two_link.f0
    exact = two_link.velocities(two_link.reference(field, 100))
    errors = {
        p: np.abs(two_link.velocities(fly("pec", field, 100, order=p, adaptive=True)) - exact).sum()
        for p in {0, order}
    }
    assert errors[order] < 2.5 * errors[0]


def test_the_first_wrench_is_replaced_by_one_that_the_others_agree_on():
    """It is the only one that does not come from its own answer, and differs by what a quartic misses."""

    def clock(step, iteration, accepted, trial):
        return Answer(np.full((1, 6), np.sin(0.1 * step)))

    run = SCHEMES["pec"](Masses(0.1, [1.0]), clock, np.zeros((2, 1)), 20, Settings(np.ones((1, 6))))
    missed = [abs(point.wrench[0, 0] - np.sin(0.1 * point.step)) for point in run]
    assert 0 < missed.pop(1) < 0.1**5
    assert max(missed) == 0
