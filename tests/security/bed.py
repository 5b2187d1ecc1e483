"""A live run to attack: real processes, directly reachable and behind a router as well."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import zenoh

from linkwind.bus.zenoh import loopback_endpoint
from linkwind.credentials import Identity
from linkwind.credentials.authority import DEFAULT_ROLES, Role, issue
from linkwind.log.reader import open_log
from linkwind.runs.verify import scenario_of, verify

PATIENCE = 60.0  # s for a machine under load
RUN = "attacked"
BASE = f"linkwind/v1/{RUN}"


class Bed:
    """One run over a secure bus, or a plain one; ended, and verified, at the end."""

    def __init__(self, folder: Path, *, secure: bool = True) -> None:
        self.folder, self.secure = folder, secure
        self.certs = folder / "certs"
        issue(self.certs, [*DEFAULT_ROLES, Role("tail"), Role("router", ("127.0.0.1",))], 2)
        protocol = "tls" if secure else "tcp"
        self.direct, self.by_router = loopback_endpoint(protocol), loopback_endpoint(protocol)
        self._processes: list[subprocess.Popen[str]] = []

    def __enter__(self) -> Bed:
        where = ["--listen", self.direct, "--connect", self.by_router]
        settings = ["--set=time.end=1000", "--set=coupling.timeout=20"]
        self._start("dynamics", "two_link", "--run", RUN, "--out", "out", "--json", *where, *settings)
        self._start("aero", "--connect", self.by_router)
        self._start("router", "--listen", self.by_router)  # of its own, for zenoh's threads are a process's
        self.await_steps()
        return self

    def _start(self, *arguments: str) -> None:
        tls = ["--tls", str(self.certs)] if self.secure else []
        command = [sys.executable, "-m", "linkwind", *arguments, *tls]
        pipe = subprocess.PIPE
        self._processes.append(
            subprocess.Popen(command, cwd=self.folder, stdout=pipe, stderr=pipe, text=True)
        )

    @property
    def log(self) -> Path:
        """The log of the run."""
        return self.folder / "out" / "log.mcap"

    def alive(self) -> bool:
        """Tell whether nobody has ended the run."""
        return all(process.poll() is None for process in self._processes)

    def await_steps(self) -> bool:
        """Wait until the run has gone on for a while; False if it has ended."""
        deadline = time.monotonic() + PATIENCE
        goal = 100_000 + (self.log.stat().st_size if self.log.exists() else 0)
        while not self.log.exists() or self.log.stat().st_size < goal:
            assert time.monotonic() < deadline, "the run does not go on"
            if not self.alive():
                return False
            time.sleep(0.02)
        return True

    def stop(self) -> str:
        """End the run as Ctrl-C does, unless it is over; return what dynamics and aero printed."""
        if self.alive():
            self._processes[0].send_signal(signal.SIGINT)
        ends = self._processes[:2]
        said = "".join("".join(each.communicate(timeout=PATIENCE)) for each in ends)
        self._processes[2].terminate()
        return said

    def untouched(self) -> bool:
        """Tell whether every bit of the log, up to where the run was stopped, is what nobody disturbed."""
        error = str(open_log(self.log).error)
        assert "StoppedError" in error, error
        return verify(*scenario_of(self.log)).identical

    def __exit__(self, *error: object) -> None:
        for process in self._processes:
            if process.poll() is None:
                os.kill(process.pid, signal.SIGKILL)
            process.communicate()


def attacker(
    endpoint: str, identity: Identity | None, mode: str = "peer", region: str = "observer"
) -> zenoh.Session:
    """Open a session with no rule and no check of our own: what somebody would write who means harm."""
    settings: dict[str, Any] = {
        "mode": mode,
        "region_name": region,
        "connect/endpoints": [endpoint],
        "scouting/multicast/enabled": False,
        "transport/link/tx/lease": 1000,
    }
    if identity:
        settings["transport/link/tls"] = {
            "root_ca_certificate": str(identity.ca),
            "connect_certificate": str(identity.certificate),
            "connect_private_key": str(identity.key),
            "enable_mtls": True,
        }
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)
