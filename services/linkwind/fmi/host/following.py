"""A worker on the processor of its host, because the two never work at the same time.

A message to a process on a processor that sleeps costs tens of microseconds until that one is awake, many
times the message itself; the processor that the host leaves to wait for the answer is awake. So a worker
whose answers come fast is kept where its host is. One that takes its time, or has threads that may work side
by side, is left to the system.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
from pathlib import Path

SHORT = 200e-6  # s; with an answer that takes longer, the way there no longer matters
LONG = 2e-3  # s; from here on other processors are worth more than the one that is awake
TRIALS = 20

_where = ctypes.PyDLL(None).sched_getcpu


class Follower:
    """Where a worker runs."""

    def __init__(self, pid: int) -> None:
        """Take a worker that may still run anywhere."""
        self._pid = pid
        self._anywhere = os.sched_getaffinity(0)
        self._left = TRIALS if len(self._anywhere) > 1 else -1  # short answers to go; -1: never follows
        self._at: int | None = None

    def come(self) -> None:
        """Bring a worker that waits for a request to the processor of the caller."""
        if self._at is not None and (here := _where()) != self._at:
            self._at = here
            self._put({here})

    def took(self, duration: float) -> None:
        """Learn how long an answer took [s]."""
        if self._at is None:
            if self._left > 0:
                self._left = self._left - 1 if duration < SHORT else TRIALS
                if not self._left:
                    self._begin()
        elif duration > LONG:
            self._leave()

    def _begin(self) -> None:
        with contextlib.suppress(OSError):  # it has ended, which the next request will tell
            if len(self._threads()) == 1:
                self._at = _where()
                self._put({self._at})

    def _put(self, where: set[int]) -> None:
        with contextlib.suppress(OSError):
            os.sched_setaffinity(self._pid, where)

    def _leave(self) -> None:
        """Free all threads, those too that have been started in the meantime."""
        self._at, self._left = None, TRIALS
        with contextlib.suppress(OSError):
            for thread in self._threads():
                os.sched_setaffinity(thread, self._anywhere)

    def _threads(self) -> list[int]:
        return [int(thread.name) for thread in Path(f"/proc/{self._pid}/task").iterdir()]
