"""The file under the MCAP writer, which does not lose an error.

Where a write fails, for want of space say, foxglove-sdk prints a line for this and for every later
message and goes on as if nothing had happened. This file keeps the error for its owner instead.
"""

from __future__ import annotations

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from linkwind.errors import LogError
from linkwind.interrupt import uninterrupted


class Sink:
    """A new file that is only appended to, and that others find locked until it is closed.

    Attributes:
        failure: why a write failed, None as long as none did. From then on nothing is written.

    Raises:
        OSError: the file exists already or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644)
        with suppress(OSError):  # not every file system has locks
            fcntl.flock(self._descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._position = 0
        self.failure: OSError | None = None

    @uninterrupted
    def write(self, data: Any, /) -> int:
        """Write all of ``data``; on failure, keep the reason."""
        rest = memoryview(data)
        self._position += len(rest)
        try:
            while rest and self.failure is None:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError as error:
            self.failure = error
        return len(data)

    @uninterrupted
    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        """Return the position; the MCAP writer never moves it."""
        return self._position

    @uninterrupted
    def flush(self) -> None:
        """Nothing to do: every write went to the operating system."""

    def close(self) -> None:
        """Close the file."""
        os.close(self._descriptor)


@contextmanager
def alone(path: Path) -> Iterator[None]:
    """Have a log for oneself: nobody writes it, and nobody else is here with it.

    Raises:
        LogError: somebody has it, or it is not there.
    """
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError as error:
        raise LogError(f"{path}: expected a log; got {error.strerror}. Check the path.") from error
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise LogError(
                f"{path}: expected the log of a run that is not going on; got one that is being written. "
                "Wait for its end, or stop it."
            ) from None
        except OSError:  # not every file system has locks
            pass
        yield
    finally:
        os.close(descriptor)
