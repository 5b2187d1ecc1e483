"""A smooth start: the wind comes up slowly, instead of hitting bodies at rest all at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linkwind.spatial import Array


class SmoothStart:
    """The twists that the fluid is given: at first those of the stream, then more and more the bodies'.

    Args:
        time: to start in [s].
        stream: velocity of the fluid far away [m/s], in the frame of the lattice.
        first: twists of the bodies at the start, shape (n, 3) in the plane, (n, 6) in space, in this frame.
    """

    def __init__(self, time: float, stream: Sequence[float], first: Array) -> None:
        self._time = time
        self._slip = np.array([*stream, *([0.0] * (first.shape[1] - len(stream)))]) - first

    def __call__(self, t: float, twist: Array) -> Array:
        """Return the twists of the walls at time t [s] for bodies with the twists ``twist``."""
        s = min(1.0, t / self._time) if self._time else 1.0
        if s == 1.0:
            return twist
        left = 1.0 - s * s * (3.0 - 2.0 * s)
        return twist + left * self._slip
