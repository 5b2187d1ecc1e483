"""Wings and wakes in the picture: their frames one by one, as the page follows them."""

from __future__ import annotations

from typing import Any

import numpy as np

from linkwind.frames import WakeFrame
from linkwind.log.contents import WAKE
from linkwind.report.wake import Wake, survey_wake
from linkwind.report.wakefilm import about, coded
from linkwind.view.film import SCALED_BY
from linkwind.view.recording import Recording


class WakeFilm:
    """The frames of one provider's wings and wakes."""

    def __init__(self, recording: Recording, provider: str) -> None:
        """Take the frames of ``provider``."""
        self._recording = recording
        self._provider = provider
        self._counted = 0
        self._wake: Wake | None = None

    def reel(self) -> dict[str, Any] | None:
        """Return the times of the frames [s] and what they share; None without any."""
        with self._recording.lock:
            times = self._recording.log.times(WAKE + self._provider)
            self._rescale(times)
        if self._wake is None:
            return None
        return about(self._recording.scenario, self._wake) | {"t": (times / 1e9).tolist()}

    def _rescale(self, times: Any) -> None:
        """Find a scale that suits the frames; again when there are twice as many."""
        if len(times) < max(1, 2 * self._counted):
            return
        self._counted = len(times)
        chosen = times[np.unique(np.linspace(0, len(times) - 1, SCALED_BY).astype(int))].tolist()
        frames = [frame for frame in map(self._frame, chosen) if frame is not None]
        self._wake = survey_wake(self._provider, lambda: iter(frames))

    def _frame(self, time_ns: int) -> WakeFrame | None:
        return self._recording.log.wake_frame(self._provider, time_ns, self._recording.step_ns)

    def frame(self, index: int) -> dict[str, Any] | None:
        """Return a frame for the page; None without it."""
        with self._recording.lock:
            times = self._recording.log.times(WAKE + self._provider)
            frame = self._frame(int(times[index])) if 0 <= index < len(times) else None
        return None if frame is None or self._wake is None else coded(frame, self._wake.circulation)
