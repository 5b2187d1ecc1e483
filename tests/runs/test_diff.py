"""Differences of two logs: none where there is none, and where there is one its place, size and growth."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import LogError
from linkwind.log.reader import open_log
from linkwind.runs.diff import diff
from linkwind.runs.run import run
from linkwind.scenario import load
from tests.runs.edit import changed, rewrite

STEPS = 30


def fly(folder: Path, *settings: str, name: str = "two_link") -> Path:
    short = [f"time.end={STEPS / 1000}", "bus.transport=inprocess"]
    return run(load(name, [*short, *settings]), folder, lambda step: None, report=False).log


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly(tmp_path_factory.mktemp("run") / "out")


def test_transport_and_run_id_make_no_difference(log: Path, tmp_path: Path) -> None:
    found = diff(log, fly(tmp_path / "other", "bus.transport=zenoh"))
    assert (found.identical, found.fields, found.growth, found.remarks) == (True, (), None, ())
    assert found.points == STEPS + 1


def test_the_folder_of_a_run_stands_for_its_log(log: Path) -> None:
    for command in (["diff", str(log), str(log.parent)], ["verify", str(log.parent)]):
        result = CliRunner().invoke(app, command)
        assert (result.exit_code, "identical" in result.output) == (0, True)


@pytest.mark.parametrize(
    ("topic", "number", "field", "element", "body"),
    [
        ("/motion", 11, "trial.linear", 3, "link2"),
        ("/motion", STEPS + 2, "accepted.position", 0, "link1"),  # the final one
        ("/wrench/aero", 11, "added_inertia", 40, "link2"),
        ("/state", 11, "v", 3, "link2"),
        ("/state", 11, "kinetic_energy", None, None),
        ("/step", 11, "residual", None, None),
        ("/step", 11, "order", None, None),
    ],
)
def test_one_bit(
    log: Path, tmp_path: Path, topic: str, number: int, field: str, element: int | None, body: str | None
) -> None:
    def edit(of: str, at: int, payload: bytes) -> bytes:
        return changed(of, payload, field, element) if (of, at) == (topic, number) else payload

    found = diff(log, rewrite(log, tmp_path / "other.mcap", edit))
    assert not found.identical
    (only,) = found.fields
    first = only.first
    assert first == found.first
    assert (first.topic, first.step, first.field) == (topic, min(number - 1, STEPS), field)
    assert (first.element, first.body) == (element, body)
    assert only.messages == 1
    assert isinstance(first.recorded, float | int)
    assert isinstance(first.again, float | int)
    assert only.absolute == abs(first.again - first.recorded)
    assert first.ulp == (1 if isinstance(first.again, float) else None)


VACUUM = """
[time]
end = 0.4
[[bodies]]
name = "stone"
mass = 2.0
inertia = 0.1
velocity = [1.0, 0.0]
[aero]
model = "none"
"""


def test_growth_of_a_difference_in_velocity(tmp_path: Path) -> None:
    """Two stones thrown with velocities that differ by d are d t apart."""
    scenario, d = tmp_path / "stone.toml", 2.0**-20
    scenario.write_text(VACUUM)
    one = fly(tmp_path / "a", "time.end=0.4", name=str(scenario))
    other = fly(tmp_path / "b", "time.end=0.4", f"bodies.stone.velocity=[{1 + d!r}, 0.0]", name=str(scenario))
    found = diff(one, other)
    assert found.first is not None
    assert (found.first.topic, found.first.step, found.first.body) == ("/motion", 0, "stone")
    assert found.growth is not None
    position = found.growth.fields.index("motion.position")
    speed = found.growth.fields.index("motion.linear")
    times = [t for t, _ in found.growth.rows]
    assert times == pytest.approx(np.linspace(0.05, 0.4, 8))
    for t, values in found.growth.rows:
        assert values[position] == pytest.approx(d * t, rel=1e-9)
        assert values[speed] == pytest.approx(d, rel=1e-9)
    largest = next(f for f in found.fields if (f.topic, f.field) == ("/state", "motion.position"))
    assert (largest.absolute, largest.t) == (pytest.approx(0.4 * d), 0.4)
    assert any("scenario: bodies.0.velocity.0: 1.0 | 1.00000095" in remark for remark in found.remarks)
    assert found.curves is not None
    np.testing.assert_allclose(found.curves.distance["motion.position"], d * found.curves.t, atol=1e-14)
    page = tmp_path / "growth.html"
    assert CliRunner().invoke(app, ["diff", str(one), str(other), "--plot", str(page)]).exit_code == 5
    text = page.read_text()
    assert "velocity [m\\u002fs]" in text
    assert repr(float(found.curves.distance["motion.position"][-1])) in text
    # What counts as none is relative to the largest value: here the final velocity and position.
    assert diff(one, other, rtol=1e-5).identical
    assert not diff(one, other, rtol=1e-8).identical


def test_other_step_size_is_compared_at_common_times(log: Path, tmp_path: Path) -> None:
    found = diff(log, fly(tmp_path / "out", "coupling.step=0.0015"))
    assert found.points == STEPS // 3 + 1
    assert any("step sizes differ" in remark for remark in found.remarks)
    assert {f.topic for f in found.fields} == {"/state"}
    assert "step" not in {f.field for f in found.fields}
    assert found.first is not None
    assert found.first.time_ns == 0 or found.first.time_ns % 3_000_000 == 0
    assert diff(log, fly(tmp_path / "b", "coupling.step=0.0015"), rtol=1e-3).identical


def test_a_longer_run_is_not_the_same(log: Path, tmp_path: Path) -> None:
    longer = fly(tmp_path / "out", "time.end=0.04")
    for pair, there in (((log, longer), ("none", "one")), ((longer, log), ("one", "none"))):
        found = diff(*pair)
        assert any("scenario: time.end" in remark for remark in found.remarks)
        assert not found.identical
        assert found.first is not None
        # The last motion of the shorter run is its end, that of the longer one goes on.
        assert (found.first.topic, found.first.field) == ("/state", "message")
        assert (found.first.step, found.first.time_ns) == (STEPS + 1, (STEPS + 1) * 1_000_000)
        assert (found.first.recorded, found.first.again) == there


def test_a_cut_log_is_compared_as_far_as_it_goes(tmp_path: Path) -> None:
    whole, cut = fly(tmp_path / "out", "time.end=0.4"), tmp_path / "cut.mcap"
    data = whole.read_bytes()
    cut.write_bytes(data[: int(0.7 * len(data))])
    found = diff(whole, cut)
    assert found.identical
    assert found.points == open_log(cut).topics["/state"] < 401
    assert any("cut.mcap is not complete" in remark for remark in found.remarks)


def test_other_bodies_are_refused(log: Path, tmp_path: Path) -> None:
    scenario = tmp_path / "stone.toml"
    scenario.write_text(VACUUM)
    with pytest.raises(LogError, match=r"expected the bodies of .*link1, link2; got stone"):
        diff(log, fly(tmp_path / "out", name=str(scenario)))


def test_a_number_that_is_none_is_a_difference(log: Path, tmp_path: Path) -> None:
    from linkwind.schema import MESSAGES

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        if (topic, number) != ("/state", 11):
            return payload
        message = MESSAGES["State"].FromString(payload)
        message.v[0] = math.nan
        return bytes(message.SerializeToString())

    other = rewrite(log, tmp_path / "other.mcap", edit)
    for rtol in (0.0, 0.1):
        found = diff(log, other, rtol=rtol)
        assert found.first is not None
        assert (found.first.step, found.first.field, found.first.ulp) == (10, "v", None)
        assert found.fields[0].absolute == math.inf
    assert diff(other, other).identical
    done = CliRunner().invoke(app, ["diff", str(log), str(other), "--json"])
    assert json.loads(done.stdout, parse_constant=pytest.fail)["first_difference"]["again"] == "nan"


def test_what_one_run_exchanges_and_the_other_does_not(log: Path, tmp_path: Path) -> None:
    """Vacuum has no added inertia: numbers that only one side has are a difference, not left out."""
    found = diff(log, fly(tmp_path / "out", "aero.model=none"))
    sizes = [f.first for f in found.fields if f.field == "added_inertia"]
    assert [(first.topic, first.step) for first in sizes] == [("/wrench/aero", 0)]
    assert (sizes[0].recorded, sizes[0].again) == ("72 values", "0 values")
    assert not diff(log, fly(tmp_path / "b", "coupling.order=2")).identical
    json.dumps(found.as_json(), allow_nan=False)


def test_command(log: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(app, ["diff", str(log), str(log), "--json"])
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert summary == {"identical": True, "first_difference": None, "max_difference": None}
    other = fly(tmp_path / "out", "bodies.link1.mass=2.1")
    done = runner.invoke(app, ["diff", str(log), str(other), "--json"])
    assert done.exit_code == 5
    summary = json.loads(done.stdout)
    assert set(summary) == {"identical", "first_difference", "max_difference"}
    assert summary["max_difference"]["/state motion.position"]["body"] in ("link1", "link2")
    done = runner.invoke(app, ["diff", str(log), str(other)])
    assert done.exit_code == 5
    assert "scenario: bodies.0.mass: 2.0 | 2.1" in done.stdout
    assert "/state motion.position" in done.stdout
