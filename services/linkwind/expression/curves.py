"""Curves through the points of a table, as the cubic pieces of ``lw_expression.h``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from linkwind.expression.spline import slopes
from linkwind.scenario.functions import Function
from linkwind.spatial import Array

# How far the last piece of a spline goes on, in parts of its length: a time that is a sum of steps may be a
# little after the last place, where a rate must not fall to zero yet.
BEYOND = 1e-9


@dataclass(frozen=True)
class Curve:
    """A function of one variable that goes through points; beyond its ends it keeps their values.

    Attributes:
        points: places, ascending, and values.
        interpolation: linear; cubic, monotone with a continuous derivative; or spline, with two of them.
        periodic: goes on as it was; the last value is the first.
    """

    points: tuple[tuple[float, float], ...]
    interpolation: Literal["linear", "cubic", "spline"] = "linear"
    periodic: bool = False

    def layout(self) -> list[float]:
        """Return number of pieces, period or 0, the places, and four coefficients of each piece."""
        x, y = np.array(self.points).T
        width, slope = np.diff(x), np.diff(y) / np.diff(x)
        pieces = np.zeros((len(width), 4))
        pieces[:, 0], pieces[:, 1] = y[:-1], slope
        if self.interpolation != "linear":
            at = self._slopes()
            pieces[:, 1] = at[:-1]
            pieces[:, 2] = (3.0 * slope - 2.0 * at[:-1] - at[1:]) / width
            pieces[:, 3] = (at[:-1] + at[1:] - 2.0 * slope) / width**2
        period = float(x[-1] - x[0]) if self.periodic else 0.0
        return [float(len(width)), period, *x[:-1].tolist(), self.end, *pieces.ravel().tolist()]

    @property
    def end(self) -> float:
        """Up to where the curve is no constant yet."""
        first, last = self.points[0][0], self.points[-1][0]
        goes_on = self.interpolation == "spline" and not self.periodic
        return last + BEYOND * (last - first) if goes_on else last

    def end_rates(self) -> tuple[float, float]:
        """Return the derivatives at the ends of a curve that is not linear, from within."""
        at = self._slopes()
        return float(at[0]), float(at[-1])

    def _slopes(self) -> Array:
        if self.interpolation == "spline":
            return np.array(slopes(self.points, periodic=self.periodic))
        x, y = np.array(self.points).T
        return _monotone(np.diff(x), np.diff(y) / np.diff(x), periodic=self.periodic)


def curve(function: Function) -> Curve:
    """Return the curve of a function that is stated as a table."""
    assert function.table is not None
    return Curve(function.table, function.interpolation, function.periodic)


def law(function: Function) -> str | Curve:
    """Return a function as the compiler takes it: its expression, or its curve."""
    return function.expression or "" if function.table is None else curve(function)


def _monotone(width: Array, slope: Array, *, periodic: bool) -> Array:
    """Return slopes at the points that keep the curve as monotone as the points are; flat at its ends.

    Weighted harmonic means: F. N. Fritsch, J. Butland 1984, doi:10.1137/0905021.
    """
    at = np.zeros(len(slope) + 1)
    at[1:-1] = _mean(width[:-1], width[1:], slope[:-1], slope[1:])
    if periodic:
        at[0] = at[-1] = _mean(width[-1:], width[:1], slope[-1:], slope[:1])[0]
    return at


def _mean(before: Array, after: Array, left: Array, right: Array) -> Array:
    mean, same = np.zeros(len(left)), left * right > 0.0
    first, second = (2.0 * after + before)[same], (after + 2.0 * before)[same]
    mean[same] = (first + second) / (first / left[same] + second / right[same])
    return mean
