"""What is drawn of wings and their wakes: which frames, and on which scale."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from linkwind.frames import WakeFrame
from linkwind.report.flow import Indices, round_top
from linkwind.spatial import Array

WakeFrames = Callable[[], Iterator[WakeFrame]]

TIMES = 5  # that a picture shows, evenly spread over the run
SHARE = 99.5  # percentage of the rings that are within the scale
COLOURS = "coolwarm"  # grey around 0: a ring is seen on any ground


@dataclass(frozen=True)
class Wake:
    """The frames of one provider's wings and wakes, which are read again each time that they are looked at.

    Attributes:
        provider: its name.
        frames: returns an iterator over them.
        t: their times [s], shape (k,).
        circulation: largest value of the scale, which reaches as far below 0 [m²/s].
    """

    provider: str
    frames: WakeFrames
    t: Array
    circulation: float

    def some(self, indices: Indices) -> Iterator[WakeFrame]:
        """Iterate over the frames of these indices, ascending."""
        wanted = set(indices.tolist())
        return (frame for i, frame in enumerate(self.frames()) if i in wanted)


def survey_wake(provider: str, frames: WakeFrames) -> Wake | None:
    """Look through all frames once, for their times and a scale that suits all; None without a frame."""
    times, strengths = [], []
    for frame in frames():
        times.append(frame.time_ns / 1e9)
        strengths.append(np.abs(frame.strength[:, frame.bound :]).ravel())
    if not times:
        return None
    return Wake(provider, frames, np.array(times), round_top(np.concatenate(strengths), SHARE))


def shown_times(t: Array) -> Indices:
    """Return the indices of the frames that get a picture, ascending.

    Args:
        t: times of the frames [s], ascending.
    """
    first, last = float(t[0]), float(t[-1])
    return np.unique([np.argmin(np.abs(t - time)) for time in np.linspace(first, last, TIMES + 1)[1:]])
