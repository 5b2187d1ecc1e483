"""A log that will not fit on the disk is told of while there is time."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest

from linkwind.runs.room import SAMPLE, looking
from linkwind.runs.run import run
from linkwind.scenario import load


@pytest.mark.parametrize(("free", "told"), [(99e6, True), (101e6, False)])
def test_the_rest_of_the_run_is_set_against_what_is_free(
    free: float, told: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """1,000 bytes a step, 100,000 steps to come: 0.1 GB."""
    log, seen = SimpleNamespace(path=tmp_path / "log.mcap", size=0), []
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=free))
    look = looking(seen.append, log, 100_000 + 2 * SAMPLE)
    with caplog.at_level(logging.WARNING, "linkwind"):
        for step in (SAMPLE, SAMPLE + 1, 2 * SAMPLE, 3 * SAMPLE):
            log.size = 7_000 + 1_000 * step
            look(step)
    assert seen == [SAMPLE, SAMPLE + 1, 2 * SAMPLE, 3 * SAMPLE]
    assert [record.getMessage().split(". Is")[0] for record in caplog.records] == [
        f"note: {log.path}: the log grows by 1000 B a step, so that the 100000 steps to come ask for 0.1 GB; "
        "0.099 GB are free"
    ] * told


def test_short_runs_are_not_looked_at(tmp_path: Path) -> None:
    looking(lambda step: None, SimpleNamespace(path=tmp_path), 2 * SAMPLE)(SAMPLE + 1)  # without a size


def test_a_run_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("linkwind.runs.room.SAMPLE", 20)
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=1))
    settings = ["bus.transport=inprocess", "time.end=3.0", "coupling.step=1e-4"]
    with caplog.at_level(logging.WARNING, "linkwind"):
        run(load("two_link", settings), tmp_path / "out", report=False)
    assert sum("the log grows by" in record.getMessage() for record in caplog.records) == 1
