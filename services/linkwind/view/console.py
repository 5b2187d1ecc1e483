"""What viewers do to a run that goes on: pause, step, speed. The run is another process, told by lines."""

from __future__ import annotations

import json
import sys
import threading
from collections.abc import Callable
from typing import Any

PATIENCE = 5.0  # s without any viewer after which a run is held no longer: a page that is loaded again


class Console:
    """The state of a steered run as its viewers set it; may be used from several threads.

    Each change is told at once, as an object with what changed: ``pause`` (true or false), ``step`` (steps to
    let pass), ``rate`` (simulation time over wall-clock time, 0 for as fast as possible), ``viewers``.
    """

    def __init__(self, tell: Callable[[dict[str, Any]], None]) -> None:
        """Begin with a run that goes as fast as it can and that nobody looks at."""
        self._tell = tell
        self._lock = threading.Lock()
        self._viewers = 0
        self._timer: threading.Timer | None = None
        self.paused = False
        self.rate = 0.0

    def steer(self, command: dict[str, Any]) -> None:
        """Do what a viewer wants.

        Raises:
            ValueError: it is no command.
        """
        match command:
            case {"pause": bool(paused)}:
                self.paused = paused
            case {"step": int(count)} if not isinstance(count, bool) and count > 0:
                self.paused = True
            case {"rate": float(rate) | int(rate)} if not isinstance(rate, bool) and 0.0 <= rate < 1e9:
                self.rate = float(rate)
            case _:
                raise ValueError('expected {"pause": true|false}, {"step": count} or {"rate": rate}')
        with self._lock:
            self._tell(command)

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
                self._tell({"pause": False})
                self._tell({"rate": 0.0})


def tell_parent(command: dict[str, Any]) -> None:
    """Write a command as a line, which the run that started this process reads."""
    sys.stdout.write(json.dumps(command) + "\n")
    sys.stdout.flush()
