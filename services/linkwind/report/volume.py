"""What is drawn of a fluid in a box: which frames, from which level on, on which scale."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from linkwind.frames import Single, VolumeFrame
from linkwind.log.vortices import Scale, scale
from linkwind.report.flow import SPEED_SHARE, Indices, round_top
from linkwind.spatial import Array

VolumeFrames = Callable[[], Iterator[VolumeFrame]]

EVERY = 3  # cell, along each axis, that the scale of the speed is taken from


@dataclass(frozen=True)
class Volume:
    """The frames of one provider's fluid in a box, which are read again each time that they are looked at.

    Attributes:
        provider: its name.
        frames: returns an iterator over them.
        t: their times [s], shape (k,).
        scale: of the vortices.
        speed: largest value of the scale of the speed [m/s].
    """

    provider: str
    frames: VolumeFrames
    t: Array
    scale: Scale
    speed: float

    def some(self, indices: Indices) -> Iterator[VolumeFrame]:
        """Iterate over the frames of these indices, ascending."""
        wanted = set(indices.tolist())
        return (frame for i, frame in enumerate(self.frames()) if i in wanted)


def survey_volume(provider: str, frames: VolumeFrames) -> Volume | None:
    """Look through all frames once, for their times and scales that suit all; None without a frame."""
    times: list[float] = []
    speeds: list[Single] = []

    def noted() -> Iterator[VolumeFrame]:
        for frame in frames():
            times.append(frame.time_ns / 1e9)
            speeds.append(speed(frame.velocity[::EVERY, ::EVERY, ::EVERY]).ravel())
            yield frame

    found = scale(noted())
    if not times:
        return None
    return Volume(provider, frames, np.array(times), found, round_top(np.concatenate(speeds), SPEED_SHARE))


def speed(velocity: Single) -> Single:
    """Return the magnitude of velocities, shape (…, 3)."""
    with np.errstate(over="ignore", invalid="ignore"):
        magnitude: Single = np.sqrt(np.square(velocity).sum(axis=-1))
    return magnitude
