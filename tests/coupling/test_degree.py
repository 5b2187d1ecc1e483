"""The adaptive degree: the formula, and what it must choose."""

import numpy as np
import pytest

from linkwind.coupling.degree import MEMORY, DegreeControl

RANDOM = np.random.default_rng(3)
WEIGHT = RANDOM.uniform(0.1, 2.0, (2, 6))


def controlled(wrenches, order, *, adaptive=True):
    control = DegreeControl(WEIGHT, order, adaptive=adaptive)
    for wrench in wrenches:
        control.add(wrench)
    return control


@pytest.mark.parametrize("order", range(4))
def test_errors_are_those_of_extrapolation_smoothed(order):
    wrenches = RANDOM.normal(size=(12, 2, 6))
    expected = np.full(order + 1, np.nan)
    for k in range(1, len(wrenches)):
        for degree in range(min(order, k - 1) + 1):
            times = np.arange(k - degree - 1, k)
            values = wrenches[times].reshape(degree + 1, 12)
            extrapolated = np.polynomial.polynomial.polyfit(times - k, values, degree)[0].reshape(2, 6)
            missed = np.sum((WEIGHT * (wrenches[k] - extrapolated)) ** 2)
            old = expected[degree]
            expected[degree] = missed if np.isnan(old) else MEMORY * old + (1 - MEMORY) * missed
        np.testing.assert_allclose(
            controlled(wrenches[: k + 1], order).errors, expected, rtol=1e-9, equal_nan=True
        )


@pytest.mark.parametrize("order", range(4))
def test_full_degree_on_a_resolved_wrench_from_the_first_step(order):
    control = DegreeControl(WEIGHT, order, adaptive=True)
    for k in range(200):
        control.add(np.sin(0.2 * k + np.arange(12.0)).reshape(2, 6))
        assert control.next == min(k, order)


@pytest.mark.parametrize("order", range(1, 4))
def test_lowest_degree_on_an_alternating_or_a_constant_wrench(order):
    alternating = [(-1.0) ** k * np.ones((2, 6)) for k in range(order + 3)]
    assert controlled(alternating, order).next == 0
    assert controlled(alternating, order, adaptive=False).next == order
    assert controlled(np.ones((order + 3, 2, 6)), order).next == 0


def test_the_degree_comes_back_after_a_jump():
    smooth = np.sin(0.1 * np.arange(80))[:, None, None] * np.ones((2, 6))
    smooth[40:] += 5.0
    control = DegreeControl(WEIGHT, 3, adaptive=True)
    degrees = []
    for wrench in smooth:
        control.add(wrench)
        degrees.append(control.next)
    assert degrees[39] == 3
    assert min(degrees[40:45]) == 0
    assert degrees[-1] == 3
