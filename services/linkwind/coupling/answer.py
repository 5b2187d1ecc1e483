"""What a coupling scheme gets from the fluid; frames and units are those of `base`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Answer(NamedTuple):
    """What the fluid does to the bodies at one communication point, all providers together.

    Attributes:
        wrench: shape (n, 6), without the part that is proportional to acceleration. Copied by the scheme.
        added_inertia: ``A``, shape (n, 6, 6), for a further wrench −A·a; None for none. Copied as well.
        response: ``G``, shape (6n, 6n): the wrench is less by G (twist − trial twist) for another twist at
            the end of the step; None where that is not known. Copied as well.
    """

    wrench: Array
    added_inertia: Array | None = None
    response: Array | None = None
