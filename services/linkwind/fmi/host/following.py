"""A worker on the processor of its host, because the two never work at the same time.

A message to a process on a processor that sleeps costs tens of microseconds until that one is awake, many
times the message itself; the processor that the host leaves to wait for the answer is awake. So a worker
whose answers come fast is kept where its host is, and the host, while it waits, stays there. A worker that
takes its time, or has threads that may work side by side, is left to the system.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

SHORT = 300e-6  # s; with an answer that takes longer, the way there no longer matters
LONG = 2e-3  # s; from here on other processors are worth more than the one that is awake
TRIALS = 20  # short answers in a row, by which an FMU has started the threads that it wants

_where = ctypes.PyDLL(None).sched_getcpu
_Answer = TypeVar("_Answer")


class Follower:
    """Where a worker runs."""

    def __init__(self, pid: int) -> None:
        """Take a worker that may still run anywhere."""
        self._pid = pid
        self._anywhere = os.sched_getaffinity(0)
        self._left = TRIALS  # short answers to go
        self._follows = False
        self._at = -1

    def ask(self, request: Callable[[], _Answer]) -> _Answer:
        """Send a request and wait for the answer, with the worker near."""
        start = time.perf_counter()
        answer = self._ask_here(request) if self._follows else request()
        self._took(time.perf_counter() - start)
        return answer

    def _ask_here(self, request: Callable[[], _Answer]) -> _Answer:
        here = _where()
        if here != self._at:
            self._put(self._pid, {here})
            self._at = here
        self._put(0, {here})  # else the system wakes this thread up on the other processor, which sleeps
        try:
            return request()
        finally:
            self._put(0, self._anywhere)

    def _put(self, thread: int, where: set[int]) -> None:
        with contextlib.suppress(OSError):  # it has ended, which the next request will tell
            os.sched_setaffinity(thread, where)

    def _took(self, duration: float) -> None:
        """Learn how long an answer took [s]."""
        if self._follows:
            if duration > LONG:
                self._leave()
        elif len(self._anywhere) > 1:
            self._left = self._left - 1 if duration < SHORT else TRIALS
            if not self._left:
                self._left = TRIALS
                self._follows = len(self._threads()) == 1

    def _leave(self) -> None:
        """Free all threads, those too that have been started in the meantime."""
        self._follows, self._at = False, -1
        for thread in self._threads():
            self._put(thread, self._anywhere)

    def _threads(self) -> list[int]:
        try:
            return [int(thread.name) for thread in Path(f"/proc/{self._pid}/task").iterdir()]
        except OSError:
            return []
