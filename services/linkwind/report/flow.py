"""What is drawn of a fluid: which of its frames, and on which scale."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linkwind.frames import FlowFrame, Single
from linkwind.spatial import Array

Frames = Callable[[], Iterator[FlowFrame]]
Indices = NDArray[np.intp]

EVEN = 4  # pictures, evenly spread over the run
PAPER = (0.48, 1.14)  # s, the times that Rahmati & Karimi (2021) show the flow at
NEAR = 0.08  # of the run; an even time that is nearer to one of the paper's gives way to it
SAMPLES = 2_000_000  # values that a scale is taken from

# Share of the speeds of all frames within their scale, and of the rotation, the sum of |ω|, that is where |ω|
# is within its own: the few values next to an edge would make all else pale, and how much of the window is
# still says nothing.
SPEED_SHARE, ROTATION_SHARE = 99.8, 35.0


@dataclass(frozen=True)
class Flow:
    """The frames of one provider's fluid, which are read again each time that they are looked at.

    Attributes:
        provider: its name.
        frames: returns an iterator over them.
        t: their times [s], shape (k,).
        speed: largest value of the scale of the speed [m/s].
        vorticity: largest value of the scale of the vorticity, which reaches as far below 0 [1/s].
    """

    provider: str
    frames: Frames
    t: Array
    speed: float
    vorticity: float

    def some(self, indices: Indices) -> Iterator[FlowFrame]:
        """Iterate over the frames of these indices, ascending."""
        wanted = set(indices.tolist())
        return (frame for i, frame in enumerate(self.frames()) if i in wanted)


def survey(provider: str, frames: Frames) -> Flow | None:
    """Look through all frames once, for their times and a scale that suits all; None without a frame."""
    times, count = [], 0
    for frame in frames():
        times.append(frame.time_ns / 1e9)
        count += frame.pressure.size
    if not times:
        return None
    stride = max(1, math.isqrt(count // SAMPLES))
    parts = [(speed(f)[::stride, ::stride], np.abs(f.vorticity[::stride, ::stride])) for f in frames()]
    speeds, vorticities = (
        np.concatenate([part.ravel() for part in each]) for each in zip(*parts, strict=True)
    )
    top = _rounded(_within(vorticities, ROTATION_SHARE))
    return Flow(provider, frames, np.array(times), round_top(speeds, SPEED_SHARE), top)


def speed(frame: FlowFrame) -> Single:
    """Return the magnitude of the velocity [m/s], shape (rows, columns)."""
    magnitude: Single = np.hypot(frame.velocity[:, :, 0], frame.velocity[:, :, 1])
    return magnitude


def shown(t: Array) -> Indices:
    """Return the indices of the frames that get a picture, ascending.

    Args:
        t: times of the frames [s], ascending.
    """
    first, last = float(t[0]), float(t[-1])
    near = NEAR * (last - first)
    paper = [time for time in PAPER if first < time <= last]
    even = np.linspace(first, last, EVEN + 1)[1:]
    others = [time for time in even if all(abs(time - other) > near for other in paper)]
    return np.unique([np.argmin(np.abs(t - time)) for time in [*paper, *others]])


def round_top(values: Single, share: float) -> float:
    """Return a round number that this percentage of the values is below."""
    finite = values[np.isfinite(values)]
    return _rounded(float(np.percentile(finite, share)) if finite.size else 0.0)


def _within(values: Single, share: float) -> float:
    """Return the value up to which the values add up to this percentage of their sum."""
    ascending = np.sort(values[np.isfinite(values)])
    total = np.cumsum(ascending, dtype=np.float64)
    at = int(np.searchsorted(total, 0.01 * share * total[-1])) if total.size else 0
    return float(ascending[at]) if total.size else 0.0


def _rounded(top: float) -> float:
    if top <= 0.0:
        return 1.0
    unit = 10.0 ** (math.floor(math.log10(top)) - 1)
    digits = top / unit  # 10 to 100
    step = next(step for limit, step in ((20, 1), (50, 2), (100, 5)) if digits <= limit)
    return math.ceil(digits / step - 1e-9) * step * unit
