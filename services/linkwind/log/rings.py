"""Some of the rings of a frame of wakes, where a picture needs not all of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from linkwind.frames import Single, WakeFrame


class Rings(NamedTuple):
    """Some rows of a frame's rings, of each wing.

    Attributes:
        corner: [m], shape (wings, rows + 1, columns + 1, 3), in W.
        strength: circulation [m²/s], shape (wings, rows, columns).
        shed: step at which each edge behind the wing left it, the trailing edge first; one more than rows
            in the wake.
    """

    corner: Single
    strength: Single
    shed: list[int]


def thinned(frame: WakeFrame, most: int) -> Rings:
    """Return all rows on the wings, and of the wakes so many that there are about ``most`` rings in them.

    Edges of several frames are those that were shed at the same steps, and the last of each.
    """
    wings, rows, columns = frame.shape
    stride = max(1, -(-wings * (rows - frame.bound) * columns // most))
    behind = np.arange(rows - frame.bound + 1)  # the trailing edge
    kept = (behind == 0) | ((frame.step - behind) % stride == 0) | (behind == behind[-1])
    edges = np.concatenate([np.arange(frame.bound), frame.bound + behind[kept]])
    return Rings(
        frame.corner[:, edges],
        frame.strength[:, edges[1:] - 1],  # of the ring in front of an edge, shed with it
        (frame.step - behind[kept]).tolist(),
    )
