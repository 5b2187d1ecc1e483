"""Vortices in the picture: their frames one by one, as the page follows them."""

from __future__ import annotations

from typing import Any

import numpy as np

from linkwind.frames import VolumeFrame
from linkwind.log.contents import VOLUME
from linkwind.log.vortices import vortices
from linkwind.report.volume import Volume, survey_volume
from linkwind.report.volumefilm import about, coded
from linkwind.view.film import SCALED_BY
from linkwind.view.recording import Recording

TRIANGLES = 6000  # of a frame


class VolumeFilm:
    """The frames of one provider's fluid in a box."""

    def __init__(self, recording: Recording, provider: str) -> None:
        """Take the frames of ``provider``."""
        self._recording = recording
        self._provider = provider
        self._counted = 0
        self._volume: Volume | None = None
        self._shared: dict[str, Any] = {}

    def reel(self) -> dict[str, Any] | None:
        """Return the times of the frames [s] and what they share; None without any."""
        with self._recording.lock:
            times = self._recording.log.times(VOLUME + self._provider)
            self._rescale(times)
        return None if self._volume is None else self._shared | {"t": (times / 1e9).tolist()}

    def _rescale(self, times: Any) -> None:
        """Find a scale and a room that suit the frames; again when there are twice as many."""
        if len(times) < max(1, 2 * self._counted):
            return
        self._counted = len(times)
        chosen = times[np.unique(np.linspace(0, len(times) - 1, SCALED_BY).astype(int))].tolist()
        frames = [frame for frame in map(self._frame, chosen) if frame is not None]
        self._volume = survey_volume(self._provider, lambda: iter(frames))
        if self._volume is not None:
            scale = self._volume.scale
            self._shared = about(scale, [vortices(frame, scale, TRIANGLES) for frame in frames])

    def _frame(self, time_ns: int) -> VolumeFrame | None:
        return self._recording.log.volume_frame(self._provider, time_ns, self._recording.step_ns)

    def frame(self, index: int) -> dict[str, Any] | None:
        """Return a frame for the page; None without it."""
        with self._recording.lock:
            times = self._recording.log.times(VOLUME + self._provider)
            frame = self._frame(int(times[index])) if 0 <= index < len(times) else None
        if frame is None or self._volume is None:
            return None
        scale = self._volume.scale
        return coded(frame, vortices(frame, scale, TRIANGLES), scale)
