"""How a replay goes on: paused, stepped, faster, from another place; and at which moment what is due.

The protocol is ``Playback`` of ``schemas/linkwind/v1/observe.proto``.
"""

from __future__ import annotations

import math
import threading
import time
from collections import Counter
from typing import Any

from google.protobuf.message import DecodeError

from linkwind.schema import MESSAGES

Playback = MESSAGES["Playback"]

TICK = 0.02  # s between two looks at the steering while nothing is due
RESOLUTION = 1e-5  # s in which lateness is counted, so that memory does not grow with the replay


class Steering:
    """What was asked of a replay, by keys or over the bus; may be used from any thread."""

    def __init__(self, rate: float = 1.0, *, loop: bool = False, paused: bool = False) -> None:
        """Begin like this; ``rate`` is simulation time over wall-clock time, 0 for as fast as possible."""
        self._lock = threading.RLock()
        self._rate, self.loop, self._paused = rate, loop, paused
        self._points = 0
        self._sought: int | None = None
        self._at = -1
        self.begin_ns = self.end_ns = 0

    @property
    def rate(self) -> float:
        """Simulation time over wall-clock time; 0 for as fast as possible."""
        return self._rate

    def toggle(self) -> None:
        """Pause, or go on."""
        with self._lock:
            self._paused, self._points = not self._paused, 0

    def step(self, points: int = 1) -> None:
        """Pause, after so many more communication points."""
        with self._lock:
            self._points = self._points + points if self._paused else points
            self._paused = True

    def scale(self, factor: float) -> None:
        """Go so many times as fast; without effect on what is as fast as possible."""
        with self._lock:
            self._rate *= factor

    def seek(self, time_ns: int) -> None:
        """Go on from the first point at or behind a simulation time; while paused, only that one passes."""
        with self._lock:
            self._sought = min(max(time_ns, self.begin_ns), self.end_ns)
            if self._paused:
                self._points = 1

    def seek_by(self, seconds: float) -> None:
        """Seek from where the replay is now."""
        with self._lock:
            self.seek(max(self._at, 0) + round(seconds * 1e9))

    def taken(self) -> int | None:
        """Take the simulation time that was sought since the last call [ns]; None if none was."""
        with self._lock:
            sought, self._sought = self._sought, None
            return sought

    @property
    def sought(self) -> bool:
        """Whether another place was asked for."""
        return self._sought is not None

    def holds(self, time_ns: int) -> bool:
        """Tell whether a point has to wait; asked again until it has not, and then it passes.

        Where another place was asked for, nothing passes before that.
        """
        with self._lock:
            if self._sought is not None:
                return True
            if self._paused:
                if not self._points:
                    return True
                self._points -= 1
            self._at = time_ns
            return False

    def answer(self, request: bytes) -> bytes:
        """Do what a message Playback asks for; return the state as another one."""
        try:
            wish = Playback.FromString(request)
        except DecodeError:
            wish = Playback()  # of no known language: it gets the state
        with self._lock:
            self._do(wish)
            state = Playback(
                paused=self._paused, rate=self._rate, time_ns=max(self._at, 0), points=self._points,
                loop=self.loop, begin_ns=self.begin_ns, end_ns=self.end_ns,
            )  # fmt: skip
        return bytes(state.SerializeToString())

    def _do(self, wish: Any) -> None:
        if wish.HasField("rate") and math.isfinite(wish.rate) and wish.rate >= 0.0:
            self._rate = wish.rate
        if wish.HasField("loop"):
            self.loop = wish.loop
        if wish.HasField("paused"):
            self._paused, self._points = wish.paused, 0
        if wish.HasField("points"):
            self.step(wish.points)
        if wish.HasField("time_ns"):
            self.seek(wish.time_ns)


class Pace:
    """Lets simulation time pass at the rate of wall-clock time, and keeps how late it was."""

    def __init__(self, steering: Steering) -> None:
        """Begin with the first point that is waited for."""
        self._steering = steering
        self._late: Counter[int] = Counter()
        self._origin_ns: int | None = None
        self._origin = 0.0
        self._rate = steering.rate

    def begin(self, time_ns: int | None) -> None:
        """Let time pass from now on, from simulation time ``time_ns`` [ns], else from the next point."""
        self._origin_ns = time_ns
        self._origin = time.perf_counter()

    def wait(self, time_ns: int) -> bool:
        """Wait until a point is due; False if the replay is to go on elsewhere before that."""
        if not self._held(time_ns):
            return False
        now = time.perf_counter()
        while (due := self._due(time_ns, now)) > now:
            if self._steering.sought:
                return False
            time.sleep(min(due - now, TICK))
            now = time.perf_counter()
        if self._rate:
            self._late[round((now - due) / RESOLUTION)] += 1
        return True

    def _due(self, time_ns: int, now: float) -> float:
        """Return the wall clock at which a point is due, at the rate that counts now."""
        rate = self._steering.rate
        if self._origin_ns is None:
            self._origin_ns, self._origin, self._rate = time_ns, now, rate
        if rate != self._rate:  # what has passed has passed at the old rate
            passed = (now - self._origin) * self._rate * 1e9
            self._origin_ns, self._origin, self._rate = self._origin_ns + round(passed), now, rate
        return self._origin + (time_ns - self._origin_ns) / (1e9 * rate) if rate else now

    def _held(self, time_ns: int) -> bool:
        """Wait while paused, without time passing for the replay; False if it is to go on elsewhere."""
        began = time.perf_counter()
        while self._steering.holds(time_ns):
            if self._steering.sought:
                return False
            time.sleep(TICK)
        self._origin += time.perf_counter() - began
        return True

    @property
    def late_ms(self) -> tuple[float, float] | None:
        """Median and 99th percentile of the lateness [ms]; None where nothing was due."""
        if not self._late:
            return None
        return self._quantile(0.5), self._quantile(0.99)

    def _quantile(self, share: float) -> float:
        rest = share * self._late.total()
        for late in sorted(self._late):
            rest -= self._late[late]
            if rest <= 0:
                break
        return late * RESOLUTION * 1e3
