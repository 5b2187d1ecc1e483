"""The log of a run that goes on in its own folder, until it takes the place of the one before.

The one before is what counts, and stays as it is, until everything that it holds is in the new one and on the
disk; then the new one gets its name, in one step. So a death at any moment leaves all that there was under
that name, and there are never more than two.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from linkwind.log.contents import MOTION
from linkwind.log.reader import Log
from linkwind.log.writer import LogWriter

NAME = "log.resumed.mcap"


class Successor:
    """A new log beside an old one.

    Attributes:
        path: of the new one, until it gets the name of the old one.
    """

    def __init__(
        self, old: Log, ready: Callable[[], bool] = lambda: True, release: Callable[[], None] = lambda: None
    ) -> None:
        """Begin beside ``old``; what an earlier attempt left there goes away, ``old`` holds more.

        Args:
            old: the log before.
            ready: whether nobody needs the path of the new one any more.
            release: is called when the old one is gone, to let go of it, so that its space is free.
        """
        self.path = old.path.with_name(NAME)
        self.path.unlink(missing_ok=True)
        self._old: Log | None = old
        self._ready, self._release = ready, release
        self._last_ns = max((time_ns for _, _, time_ns, _ in old.messages(MOTION)), default=-1)

    def reached(self, log: LogWriter, time_ns: int) -> None:
        """Be told of the simulation time [ns] of a motion that was written to ``log``, the new one."""
        if self._old is not None and time_ns > self._last_ns and self._ready():
            self.replace(log)

    def replace(self, log: LogWriter) -> None:
        """Take the place of the old one, unless ``log``, the new one, could not be written to here."""
        if self._old is None:
            return
        log.flush()
        if log.cut:
            return
        _sync(self.path)
        self.path.replace(self._old.path)
        _sync(self._old.path.parent)
        log.path = self._old.path
        self._old.close()
        self._release()
        self._old = None

    def end(self) -> None:
        """Remove the new one if it never came as far as the old one."""
        self.path.unlink(missing_ok=True)


def _sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
