"""Tables of a log: every number comes back with its bits."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import InputError, LogError
from linkwind.log import export
from linkwind.log.reader import open_log
from linkwind.log.vtk import export_vtk
from linkwind.mechanism import build
from linkwind.mechanism.labels import labels, units
from linkwind.runs.run import run
from linkwind.scenario import builtin_names, load
from tests.log.sample import NAMES, new_writer, record

POINTS = 20


def read(path):
    with path.open(newline="", encoding="utf-8") as file:
        head, *rows = csv.reader(file)
    return {name: np.array([float(row[i]) for row in rows]) for i, name in enumerate(head)}


def test_every_number_comes_back(tmp_path, monkeypatch):
    monkeypatch.setattr(export, "BLOCK", 7)  # not a divisor of the number of messages
    states, _ = record(tmp_path / "log.mcap", POINTS)
    files = export.export_csv(open_log(tmp_path / "log.mcap"), tmp_path / "tables")
    assert [file.name for file in files] == ["trajectory.csv", "steps.csv", "wrench_aero.csv"]
    trajectory, steps, wrench = map(read, files)
    assert trajectory["step"].tolist() == list(range(POINTS))
    assert trajectory["t [s]"].tolist() == [k * 1_000_000 / 1e9 for k in range(POINTS)]
    for k, state in enumerate(states):
        for b, body in enumerate(NAMES):
            for i, axis in enumerate("xyz"):
                assert trajectory[f"{body}.position.{axis} [m]"][k] == state.motion.position[b, i]
                assert trajectory[f"{body}.angular.{axis} [rad/s]"][k] == state.motion.angular[b, i]
                assert trajectory[f"{body}.wrench.r{axis} [N m]"][k] == state.arrays["wrench"][b, 3 + i]
            for i, axis in enumerate("wxyz"):
                assert trajectory[f"{body}.orientation.{axis}"][k] == state.motion.orientation[b, i]
        assert trajectory["q.4"][k] == state.arrays["q"][4]
        assert trajectory["joint_gap [m]"][k] == state.scalars["joint_gap"]
        assert wrench["link2.force.y [N]"][k] == state.wrench.force[1, 1]
        assert wrench["link1.torque.z [N m]"][k] == state.wrench.torque[0, 2]
        assert steps["interface_energy [J]"][k] == -0.25 * k
        assert steps["extrapolation_error.0"][k] == 0.5 * k
        assert np.isnan(steps["extrapolation_error.3"][k])
    assert "ball.force.x [N]" not in wrench  # the provider does not act on it


def test_parquet_has_the_bits_of_csv(tmp_path, monkeypatch):
    """Read by pyarrow and held against the numbers that the text gives."""
    from pyarrow import parquet

    monkeypatch.setattr(export, "BLOCK", 7)
    record(tmp_path / "log.mcap", POINTS)
    log = open_log(tmp_path / "log.mcap")
    texts, binaries = (kind(log, tmp_path / "out") for kind in (export.export_csv, export.export_parquet))
    assert [file.name for file in binaries] == ["trajectory.parquet", "steps.parquet", "wrench_aero.parquet"]
    for text, binary in zip(texts, binaries, strict=True):
        table = parquet.read_table(binary)
        assert table.column_names == list(read(text))
        for name, values in read(text).items():
            column = table[name].to_numpy()
            assert np.array_equal(column.astype(float).view(np.uint64), values.view(np.uint64)), name
    with pytest.raises(LogError, match=r"trajectory\.parquet: expected to make a new file"):
        export.export_parquet(log, tmp_path / "out")


def test_a_missing_library_is_named(tmp_path, monkeypatch):
    record(tmp_path / "log.mcap", 2)
    log = open_log(tmp_path / "log.mcap")
    for module in ("pyarrow", "pyevtk"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InputError, match=r"pip install 'linkwind\[parquet\]'"):
        export.export_parquet(log, tmp_path / "a")
    with pytest.raises(InputError, match=r"pip install 'linkwind\[vtk\]'"):
        export_vtk(log, tmp_path / "b")


def test_nothing_is_written_over_and_nothing_from_nothing(tmp_path):
    record(tmp_path / "log.mcap", 2)
    log = open_log(tmp_path / "log.mcap")
    export.export_csv(log, tmp_path / "tables")
    with pytest.raises(LogError, match=r"trajectory\.csv: expected to make a new file"):
        export.export_csv(log, tmp_path / "tables")
    new_writer(tmp_path / "empty.mcap").close()
    with pytest.raises(LogError, match="expected messages to export"):
        export.export_csv(open_log(tmp_path / "empty.mcap"), tmp_path / "none")


def test_command_says_what_is_missing(tmp_path):
    record(tmp_path / "log.mcap", 20, flush_every=4)
    data = (tmp_path / "log.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    done = CliRunner().invoke(app, ["log", "export", str(tmp_path / "cut.mcap"), "-o", str(tmp_path / "t")])
    assert done.exit_code == 0
    assert "note: the log is not complete" in done.stderr
    rows = read(tmp_path / "t" / "trajectory.csv")["step"]
    assert 0 < len(rows) == open_log(tmp_path / "cut.mcap").topics["/state"] < 20


def test_coordinates_and_forces_have_the_names_of_the_scenario(tmp_path):
    """The wings of the flapper beat as its motions say."""
    short = ["time.end=0.02", "bus.transport=inprocess"]
    log = run(load("flapper", short), tmp_path / "run", lambda step: None).log
    done = CliRunner().invoke(app, ["log", "export", str(log), "-o", str(tmp_path / "t")])
    assert done.exit_code == 0, done.output
    found = read(tmp_path / "t" / "trajectory.csv")
    t = found["t [s]"]
    np.testing.assert_allclose(found["right_shoulder.q [rad]"], -0.6 * np.sin(12.0 * np.pi * t), atol=1e-12)
    np.testing.assert_allclose(
        found["left_shoulder.v [rad/s]"], 7.2 * np.pi * np.cos(12.0 * np.pi * t), atol=1e-9
    )
    assert {"left_beat.force_effort [N m]", "right_beat.force_power [W]", "world-body.q.6"} < set(found)
    assert {"world-body.q.2 [m]", "world-body.v.2 [m/s]", "world-body.v.5 [rad/s]"} < set(found)


def titles(scenario):
    mechanism = build(scenario)
    known = units(mechanism)
    return {
        field: [f"{name} [{unit}]" if unit else name for name, unit in zip(names, known[field], strict=True)]
        for field, names in labels(mechanism).items()
    }


def test_the_unit_is_that_of_the_kind_of_joint_and_element():
    """A slider and a wheel, both driven; of what may be released the coordinates have no one unit."""
    assert titles(load(str(Path(__file__).parents[1] / "report" / "rig.toml"))) == {
        "q": ["rail.q [m]", "axle.q [rad]"],
        "v": ["rail.v [m/s]", "axle.v [rad/s]"],
        "event_time": [],
        "force_effort": ["line.force_effort [N]", "pull.force_effort [N]", "turn.force_effort [N m]"],
        "force_power": ["line.force_power [W]", "pull.force_power [W]", "turn.force_power [W]"],
    }
    planar = titles(load("two_link"))["v"]
    assert planar == [*(f"world-link1.v.{i} [{u}]" for i, u in enumerate(("m/s", "m/s", "rad/s"))),
                      "hinge.v [rad/s]"]  # fmt: skip
    found = titles(load("stage_separation"))
    assert {"interstage.q.0", "interstage.v.0"} < {*found["q"], *found["v"]}
    assert found["event_time"] == ["separation.event_time [s]"]


def test_the_trajectory_has_the_numbers_that_came_with_the_last_answer_of_a_step(tmp_path, monkeypatch):
    """Several answers a step: held against the messages, one by one."""
    changes = ["time.end=0.01", "bus.transport=inprocess", "coupling.scheme=implicit", "aero.model=vortex"]
    changes += ["aero.vortex.chordwise=2", "aero.vortex.spanwise=2"]
    log = open_log(run(load("flapper", changes), tmp_path / "run", report=False).log)
    last = {message.step: list(message.diagnostics) for _, _, message in log.decoded("/wrench/aero")}
    assert log.topics["/wrench/aero"] > log.topics["/state"] == len(last)
    monkeypatch.setattr(export, "BLOCK", 4)
    found = export.table(log, "trajectory")
    names = ("incidence_deg", "advance", "wake_rows")
    rows = zip(found["step"].tolist(), *(found[f"aero.{name}"].tolist() for name in names), strict=True)
    assert {step: numbers for step, *numbers in rows} == last
    answers = list(export.table(log, "wrench_aero"))
    assert answers.index("wake_rows") < answers.index("response.0")
    assert answers[-1] == f"response.{18 * 18 - 1}"  # of two wings and a tail


def test_where_no_answer_came_there_is_no_number():
    reported = export.Reported(["aero.a"], np.array([3, 3, 5], "u8"), np.array([[1.0], [2.0], [4.0]]))
    (column,) = reported.at(np.array([2, 3, 4, 5, 6], "u8"))
    np.testing.assert_array_equal(column, [np.nan, 2.0, np.nan, 4.0, np.nan])


@pytest.mark.parametrize("name", builtin_names())
def test_every_coordinate_of_every_built_in_scenario_has_a_name(name):
    mechanism = build(load(name))
    names = labels(mechanism)
    assert len(set(names["q"])) == len(mechanism.q0)
    assert len(set(names["v"])) == len(mechanism.v0)
