"""A run that is killed: what it leaves is recovered, and verified as far as it goes."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from linkwind.runs.verify import scenario_of, verify

PATIENCE = 60.0  # s for a machine under load


def kill_at(size: int, folder: Path, *settings: str) -> Path:
    """Start a long run, kill it as soon as its log has ``size`` bytes; return the log."""
    log = folder / "out" / "log.mcap"
    options = [f"--set={setting}" for setting in ("time.end=1000", *settings)]
    process = subprocess.Popen(
        [sys.executable, "-m", "linkwind", "run", "two_link", "--out", "out", "--json", *options],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        deadline = time.monotonic() + PATIENCE
        while not log.exists() or log.stat().st_size < size:
            assert process.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.005)
    finally:
        os.kill(process.pid, signal.SIGKILL)
        process.wait()
    return log


@pytest.mark.parametrize("transport", ["zenoh", "inprocess"])
@pytest.mark.parametrize("size", [300_000, 1_000_000])
def test_killed_run_is_recovered_and_verified(size: int, transport: str, tmp_path: Path) -> None:
    log = kill_at(size, tmp_path, f"bus.transport={transport}")
    clean = recover(log, tmp_path / "clean.mcap").file
    states = open_log(clean).topics["/state"]
    assert states > 50
    for path in (log, clean):
        found = verify(*scenario_of(path))
        assert found.identical
        assert found.steps == states - 1
        assert "not complete" in found.remark
        assert verify(*scenario_of(path), from_recorded_wrenches=True).identical
