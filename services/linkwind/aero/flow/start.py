"""A smooth start: the wind comes up slowly, instead of hitting bodies at rest all at once."""

from __future__ import annotations

import math

import numpy as np

from linkwind.aero.flow.grid import Grid
from linkwind.spatial import Array


class SmoothStart:
    """The twists that the fluid is given: at first those of the stream, then more and more the bodies'.

    Args:
        stated: the time to start in [s]; None for the wind's time along the longest body.
        grid: with the wind and the longest body.
        first: twists of the bodies at the start, shape (n, 3) in the plane, (n, 6) in space, in W.
    """

    def __init__(self, stated: float | None, grid: Grid, first: Array) -> None:
        speed = math.hypot(*grid.wind)
        default = grid.length / speed if speed else 0.0
        self._time = default if stated is None else stated
        self._slip = np.array([*grid.wind, *([0.0] * (first.shape[1] - len(grid.wind)))]) - first

    def __call__(self, t: float, twist: Array) -> Array:
        """Return the twists of the walls at time t [s] for bodies with the twists ``twist``."""
        s = min(1.0, t / self._time) if self._time else 1.0
        if s == 1.0:
            return twist
        left = 1.0 - s * s * (3.0 - 2.0 * s)
        return twist + left * self._slip
