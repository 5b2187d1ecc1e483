"""Whole runs of every built-in scenario: what they leave, and that the transport changes no bit."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from linkwind.log.reader import open_log
from linkwind.runs.run import Outcome, run
from linkwind.scenario import builtin_names, load

SHORT = ["time.end=0.2"]


def fly(name: str, folder: Path, *settings: str) -> Outcome:
    return run(load(name, [*SHORT, *settings]), folder, lambda step: None)


@pytest.mark.parametrize("name", builtin_names())
def test_transport_changes_no_bit(name: str, tmp_path: Path) -> None:
    over_zenoh = fly(name, tmp_path / "run")
    (tmp_path / "run").rename(tmp_path / "zenoh")
    inprocess = fly(name, tmp_path / "run", "bus.transport=inprocess")  # same folder: same run id
    assert over_zenoh.result.final_state_sha256 == inprocess.result.final_state_sha256
    logs = [open_log(tmp_path / folder / "log.mcap") for folder in ("zenoh", "run")]
    for topic in ("/motion", "/wrench/aero", "/state", "/step"):
        one, other = (list(log.raw(topic)) for log in logs)
        assert len(one) > 200
        assert one == other, topic


@pytest.mark.parametrize("name", builtin_names())
def test_run_leaves_a_complete_log_and_a_report(name: str, tmp_path: Path) -> None:
    outcome = fly(name, tmp_path / "out", "bus.transport=inprocess")
    result = outcome.result
    log = open_log(outcome.log)
    assert log.complete
    assert log.steps == result.steps == 200
    assert result.exchanges == 201
    assert log.final_state_sha256 == result.final_state_sha256
    assert outcome.report.stat().st_size > 10_000
    path = log.trajectory()
    # Twice the same thing, reached apart: poses and energies of the log against the summary and the physics.
    forces = np.linalg.norm(path.wrench[:, :, :3], axis=2)
    assert math.isclose(forces.max(), result.force_max_N, rel_tol=1e-14)
    if result.joint_gap_max_m is not None:
        assert result.joint_gap_max_m <= 1e-12 * max(1.0, float(np.abs(path.position).max()))
    energy = path.kinetic_energy + path.potential_energy + path.dissipated_work - path.external_work
    assert np.ptp(energy) <= 1e-7 * np.ptp(path.potential_energy)


def test_hinge_holds_the_links_together_and_without_it_they_part(tmp_path: Path) -> None:
    gaps = {}
    for name in ("two_link", "two_link_free"):
        settings = ["time.end=1.2", "bus.transport=inprocess"]
        path = open_log(run(load(name, settings), tmp_path / name, lambda step: None).log).trajectory()
        angle = 2.0 * np.arctan2(path.orientation[:, :, 3], path.orientation[:, :, 0])
        ends = path.position[:, :, :2] - 0.25 * np.stack([np.cos(angle), np.sin(angle)], axis=2)
        gaps[name] = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    assert gaps["two_link"].max() < 1e-14
    assert gaps["two_link_free"][0] < 1e-14
    assert gaps["two_link_free"][-1] > 0.1


def test_summary_as_json_is_plain_and_complete(tmp_path: Path) -> None:
    outcome = fly("two_link", tmp_path / "out", "bus.transport=inprocess")
    summary = json.loads(json.dumps(outcome.as_json()))
    assert summary["exchange_us"]["median"] <= summary["exchange_us"]["p99"]
    assert Path(summary["log"]).exists()
    assert len(summary["final_state_sha256"]) == 64
    free = fly("two_link_free", tmp_path / "free", "bus.transport=inprocess")
    assert free.as_json()["joint_gap_max_m"] is None
