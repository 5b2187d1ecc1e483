"""The provider processes that a run starts, watches, starts again if they may come back, and always ends."""

from __future__ import annotations

import contextlib
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from linkwind.errors import LostError
from linkwind.protocol import DynamicsSession

PATIENCE = 5.0  # s for all processes to end by themselves
STARTS = 3  # without an answer in between


class Child:
    """A provider process, and how often it was started."""

    def __init__(self, arguments: Sequence[str], output: Path) -> None:
        """Start ``linkwind ARGUMENTS``, which prints to ``output``."""
        self._arguments, self.output = arguments, output
        self.losses = 0  # of this provider when the process was started
        self._starts, self._answer = 0, b""
        self.process = self._start()

    def _start(self) -> subprocess.Popen[bytes]:
        self._starts += 1
        with self.output.open("ab" if self._starts > 1 else "wb") as output:
            return subprocess.Popen(
                [sys.executable, "-m", "linkwind", *self._arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def again(self, losses: int, answer: bytes) -> bool:
        """End the process and start another one; False if that was of no use.

        Args:
            losses: of the provider so far.
            answer: its last one.
        """
        if answer != self._answer:
            self._starts, self._answer = 1, answer
        if self._starts >= STARTS:
            return False
        self.end()
        self.losses = losses
        self.process = self._start()
        return True

    def end(self) -> None:
        """End the process, a stopped one as well."""
        self.process.kill()
        self.process.wait()


class Children:
    """Provider processes, each with a file for what it prints."""

    def __init__(self, folder: Path, session: DynamicsSession) -> None:
        self._folder, self._session = folder, session
        self._children: dict[str, Child] = {}

    def start(self, name: str, arguments: Sequence[str]) -> None:
        """Start ``linkwind ARGUMENTS`` as the participant ``name``."""
        self._session.participants[name].replaceable = True
        self._children[name] = Child(arguments, self._folder / f"{name}.log")

    def check(self) -> None:
        """Start again what was lost and may come back (bus.recovery).

        Raises:
            LostError: a process has ended with an error, and may not be started again.
        """
        for name, child in self._children.items():
            status, known = child.process.poll(), self._session.participants[name]
            if self._session.course.recovery:
                # Of one that was on the bus, and has ended, the loss is about to be told.
                ended = known.losses > child.losses or (status and not known.here and not known.bye)
                if not ended or child.again(known.losses, known.payload):
                    continue
            elif not status:
                continue
            lines = child.output.read_text(errors="replace").strip().splitlines()
            raise LostError(
                f'"{name}" ended with status {status}: {lines[-1] if lines else "it printed nothing"} '
                f"(see {child.output})"
            )

    def end(self, patience: float) -> None:
        """Wait ``patience`` [s] for all processes, then end those that are left."""
        end = time.monotonic() + patience
        for child in self._children.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.process.wait(max(0.0, end - time.monotonic()))
        for child in self._children.values():
            child.end()


@contextlib.contextmanager
def children(folder: Path, session: DynamicsSession) -> Iterator[Children]:
    """Provide processes that are gone when the block is left, however it is left."""
    started = Children(folder, session)
    try:
        yield started
    except BaseException:
        started.end(patience=0.5)
        raise
    started.end(PATIENCE)
