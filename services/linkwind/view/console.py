"""What viewers do to a run that goes on: pause, step, speed. The run is another process, told by lines."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Callable
from typing import Any

FASTEST = 1e9  # rate
PATIENCE = 5.0  # s without any viewer after which a run is held no longer: a page that is loaded again


class Console:
    """The state of a steered run as its viewers set it; may be used from several threads.

    Each change is told at once, as an object with what changed: ``viewers``, how many there are, or a field
    of the message Playback (``schemas/linkwind/v1/observe.proto``): ``paused``, ``points``, ``rate``.
    """

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        """Begin with a run that goes as fast as it can and that nobody looks at."""
        self._tell = tell
        self._lock = threading.Lock()
        self._viewers = 0
        self._timer: threading.Timer | None = None
        self.paused = False
        self.rate = 0.0

    def steer(self, command: Any) -> None:
        """Do what a viewer wants.

        Raises:
            ValueError: it is no command.
        """
        match command:
            case {"paused": bool(paused)}:
                wish: dict[str, Any] = {"paused": paused}
            case {"points": int(points)} if points > 0 and not isinstance(points, bool):
                wish = {"points": points}
            case {"rate": float(rate) | int(rate)} if 0.0 <= rate < FASTEST and not isinstance(rate, bool):
                wish = {"rate": float(rate)}
            case _:
                raise ValueError('expected {"paused": true or false}, {"points": number} or {"rate": number}')
        with self._lock:
            self.paused = wish.get("paused", self.paused or "points" in wish)
            self.rate = wish.get("rate", self.rate)
            self._tell(wish)

    def come(self) -> None:
        """A viewer is there."""
        with self._lock:
            self._viewers += 1
            if self._timer is not None:
                self._timer.cancel()
                self._timer = None
            self._tell({"viewers": self._viewers})

    def leave(self) -> None:
        """A viewer is gone; with the last one goes, after a while, what holds the run."""
        with self._lock:
            self._viewers -= 1
            self._tell({"viewers": self._viewers})
            if not self._viewers:
                self._timer = threading.Timer(PATIENCE, self._release)
                self._timer.daemon = True
                self._timer.start()

    def _release(self) -> None:
        with self._lock:
            if not self._viewers:
                self.paused, self.rate = False, 0.0
                self._tell({"paused": False})
                self._tell({"rate": 0.0})


def tell_parent(command: dict[str, Any]) -> None:
    """Write a command as a line, which the run that started this process reads."""
    sys.stdout.write(json.dumps(command) + "\n")
    sys.stdout.flush()
