"""A dynamics that is killed again and again, and started again by the same command, ends in the same bits."""

from __future__ import annotations

import json
import os
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from linkwind.log.contents import MOTION
from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.runs.successor import NAME
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.faults.test_processes import PATIENCE, Programs

TRIES = int(os.environ.get("LINKWIND_KILLS", "3"))
SEED = 20210305  # the first day of the paper
KILLS = 4  # in one run
RUNS = (
    ("two_link", "time.end=12.0", "log.checkpoint_every=200"),
    ("two_link_gust", "time.end=10.0"),
    (
        "two_link_flow",
        "time.end=1.0",
        "aero.flow.cells=16",
        "aero.flow.frames=50",
        "log.checkpoint_every=300",
    ),
)


@pytest.fixture
def programs(tmp_path: Path) -> Iterator[Programs]:
    started = Programs(tmp_path)
    yield started
    started.end()


def again(programs: Programs, *settings: str, scenario: str = "two_link") -> subprocess.Popen[str]:
    """Start the dynamics by the command that does for every start."""
    options = ["--listen", programs.endpoint, "--out", "out", "--json", *(f"--set={s}" for s in settings)]
    return programs.start("dynamics", scenario, "--resume", *options)


def messages(log: Path) -> list[tuple[str, int, bytes]]:
    """Return what can be read of a log but for how long exchanges took."""
    return [tuple(m) for m in open_log(log).raw() if m.topic != "/timing"] if log.exists() else []


def killed_on_the_way(programs: Programs, process: subprocess.Popen[str], whole: int, chance: Random) -> bool:
    """Kill a dynamics at a random moment; tell whether its run was not over.

    The moment is one of progress, as machines differ in speed: the log that it writes has come to a size
    between a little less than what was held before, when that is still being copied, and half of the way
    from there to the ``whole`` log.
    """
    log, new = programs.log(), programs.log().with_name(NAME)
    began, held = time.time(), log.stat().st_size if log.exists() else 0
    size = max(1.0, held + chance.uniform(-0.1, 0.5) * (whole - held))
    deadline = time.monotonic() + PATIENCE
    while process.poll() is None and not any(grown(path, began) >= size for path in (log, new)):
        assert time.monotonic() < deadline
        time.sleep(0.005)
    process.kill()
    process.wait()
    return not open_log(log).complete


def grown(path: Path, since: float) -> int:
    """Return the size of a file, 0 if it was not written since then."""
    try:
        status = path.stat()
    except FileNotFoundError:
        return 0
    return status.st_size if status.st_ctime > since else 0


@pytest.mark.parametrize("trial", range(TRIES))
def test_killed_again_and_again_it_ends_in_the_same_state(
    trial: int, programs: Programs, tmp_path: Path
) -> None:
    name, *settings = RUNS[trial % len(RUNS)]
    chance = Random(SEED + trial)
    whole = run(
        load(name, [*settings, "bus.transport=inprocess"]), tmp_path / "whole" / "out", lambda step: None
    )
    aero = programs.aero("--stay")
    kills, size = 0, whole.log.stat().st_size
    for _ in range(KILLS):
        held = messages(programs.log())
        kills += killed_on_the_way(programs, again(programs, *settings, scenario=name), size, chance)
        # Nothing that a log has held is lost.
        assert messages(programs.log())[: len(held)] == held
    assert kills > 1
    last = again(programs, *settings, scenario=name)
    said, errors = last.communicate(timeout=PATIENCE)
    assert last.returncode == 0, errors
    assert json.loads(said)["final_state_sha256"] == whole.result.final_state_sha256
    assert messages(programs.log()) == messages(whole.log)
    assert verify(*scenario_of(programs.log())).identical
    assert sorted(path.name for path in programs.log().parent.iterdir()) == ["log.mcap", "report.html"]
    assert aero.poll() is None
    # Once more, there is nothing to do.
    once_more = again(programs, *settings, scenario=name)
    said, errors = once_more.communicate(timeout=PATIENCE)
    assert once_more.returncode == 0, errors
    assert json.loads(said)["finished_before"]
    assert open_log(programs.log()).topics[MOTION] == open_log(whole.log).topics[MOTION]
