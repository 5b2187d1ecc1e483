"""Processes of a test, ended by their id whatever happens."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path

from linkwind.bus.zenoh import loopback_endpoint

PATIENCE = 60.0  # s for a machine under load; what is asserted about time is much shorter and measured apart
MARK = "FAULTS_MARK"  # environment variable that the processes which a program starts inherit


class Programs:
    """Programs of one run, in a folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.endpoint = loopback_endpoint()
        self._marks: dict[int, str] = {}
        self._started: list[subprocess.Popen[str]] = []
        self._forgotten: list[subprocess.Popen[str]] = []

    def start(self, *arguments: str, said: Path | None = None) -> subprocess.Popen[str]:
        """Start ``linkwind ARGUMENTS``, in a group of its own; what it says goes to a file, or into pipes."""
        mark = uuid.uuid4().hex
        output = said.open("w") if said else None
        process = subprocess.Popen(
            [sys.executable, "-m", "linkwind", *arguments],
            stdin=subprocess.DEVNULL,
            stdout=output or subprocess.PIPE,
            stderr=subprocess.STDOUT if output else subprocess.PIPE,
            env=os.environ | {MARK: mark, "PYTHONUNBUFFERED": "1"},
            text=True,
            cwd=self.folder,
            process_group=0,
        )
        if output:
            output.close()
        self._marks[process.pid] = f"{MARK}={mark}"
        self._started.append(process)
        return process

    def dynamics(self, *settings: str, run: str = "out") -> subprocess.Popen[str]:
        options = ["--run", run, "--set=time.end=1000", *(f"--set={s}" for s in settings)]
        return self.start(
            "dynamics", "two_link", "--listen", self.endpoint, "--out", "out", "--json", *options
        )

    def aero(self, *options: str) -> subprocess.Popen[str]:
        return self.start("aero", "--connect", self.endpoint, *options)

    def await_steps(self) -> None:
        """Return as soon as the log shows that the run goes on."""
        log = self.log()
        deadline = time.monotonic() + PATIENCE
        goal = 200_000 + (log.stat().st_size if log.exists() else 0)
        while not log.exists() or log.stat().st_size < goal:
            assert time.monotonic() < deadline, "the run did not get under way"
            assert all(p.poll() is None for p in self._started), self.outputs()
            time.sleep(0.01)

    def forget_last(self) -> None:
        """Let the process that was started last end, or be over, without that being a failure."""
        self._forgotten.append(self._started.pop())

    def outputs(self) -> list[tuple[int | None, str, str]]:
        return [(p.poll(), *(p.communicate() if p.poll() is not None else ("", ""))) for p in self._started]

    def left_by(self, process: subprocess.Popen[str]) -> list[str]:
        """Return the commands of the processes that a process has started, or they have, and that live."""
        mark, left = self._marks[process.pid].encode(), []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                if int(place.name) != process.pid and mark in (place / "environ").read_bytes():
                    left.append((place / "cmdline").read_bytes().replace(b"\0", b" ").decode())
            except OSError:  # it is gone by now
                continue
        return left

    def log(self) -> Path:
        return self.folder / "out" / "log.mcap"

    def end(self) -> None:
        for process in self._started + self._forgotten:
            if process.poll() is None:
                os.kill(process.pid, signal.SIGCONT)
                process.kill()
            process.communicate()
