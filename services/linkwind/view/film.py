"""The fluid behind the mechanism: its frames one by one, as small grey pictures that the browser colours."""

from __future__ import annotations

from typing import Any

import numpy as np

from linkwind.frames import FlowFrame
from linkwind.log.contents import FLOW
from linkwind.report.closeup import closeups
from linkwind.report.film import Quantity, described, picture, quantities
from linkwind.report.flow import survey
from linkwind.view.recording import Recording

SCALED_BY = 8  # frames that the scale is taken from, evenly spread, of what is around the mechanism
QUALITY = 92
CELLS = 800  # along the longer side of a picture


class Film:
    """The frames of one provider's fluid."""

    def __init__(self, recording: Recording, provider: str) -> None:
        """Take the frames of ``provider``."""
        self._recording = recording
        self._provider = provider
        self._counted = 0
        self._quantities: dict[str, Quantity] = {}

    def reel(self) -> dict[str, Any]:
        """Return the times of the frames [s], and what can be seen of them: unit, scale, colours."""
        with self._recording.lock:
            times = self._recording.log.times(FLOW + self._provider)
            self._rescale(times)
        return {
            "provider": self._provider,
            "t": (times / 1e9).tolist(),
            "quantities": {name: described(quantity) for name, quantity in self._quantities.items()},
        }

    def _rescale(self, times: Any) -> None:
        """Find a scale that suits the frames; again when there are twice as many."""
        if len(times) < max(1, 2 * self._counted):
            return
        self._counted = len(times)
        chosen = times[np.unique(np.linspace(0, len(times) - 1, SCALED_BY).astype(int))].tolist()
        frames = [frame for frame in map(self._frame, chosen) if frame is not None]
        near = closeups(self._recording.points(chosen), frames)
        found = survey(self._provider, lambda: iter(near))
        if found is not None:
            self._quantities = quantities(found)

    def _frame(self, time_ns: int) -> FlowFrame | None:
        return self._recording.log.frame(self._provider, time_ns, self._recording.step_ns)

    def picture(self, index: int, name: str) -> tuple[bytes, tuple[float, float, float, float]] | None:
        """Return a frame as a grey WebP, and its edges (left, right, bottom, top) [m]; None without it."""
        with self._recording.lock:
            times = self._recording.log.times(FLOW + self._provider)
            frame = self._frame(int(times[index])) if 0 <= index < len(times) else None
        if frame is None or name not in self._quantities:
            return None
        return picture(self._quantities[name], frame, QUALITY, cells=CELLS), frame.extent
