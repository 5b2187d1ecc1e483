"""Whole runs of every built-in scenario: what they leave, and that the transport changes no bit."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from linkwind.dynamics.timing import ExchangeTimes
from linkwind.errors import InputError, SimulationError
from linkwind.log.reader import open_log
from linkwind.runs.run import Outcome, run
from linkwind.scenario import builtin_names, load
from tests.coarse import COARSE

STEPS = 200


def fly(name: str, folder: Path, *settings: str) -> Outcome:
    end_ns = STEPS * load(name).coupling.step_ns
    changes = [f"time.end={end_ns / 1e9!r}", *COARSE.get(name, ()), *settings]
    return run(load(name, changes), folder, lambda step: None)


@pytest.mark.parametrize("name", builtin_names())
def test_transport_changes_no_bit(name: str, tmp_path: Path) -> None:
    over_zenoh = fly(name, tmp_path / "run")
    (tmp_path / "run").rename(tmp_path / "zenoh")
    inprocess = fly(name, tmp_path / "run", "bus.transport=inprocess")  # same folder: same run id
    assert over_zenoh.result.final_state_sha256 == inprocess.result.final_state_sha256
    logs = [open_log(tmp_path / folder / "log.mcap") for folder in ("zenoh", "run")]
    for topic in ("/motion", "/wrench/aero", "/state", "/step"):
        one, other = (list(log.raw(topic)) for log in logs)
        assert len(one) > STEPS
        assert one == other, topic


@pytest.mark.parametrize("name", builtin_names())
def test_run_leaves_a_complete_log_and_a_report(name: str, tmp_path: Path) -> None:
    outcome = fly(name, tmp_path / "out", "bus.transport=inprocess")
    result = outcome.result
    log = open_log(outcome.log)
    assert log.complete
    assert log.steps == result.steps == STEPS
    assert result.exchanges == STEPS + 1
    assert log.final_state_sha256 == result.final_state_sha256
    assert outcome.report.stat().st_size > 10_000
    path = log.trajectory()
    # Twice the same thing, reached apart: poses and energies of the log against the summary and the physics.
    forces = np.linalg.norm(path.wrench[:, :, :3], axis=2)
    assert math.isclose(forces.max(), result.force_max_N, rel_tol=1e-14)
    if result.joint_gap_max_m is not None:
        assert result.joint_gap_max_m <= 1e-12 * max(1.0, float(np.abs(path.position).max()))
    energy = path.kinetic_energy + path.potential_energy + path.dissipated_work - path.external_work
    sizes = (path.kinetic_energy, path.potential_energy, path.external_work)
    assert np.ptp(energy) <= 1e-7 * max(np.ptp(size) for size in sizes)


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


def test_what_the_coupling_did_follows_from_the_messages(tmp_path: Path) -> None:
    """Residual and interface energy, computed again from the logged trial and accepted states."""
    outcome = fly("two_link", tmp_path / "out", "bus.transport=inprocess")
    log = open_log(outcome.log)
    steps, path = log.steps_table(), log.trajectory()
    trial = log.columns("/motion")
    wrench = log.columns("/wrench/aero")
    n = 2
    for k in range(10, 200):
        linear = path.linear[k] - trial["trial.linear"][k].reshape(n, 3)
        angular = path.angular[k] - trial["trial.angular"][k].reshape(n, 3)
        # two_link: mass 2 kg; inertia 1.4 kg m2 about z, half of that about x and y (mechanism/tables.py)
        kinetic = 2.0 * (linear**2).sum() + (0.7 + 0.7 + 1.4) / 3.0 * (angular**2).sum()
        power = (wrench["force"][k].reshape(n, 3) * linear).sum()
        power += (wrench["torque"][k].reshape(n, 3) * angular).sum()
        assert math.isclose(steps.residual[k], math.sqrt(kinetic), rel_tol=1e-9, abs_tol=1e-15)
        assert math.isclose(steps.interface_energy[k], power * 1e-3, rel_tol=1e-6, abs_tol=1e-18)
    assert steps.residual[10:].max() > 0.0


def test_progress_goes_up_to_the_end(tmp_path: Path) -> None:
    seen: list[int] = []
    run(load("two_link", ["time.end=0.2", "bus.transport=inprocess"]), tmp_path / "out", seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 200
    assert len(seen) > 100


def test_numerical_trouble_names_step_body_and_time(tmp_path: Path) -> None:
    settings = ["bus.transport=inprocess", 'aero.field.link1.fx="1e4*vx*vx*vx"']
    with pytest.raises(
        SimulationError, match=r'exchange of step \d+ \(t = .* s\): body "link\d": expected finite'
    ):
        run(load("two_link_field", settings), tmp_path / "out", lambda step: None)
    assert "SimulationError" in str(open_log(tmp_path / "out" / "log.mcap").error)


@pytest.mark.parametrize(
    ("setting", "expected"),
    [
        ('aero.field.link1.fx="1+*t"', "aero.field.link1.fx"),
        ("bodies.link2.position=[9, 0]", "bodies"),
    ],
)
def test_bad_input_leaves_nothing_behind(tmp_path: Path, setting: str, expected: str) -> None:
    with pytest.raises(InputError, match=expected):
        run(load("two_link_field", [setting]), tmp_path / "out", lambda step: None)
    assert not (tmp_path / "out").exists()


def test_report_that_cannot_be_written_does_not_hide_the_result(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Path, *arguments: object, **options: object) -> int:
        raise OSError(28, "No space left on device", str(self))

    monkeypatch.setattr(Path, "write_text", full)
    outcome = fly("two_link", tmp_path / "out", "bus.transport=inprocess")
    assert outcome.result.steps == 200
    assert "No space left on device" in outcome.report_trouble
    assert outcome.as_json()["report"] is None
    assert open_log(outcome.log).complete


def test_exchange_times_are_counted_in_constant_memory() -> None:
    times = ExchangeTimes()
    samples = np.random.default_rng(0).lognormal(12.0, 1.0, 5000).astype(int).tolist()
    for sample in samples:
        times.add(sample)
    for q in (0.5, 0.99):
        assert math.isclose(times.quantile_us(q), np.quantile(samples, q) / 1e3, rel_tol=0.011)
    times.add(0)
    times.add(10**15)
    assert times.count == 5002
