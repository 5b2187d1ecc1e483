"""How long exchanges took on the wall clock, in constant memory."""

from __future__ import annotations

import math

import numpy as np

RESOLUTION = 0.005  # relative width of a bin
LONGEST_NS = 3.6e12  # an hour; longer exchanges count as that


class ExchangeTimes:
    """A histogram of exchange times with bins of equal relative width."""

    def __init__(self) -> None:
        self.count = 0
        self._scale = 1.0 / math.log1p(RESOLUTION)
        self._bins = np.zeros(1 + int(math.log(LONGEST_NS) * self._scale), dtype=np.int64)

    def add(self, ns: int) -> None:
        """Count one exchange of ``ns`` nanoseconds."""
        self.count += 1
        self._bins[int(math.log(min(max(ns, 1), LONGEST_NS)) * self._scale)] += 1

    def quantile_us(self, q: float) -> float:
        """Return the time [µs] that a share ``q`` of the exchanges stayed below, to 0.5 %; 0 without any."""
        if self.count == 0:
            return 0.0
        place = int(np.searchsorted(np.cumsum(self._bins), q * self.count))
        return math.exp((place + 0.5) / self._scale) / 1e3
