"""Numbers out of force histories."""

from __future__ import annotations

import numpy as np

from linkwind.spatial import Array


def between(t: Array, x: Array, start: float, end: float) -> Array:
    """Return the values of a history from one time to another."""
    found: Array = x[(t >= start) & (t < end)]
    return found


def whole_periods(t: Array, x: Array) -> tuple[float, float, int]:
    """Return begin and end of the whole periods of an oscillation about its mean, and how many there are.

    Periods go from one upward crossing of the mean to the next, found by linear interpolation.
    """
    y = x - x.mean()
    before = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    if len(before) < 2:
        return float(t[0]), float(t[-1]), 0
    at = t[before] - y[before] * (t[before + 1] - t[before]) / (y[before + 1] - y[before])
    return float(at[0]), float(at[-1]), len(at) - 1


def frequency(t: Array, x: Array) -> float:
    """Return the frequency of an oscillation [1/s]; NaN below one whole period."""
    start, end, count = whole_periods(t, x)
    return count / (end - start) if count else float("nan")


def amplitude(x: Array) -> float:
    """Return half the distance of the largest and the least value."""
    return 0.5 * float(np.ptp(x))


def fit(x: Array, *basis: Array) -> Array:
    """Return the coefficients of ``basis`` that come closest to x, by least squares."""
    return np.asarray(np.linalg.lstsq(np.stack(basis, axis=1), x, rcond=None)[0], np.float64)
