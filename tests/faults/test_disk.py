"""A disk that takes no more, and one that is slow: no run hangs, and no log is cut without saying so."""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from pathlib import Path

import pytest

from linkwind.log import sink
from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.faults import disks
from tests.faults.disks import Disk
from tests.faults.programs import PATIENCE, Programs

ROOM = 1_500_000  # bytes; two_link has 2,300 a step
SETTINGS = ("--set=time.end=1.2", "--set=bus.transport=inprocess")


def on_a_full_disk(folder: Path, *settings: str) -> subprocess.CompletedProcess[str]:
    """Run two_link where no file can be larger than there is room."""
    return subprocess.run(
        [sys.executable, "-m", "linkwind", "run", "two_link", "--out", "out", "--json", *SETTINGS, *settings],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, ROOM)),
    )


def test_full_disk_stops_the_run_with_a_readable_log(tmp_path: Path) -> None:
    done = on_a_full_disk(tmp_path)
    assert done.returncode == 3
    assert (
        "out/log.mcap: expected to write the log; got File too large. The file is cut there." in done.stderr
    )
    log = open_log(tmp_path / "out" / "log.mcap")
    assert not log.complete
    assert "the disk full" in log.damage.text if log.damage else False
    assert 400 < log.steps < 1200
    assert verify(*scenario_of(log.path)).identical


def test_run_goes_on_without_its_log_if_the_scenario_says_so(tmp_path: Path) -> None:
    done = on_a_full_disk(tmp_path, "--set=log.required=false")
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    whole = run(
        load("two_link", [s.removeprefix("--set=") for s in SETTINGS]), tmp_path / "whole", lambda k: None
    )
    assert said["final_state_sha256"] == whole.result.final_state_sha256
    assert said["steps"] == 1200
    assert said["log_trouble"].startswith("out/log.mcap: expected to write the log; got File too large.")
    assert whole.as_json()["log_trouble"] is None
    log = open_log(tmp_path / "out" / "log.mcap")  # and the file does not pretend to be whole
    assert not log.complete
    assert log.damage is not None


def test_slow_disk_delays_the_run_and_changes_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = ["time.end=0.3", "bus.transport=inprocess"]
    fast = run(load("two_link", settings), tmp_path / "fast", lambda step: None)
    written = []

    def slowly(descriptor: int, data: memoryview) -> int:
        time.sleep(0.05)
        written.append(len(data))
        return write(descriptor, data[: 1 + len(data) // 2])  # and in pieces

    write = sink.os.write
    monkeypatch.setattr(sink.os, "write", slowly)
    slow = run(load("two_link", settings), tmp_path / "slow", lambda step: None)
    assert len(written) > 10
    assert slow.result.final_state_sha256 == fast.result.final_state_sha256
    log = open_log(slow.log)
    assert log.complete
    assert log.steps == 300


def test_disk_that_cannot_be_written_is_named_before_anything_starts(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    program = [sys.executable, "-m", "linkwind", "run", "two_link", "--out", "file/out", *SETTINGS]
    done = subprocess.run(program, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 3
    assert "file/out: cannot create the folder of the run: Not a directory" in done.stderr


def on_a_disk_that_fails(folder: Path, *, required: bool, after: float) -> float:
    """Run two_link on a disk that can only be read after ``after`` s; return how long it still took [s]."""
    disk = Disk(folder)
    programs = Programs(disk.place)
    log = programs.log()
    try:
        settings = ["--set=time.end=15", f"--set=log.required={str(required).lower()}"]
        process = programs.start("run", "two_link", "--out", "out", "--json", *settings)
        programs.await_steps()
        time.sleep(after)
        disk.fail()
        began = time.monotonic()
        output, said = process.communicate(timeout=PATIENCE)
        took = time.monotonic() - began
        assert "expected to write the log; got Read-only file system. The file is cut there" in said, said
        assert "Traceback" not in said, said
        assert process.returncode == (3 if required else 0), said
        if not required:
            assert "Read-only file system" in json.loads(output)["log_trouble"]
            assert json.loads(output)["steps"] == 15_000
        assert not open_log(log).complete
        assert open_log(log).steps > 0
        assert verify(*scenario_of(log)).identical
        return took
    finally:
        programs.end()
        disk.end()


@pytest.mark.parametrize("required", [True, False])
def test_disk_that_can_only_be_read_all_at_once(required: bool, tmp_path: Path) -> None:
    if why := disks.reason():
        pytest.skip(why)
    on_a_disk_that_fails(tmp_path, required=required, after=0.1)
