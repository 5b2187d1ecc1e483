"""From a log on disk to the page, through the public function."""

import json
import struct

import numpy as np
import pytest

from linkwind.errors import LogError
from linkwind.log.state import StateMessage, StepEncoder, TimingEncoder
from linkwind.log.writer import LogWriter
from linkwind.report import page as page_module
from linkwind.report import write_report
from linkwind.report.data import read
from linkwind.report.panels import panels
from linkwind.runs.run import run as run_scenario
from linkwind.scenario import loads

from .synthetic import planar
from .test_page import unpack


@pytest.fixture
def run():
    return planar(40)


def write_log(path, run, *, states, end):
    """Write the first states of a run; ``end`` closes the log."""
    track = run.trajectory
    scalars = ["kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap"]
    state, step, timing = StateMessage(2, 4, 4), StepEncoder(3), TimingEncoder()
    log = LogWriter(
        path,
        run="r1",
        scenario_json=json.dumps(run.scenario),
        body_names=run.bodies,
        provider_bodies={"aero": run.bodies},
        metadata={},
    )
    for k in range(states):
        ns = k * 1_000_000
        for name in ("position", "orientation", "linear", "angular"):
            getattr(state.motion, name)[...] = getattr(track, name)[k]
        for name in ("q", "v", "acceleration", "reaction", "wrench"):
            state.fields[name][...] = getattr(track, name)[k].ravel()
        log.state(state.encode(k, ns, **{name: getattr(track, name)[k] for name in scalars}), ns)
        coupling = {
            "iteration": 0,
            "order": int(run.order[k]),
            "extrapolation_error": run.extrapolation_error[k],
            "interface_energy": run.interface_energy[k],
            "residual": 0.0,
        }
        log.step(step.encode(k, ns, **coupling), ns)
        log.timing(timing.encode(k, round(run.exchange[k] * 1e9)), ns)
    log.flush()
    if end is not None:
        log.close(**end)
    return log


def test_a_log_is_read_as_it_was_written(run, tmp_path):
    path = tmp_path / "log.mcap"
    write_log(path, run, states=41, end={"final_state_sha256": run.final_state_sha256})
    found = read(path)
    assert found.complete
    assert found.error is None
    assert found.steps == 40
    for name, values in run.trajectory._asdict().items():
        np.testing.assert_allclose(getattr(found.trajectory, name), values, rtol=1e-15, err_msg=name)
    assert np.array_equal(found.order, run.order)
    assert np.array_equal(found.extrapolation_error, run.extrapolation_error)
    assert np.array_equal(found.interface_energy, run.interface_energy)
    np.testing.assert_allclose(found.exchange, run.exchange, atol=1e-9)
    assert found.final_state_sha256 == run.final_state_sha256


def test_the_report_of_a_run_that_failed(run, tmp_path, monkeypatch):
    monkeypatch.setattr(page_module, "get_plotlyjs", str)
    path, out = tmp_path / "log.mcap", tmp_path / "report.html"
    write_log(path, run, states=7, end={"error": LogError("something <else>")})
    write_report(path, out)
    text = out.read_text(encoding="utf-8")
    assert "6 of 1200 steps, to t = 0.006 s" in text
    assert "LogError: something &lt;else&gt;" in text


def test_the_report_of_a_run_that_never_started(run, tmp_path, monkeypatch):
    monkeypatch.setattr(page_module, "get_plotlyjs", str)
    path, out = tmp_path / "log.mcap", tmp_path / "report.html"
    write_log(path, run, states=0, end={"error": LogError("aero never came")})
    write_report(path, out)
    text = out.read_text(encoding="utf-8")
    assert "aero never came" in text
    assert '{"scene":null}' in text


def test_the_report_of_a_log_that_was_cut(run, tmp_path, monkeypatch):
    monkeypatch.setattr(page_module, "get_plotlyjs", str)
    path, out = tmp_path / "log.mcap", tmp_path / "report.html"
    whole = write_log(path, run, states=41, end=None)  # still being written, or the writer was killed
    write_report(path, out)
    whole.close()
    text = out.read_text(encoding="utf-8")
    assert "Not the whole run: 40 of 1200 steps" in text
    assert "The log is damaged" in text


def test_not_a_log(tmp_path):
    path = tmp_path / "log.mcap"
    path.write_bytes(struct.pack("<d", 1.0))
    with pytest.raises(LogError, match=r"log\.mcap"):
        write_report(path, tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_angles_and_distances_of_joints_are_plotted_by_name(tmp_path):
    """A slide on a hinge: what is drawn is what the joints are at, in degrees and metres."""
    text = """
[time]
end = 0.2
[[bodies]]
name = "arm"
mass = 1.0
inertia = 0.1
[[bodies]]
name = "sledge"
mass = 0.5
inertia = 0.05
[[joints]]
name = "hinge"
type = "revolute"
parent = "world"
child = "arm"
child_point = [-0.5, 0.0]
[[joints]]
name = "slide"
type = "prismatic"
parent = "arm"
child = "sledge"
axis = [1.0, 0.0, 0.0]
[aero]
model = "none"
[bus]
transport = "inprocess"
"""
    outcome = run_scenario(loads(text, "slide.toml"), tmp_path / "out")
    found = read(outcome.log)
    assert [each.joint for each in found.coordinates] == ["hinge", "slide"]
    (panel,) = [panel for panel in panels(found) if panel["title"] == "Joint coordinates"]
    drawn = {row["label"]: (row["curves"][0]["name"], unpack(row["curves"][0]["y"])) for row in panel["rows"]}
    path = found.trajectory
    arm = 2.0 * np.arctan2(path.orientation[:, 0, 3], path.orientation[:, 0, 0])
    along = np.stack([np.cos(arm), np.sin(arm)], axis=-1)
    offset = ((path.position[:, 1, :2] - path.position[:, 0, :2]) * along).sum(axis=1)
    assert drawn["angle [°]"][0] == "hinge"
    np.testing.assert_allclose(drawn["angle [°]"][1], np.degrees(arm), rtol=1e-6)
    assert drawn["distance [m]"][0] == "slide"
    np.testing.assert_allclose(drawn["distance [m]"][1], offset, atol=1e-6)
    np.testing.assert_allclose(drawn["rate [°/s]"][1], np.degrees(path.angular[:, 0, 2]), rtol=1e-6)
    assert np.abs(np.diff(offset)).max() > 0.0
