"""Ctrl-C, and SIGTERM as a service manager and Docker send it, end a block as a KeyboardInterrupt.

It may be raised between any two instructions of Python, so a function that a library calls back must not be
where it is raised: the library would take it for a failure of the function, and nobody would ever stop.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import CodeType, FrameType
from typing import Any, TypeVar

SOON = 1e-3  # s after which a signal is given again
F = TypeVar("F", bound=Callable[..., Any])
_uninterrupted: set[CodeType] = set()


def uninterrupted(function: F) -> F:
    """Let a function, and all that it calls, be over before the process is told to stop."""
    _uninterrupted.add(function.__code__)
    return function


def _must_wait(frame: FrameType | None) -> bool:
    """Tell whether a frame is of such a function, or was called by one."""
    while frame is not None and frame.f_code not in _uninterrupted:
        frame = frame.f_back
    return frame is not None


class TooLateError(Exception):
    """A block was not done in its time."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """Let a block take so long [s] and no longer.

    Raises:
        TooLateError: it was not done.
    """

    def late(number: int, frame: FrameType | None) -> None:
        raise TooLateError

    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def stops_as_interrupt() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM end the block, so that the log is closed and nobody is left waiting.

    A signal that is ignored, as the shell has it for programs in the background, stays so; in a thread beside
    the main one, where none arrives, nothing is to be done.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        if _must_wait(frame):
            threading.Timer(SOON, os.kill, (os.getpid(), number)).start()
        else:
            raise KeyboardInterrupt

    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:
            signal.signal(number, interrupt)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
