"""A smooth start: the wind comes up slowly, instead of hitting bodies at rest all at once."""

from __future__ import annotations

import math

import numpy as np

from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Array


class SmoothStart:
    """The twists that the fluid is given: at first those of the stream, then more and more the bodies'.

    Args:
        scenario, provider: with the wind and the time to start in.
        length: of the longest body [m]; to go along it is the wind's time by default.
        first: twists of the bodies at the start, shape (n, 3) in the plane, (n, 6) in space, in W.
    """

    def __init__(self, scenario: Scenario, provider: Provider, length: float, first: Array) -> None:
        wind = scenario.environment.uniform_wind[: provider.flow.dimensions]
        speed = math.hypot(*wind)
        default = length / speed if speed else 0.0
        stated = provider.flow.start_time
        self._time = default if stated is None else stated
        self._slip = np.array([*wind, *([0.0] * (first.shape[1] - len(wind)))]) - first

    def __call__(self, t: float, twist: Array) -> Array:
        """Return the twists of the walls at time t [s] for bodies with the twists ``twist``."""
        s = min(1.0, t / self._time) if self._time else 1.0
        if s == 1.0:
            return twist
        left = 1.0 - s * s * (3.0 - 2.0 * s)
        return twist + left * self._slip
