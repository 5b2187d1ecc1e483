"""Machines of a test: network namespaces with cables between them, gone at the end whatever happens."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import uuid
from pathlib import Path

PATIENCE = 60.0  # s for a machine under load


def ip(*arguments: str) -> None:
    """Run the command ``ip``."""
    subprocess.run(["ip", *arguments], check=True, capture_output=True, text=True)


def reason() -> str:
    """Return why there can be no namespaces here; empty if there can."""
    if shutil.which("ip") is None:
        return "needs the command ip (iproute2)"
    name = f"lw-{uuid.uuid4().hex[:8]}"
    try:
        ip("netns", "add", name)
    except subprocess.CalledProcessError as error:
        return f"network namespaces cannot be made here: {error.stderr.strip()}"
    ip("netns", "delete", name)
    return ""


class Machines:
    """Namespaces, cables, and the processes in them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._id = uuid.uuid4().hex[:6]
        self._cables = 0
        self._names: list[str] = []
        self._processes: list[subprocess.Popen[str]] = []

    def add(self, *names: str) -> None:
        """Add machines, each with a loopback of its own."""
        for name in names:
            ip("netns", "add", self._namespace(name))
            self._names.append(name)
            ip("-n", self._namespace(name), "link", "set", "lo", "up")

    def connect(self, one: str, other: str) -> tuple[str, str]:
        """Put a cable between two machines; return their addresses on it."""
        self._cables += 1
        ends = [f"lw{self._id}{self._cables}{end}" for end in "ab"]
        addresses = [f"10.77.{self._cables}.{end}" for end in (1, 2)]
        ip("link", "add", ends[0], "type", "veth", "peer", "name", ends[1])
        for name, end, address in zip((one, other), ends, addresses, strict=True):
            ip("link", "set", end, "netns", self._namespace(name))
            ip("-n", self._namespace(name), "address", "add", f"{address}/24", "dev", end)
            ip("-n", self._namespace(name), "link", "set", end, "up")
        return addresses[0], addresses[1]

    def cable(self, machine: str, number: int, state: str) -> None:
        """Pull a cable out of a machine (``down``), or put it in again (``up``)."""
        ip("-n", self._namespace(machine), "link", "set", f"lw{self._id}{number}a", state)

    def start(self, machine: str, *arguments: str) -> subprocess.Popen[str]:
        """Start ``linkwind ARGUMENTS`` on a machine."""
        inside = ["ip", "netns", "exec", self._namespace(machine)]
        process = subprocess.Popen(
            [*inside, sys.executable, "-m", "linkwind", *arguments],
            cwd=self.folder,
            env=os.environ | {"PYTHONUNBUFFERED": "1"},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self._processes.append(process)
        return process

    def _namespace(self, name: str) -> str:
        return f"lw-{self._id}-{name}"

    def end(self) -> None:
        """End every process and remove every namespace, and the cables with them."""
        for process in self._processes:
            if process.poll() is None:
                process.kill()
            process.communicate()
        for name in self._names:
            ip("netns", "delete", self._namespace(name))


def finish(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Return exit code, output and errors of a process."""
    output, errors = process.communicate(timeout=PATIENCE)
    return process.returncode, output, errors
