"""A provider is killed, stopped or cut off in the middle of a run that waits for it, and comes back."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import time
from collections.abc import Mapping
from pathlib import Path
from random import Random
from types import MappingProxyType
from typing import Any

from linkwind.aero import Own
from linkwind.bus.zenoh import LEASE
from linkwind.log.reader import open_log
from linkwind.runs.verify import scenario_of, verify
from tests.faults.test_processes import Programs
from tests.networks.namespaces import Machines

PATIENCE = 120.0  # s for a machine under load
RECOVERY = 60.0  # s
LONG = (f"bus.recovery={RECOVERY:g}", "coupling.timeout=20", "time.end=10")  # 10,000 steps
STARTED = 100_000  # bytes of a log
SIZE = 22_000_000  # bytes of the whole log of LONG


def unharmed(
    process: subprocess.Popen[str], log: Path, own: Mapping[str, Own] = MappingProxyType({})
) -> dict[str, Any]:
    """Wait for a run; check that every bit of it is as if nothing had been; return its summary."""
    output, errors = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0, errors
    assert "Traceback" not in errors, errors
    summary: dict[str, Any] = json.loads(output)
    assert open_log(log).complete
    found = verify(*scenario_of(log), own=own)
    assert found.identical, found
    assert found.steps == summary["steps"]
    for back in summary["returns"]:
        assert f'"{back["provider"]}" was lost at step {back["step"]} ' in errors
        assert f'"{back["provider"]}" is back after {back["after_s"]:.1f} s' in errors
    return summary


def children_of(run: subprocess.Popen[str]) -> list[int]:
    """Return the processes of a run's providers."""
    return [int(child) for child in Path(f"/proc/{run.pid}/task/{run.pid}/children").read_text().split()]


def child_of(run: subprocess.Popen[str]) -> int:
    """Return the process of a run's only provider."""
    (child,) = children_of(run)
    return child


def under_way(log: Path, size: int = STARTED) -> None:
    """Wait until a run has come so far that its log has ``size`` bytes."""
    deadline = time.monotonic() + PATIENCE
    while not log.exists() or log.stat().st_size < size:
        assert time.monotonic() < deadline, "the run did not get under way"
        time.sleep(0.005)


def hit(folder: Path, number: signal.Signals, size: int, scenario: str = "two_link", *settings: str) -> float:
    """Send a signal to the provider of a run whose log has come to ``size`` bytes.

    Returns:
        How long the provider was away [s].
    """
    programs = Programs(folder)
    try:
        options = [f"--set={setting}" for setting in (*LONG, *settings)]
        run = programs.start("run", scenario, "--out", "out", "--json", *options)
        under_way(programs.log(), size)
        os.kill(child_of(run), number)
        returns = unharmed(run, programs.log())["returns"]
        assert returns
        return float(max(back["after_s"] for back in returns))  # under load, a lease may be over as well
    finally:
        programs.end()


def hit_twice(folder: Path, after: float) -> None:
    """Kill the provider of a run, and the next one so soon [s] that it is still on its way."""
    programs = Programs(folder)
    try:
        options = [f"--set={setting}" for setting in LONG]
        run = programs.start("run", "two_link", "--out", "out", "--json", *options)
        under_way(programs.log())
        first = child_of(run)
        os.kill(first, signal.SIGKILL)
        deadline = time.monotonic() + PATIENCE
        while not (next_ones := set(children_of(run)) - {first}):
            assert time.monotonic() < deadline, "it was not started again"
            time.sleep(0.005)
        time.sleep(after)
        os.kill(next_ones.pop(), signal.SIGKILL)
        assert unharmed(run, programs.log())["returns"]
    finally:
        programs.end()


def cut(folder: Path, gone: float) -> float:
    """Pull the cable between two machines for a while; return how long the provider was away [s]."""
    machines = Machines(folder)
    try:
        machines.add("d", "a")
        here, _ = machines.connect("d", "a")
        machines.start("a", "aero", "--stay", "--connect", f"tcp/{here}:7447")
        options = ["two_link", "--out", "out", "--json", *(f"--set={setting}" for setting in LONG)]
        dynamics = machines.start("d", "dynamics", "--listen", "tcp/0.0.0.0:7447", *options)
        under_way(folder / "out" / "log.mcap")
        machines.cable("d", 1, "down")
        time.sleep(gone)
        machines.cable("d", 1, "up")
        returns = unharmed(dynamics, folder / "out" / "log.mcap")["returns"]
        assert returns or gone < 2.0 * LEASE
        return float(sum(back["after_s"] for back in returns))
    finally:
        machines.end()


def some_time(chance: Random) -> int:
    """Return a random moment of LONG as bytes of its log: by progress, as machines differ in speed."""
    return int(chance.uniform(STARTED, 0.7 * SIZE))


def killed(folder: Path, chance: Random) -> float:
    """Kill the provider at a random moment of two_link."""
    return hit(folder, signal.SIGKILL, some_time(chance))


def silent(folder: Path, chance: Random) -> float:
    """Let the provider say nothing more: stop it, and wait less for an answer than for a sign of life."""
    return hit(folder, signal.SIGSTOP, some_time(chance), "two_link", f"coupling.timeout={LEASE / 2:g}")


def cut_off(folder: Path, chance: Random) -> float:
    """Cut the network for 2 to 10 s; return for how long the run stood still besides."""
    gone = chance.uniform(2.0, 10.0)
    return max(0.0, cut(folder, gone) - gone)
