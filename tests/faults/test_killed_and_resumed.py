"""Runs that are killed at random moments: recovered and resumed, they end in the same state to the bit.

Ten in CI; all fifty by ``LINKWIND_KILLS=50 pytest -m slow tests/faults/test_killed_and_resumed.py``.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import pytest

from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load

KILLS = int(os.environ.get("LINKWIND_KILLS", "10"))
SEED = 20210305  # the first day of the paper
PATIENCE = 60.0  # s for a machine under load

RUNS = (
    ("two_link", "time.end=2.0", "log.checkpoint_every=100"),
    ("two_link_field", "time.end=2.0", "log.checkpoint_every=70"),
    ("two_link_gust", "time.end=2.0"),
    ("two_link_free", "time.end=1.5", "log.checkpoint_every=1"),
    ("two_link_flow", "time.end=0.04", "aero.flow.cells=16", "aero.flow.frames=5", "log.checkpoint_every=60"),
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory):
    """Return the final state and the size of the log of a run that is left alone."""

    @cache
    def left_alone(name: str, *settings: str) -> tuple[str, int]:
        folder = tmp_path_factory.mktemp(name)
        done = run(load(name, [*settings, "bus.transport=inprocess"]), folder, lambda step: None)
        return done.result.final_state_sha256, done.log.stat().st_size

    return left_alone


def killed(folder: Path, size: int, delay: float, name: str, *settings: str) -> Path:
    """Start a run, kill it ``delay`` seconds after its log has ``size`` bytes; return the log."""
    log = folder / "out" / "log.mcap"
    options = ["--out", "out", "--json", *(f"--set={setting}" for setting in settings)]
    process = subprocess.Popen(
        [sys.executable, "-m", "linkwind", "run", name, *options],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + PATIENCE
        while not log.exists() or log.stat().st_size < size:
            assert time.monotonic() < deadline
            if process.poll() is not None:  # it was faster than we could look
                break
        due = time.perf_counter() + delay
        while time.perf_counter() < due:
            pass
    finally:
        if process.poll() is None:
            os.kill(process.pid, signal.SIGKILL)
        process.wait()
    return log


@pytest.mark.parametrize("kill", range(KILLS))
def test_it_ends_in_the_same_state(kill: int, whole, tmp_path: Path) -> None:
    chance = random.Random(SEED + kill)
    name, *settings = RUNS[kill % len(RUNS)]
    transport = "zenoh" if kill % 2 else "inprocess"
    digest, size = whole(name, *settings)
    moment = int(chance.uniform(0.05, 0.9) * size), chance.uniform(0.0, 0.05)
    log = killed(tmp_path, *moment, name, *settings, f"bus.transport={transport}")
    if chance.random() < 0.7:
        log = recover(log, tmp_path / "clean.mcap").file
    found = plan(open_log(log), None if not open_log(log).complete else 0)
    done = resume(found, tmp_path / "again").outcome
    assert done.result.final_state_sha256 == digest
    assert verify(*scenario_of(done.log)).identical
