"""The provider processes that a run starts, watches and always ends."""

from __future__ import annotations

import contextlib
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from linkwind.errors import LostError

PATIENCE = 5.0  # s for a process to end by itself


class Children:
    """Provider processes, each with a file for what it prints."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._processes: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, arguments: Sequence[str]) -> None:
        """Start ``linkwind ARGUMENTS`` as the participant ``name``."""
        with self.output(name).open("wb") as output:
            self._processes[name] = subprocess.Popen(
                [sys.executable, "-m", "linkwind", *arguments],
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
            )

    def output(self, name: str) -> Path:
        """Return the file with what ``name`` printed."""
        return self._folder / f"{name}.log"

    def check(self) -> None:
        """Raise LostError if a process has ended with an error."""
        for name, process in self._processes.items():
            status = process.poll()
            if status:
                lines = self.output(name).read_text(errors="replace").strip().splitlines()
                raise LostError(
                    f'"{name}" ended with status {status}: {lines[-1] if lines else "it printed nothing"} '
                    f"(see {self.output(name)})"
                )

    def end(self, patience: float) -> None:
        """Wait for every process, then end those that are left."""
        for process in self._processes.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(patience)
        for process in self._processes.values():
            if process.poll() is None:
                process.kill()
                process.wait()


@contextlib.contextmanager
def children(folder: Path) -> Iterator[Children]:
    """Provide processes that are gone when the block is left, however it is left."""
    started = Children(folder)
    try:
        yield started
    except BaseException:
        started.end(patience=0.5)
        raise
    started.end(PATIENCE)
