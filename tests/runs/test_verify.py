"""Verification: the same bits are found the same, and a single other bit is found and named."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import FaultError, InputError, LogError
from linkwind.log import contents
from linkwind.log.difference import ulp
from linkwind.log.reader import open_log
from linkwind.log.recover import recover
from linkwind.runs.run import run
from linkwind.runs.verify import Verified, scenario_of, verify
from linkwind.scenario import builtin_names, load
from tests.coarse import COARSE
from tests.runs.edit import changed, rewrite

STEPS = 30


def fly(name: str, folder: Path, *settings: str) -> Path:
    end_ns = STEPS * load(name).coupling.step_ns
    changes = [f"time.end={end_ns / 1e9!r}", *COARSE.get(name, ()), *settings]
    return run(load(name, changes), folder, lambda step: None, report=False).log


def check(log: Path, **options: bool) -> Verified:
    return verify(*scenario_of(log), **options)


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return fly("two_link", tmp_path_factory.mktemp("run") / "out", "bus.transport=inprocess")


@pytest.mark.parametrize("transport", ["zenoh", "inprocess"])
@pytest.mark.parametrize("name", builtin_names())
def test_every_built_in_scenario_gives_the_same_bits_again(name: str, transport: str, tmp_path: Path) -> None:
    path = fly(name, tmp_path / "out", f"bus.transport={transport}")
    topics = open_log(path).topics
    compared = ("/motion", "/wrench/aero", "/state", "/step", "/flow/aero", "/wake/aero", "/volume/aero")
    of_run = sum(n for topic, n in topics.items() if topic in compared)
    found = check(path)
    assert (found.difference, found.remark, found.changed) == (None, "", {})
    assert (found.steps, found.messages) == (STEPS, of_run)
    found = check(path, from_recorded_wrenches=True)
    assert (found.difference, found.remark) == (None, "")
    shown = sum(topics.get(f"/{kind}/aero", 0) for kind in ("flow", "wake", "volume"))
    assert (found.steps, found.messages) == (STEPS, of_run - topics["/wrench/aero"] - shown)


BODIES = ("link1", "link2")
MOTION = {"position": 3, "orientation": 4, "linear": 3, "angular": 3}
SCALARS = {"run": None, "step": None, "iteration": None, "time_ns": None}
FIELDS = {
    "/motion": SCALARS
    | {"final": None}
    | {f"{state}.{name}": width for state in ("accepted", "trial") for name, width in MOTION.items()},
    "/wrench/aero": SCALARS | {"provider": None, "kind": None, "force": 3, "torque": 3, "added_inertia": 36},
    "/state": {"step": None, "time_ns": None, "q": 0, "v": 0}
    | {f"motion.{name}": width for name, width in MOTION.items()}
    | dict.fromkeys(("acceleration", "reaction", "wrench"), 6)
    | dict.fromkeys(("kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap")),
    "/step": {"step": None, "time_ns": None, "iteration": None, "order": None, "extrapolation_error": 1}
    | dict.fromkeys(("residual", "interface_energy")),
}
# q of two_link: planar root (x, y, θ), then the hinge; v alike.
PLACES = [
    (topic, field, 0 if width == 0 else width) for topic in FIELDS for field, width in FIELDS[topic].items()
]


@pytest.mark.parametrize(("topic", "field", "width"), PLACES)
def test_one_bit_of_any_field_is_found_and_named(
    log: Path, tmp_path: Path, topic: str, field: str, width: int | None
) -> None:
    index = None if width is None else 3 if width == 0 else width  # of link2: the first number of it
    number = 11  # of the topic's messages: step 10

    def edit(of: str, at: int, payload: bytes) -> bytes:
        return changed(of, payload, field, index) if (of, at) == (topic, number) else payload

    other = rewrite(log, tmp_path / "other.mcap", edit)
    was = list(open_log(log).raw(topic))[number - 1].payload
    found = check(other)
    assert not found.identical
    difference = found.difference
    assert difference is not None
    assert (difference.topic, difference.step, difference.iteration) == (topic, number - 1, 0)
    assert (difference.field, difference.element) == (field, index)
    owned = index is not None and field != "extrapolation_error"
    assert difference.body == ("link2" if owned else None)
    if isinstance(difference.again, float):
        assert difference.ulp == (1 if math.isfinite(difference.again) else None)
    else:
        assert difference.ulp is None
    if index is not None:
        assert difference.again != difference.recorded or math.isnan(float(str(difference.again)))
    # What the new run made is what had been recorded at first.
    assert changed(topic, was, field, index) != was
    json.dumps(difference.as_json(), allow_nan=False)


def test_fields_above_are_all_fields(log: Path) -> None:
    for topic, fields in FIELDS.items():
        columns = set(open_log(log).columns(topic)) - {
            "response",
            "diagnostics",
            "closure_reaction",
            "event_time",
            "force_effort",
            "force_power",
        }
        assert columns <= set(fields)
        assert set(fields) - columns <= {"run", "provider", "kind"}


def test_a_missing_message_is_found(log: Path, tmp_path: Path) -> None:
    short = rewrite(log, tmp_path / "a.mcap", lambda t, n, p: None if (t, n) == ("/step", STEPS + 1) else p)
    difference = check(short).difference
    assert difference is not None
    assert (difference.topic, difference.step, difference.field) == ("/step", STEPS, "message")


def test_a_run_that_ends_earlier_is_found(log: Path) -> None:
    opened, scenario = scenario_of(log)
    shorter = scenario.model_copy(update={"time": scenario.time.model_copy(update={"end": 0.02})})
    difference = verify(opened, shorter).difference
    assert difference is not None
    assert (difference.topic, difference.field) == ("/motion", "step")  # the last motion comes a step before
    assert (difference.recorded, difference.again) == (21, 20)


def test_a_run_that_fails_where_it_did_not_is_found(tmp_path: Path) -> None:
    settings = ["bus.transport=inprocess", "time.end=0.02"]
    path = fly("two_link_field", tmp_path / "out", *settings, "aero.field.link1.fx='1-x'")
    fails = load("two_link_field", [*settings, "aero.field.link1.fx='1-x+0/(t-0.01)**2'"])
    found = verify(open_log(path), fails)
    assert found.difference is not None
    assert (found.difference.topic, found.difference.step) == ("/wrench/aero", 10)
    assert (found.difference.field, found.difference.recorded) == ("message", "one")
    assert '"aero" stopped at step 10' in str(found.difference.again)
    assert found.steps == 9


def test_another_final_hash_is_found(log: Path, tmp_path: Path) -> None:
    ending = {contents.END: {"final_state_sha256": "ab" * 32}}
    difference = check(rewrite(log, tmp_path / "a.mcap", metadata=ending)).difference
    assert difference is not None
    assert (difference.field, difference.step) == ("final_state_sha256", STEPS)


def test_what_changed_since_the_log_was_made_is_told(log: Path, tmp_path: Path) -> None:
    metadata = {
        contents.VERSIONS: {"numpy": "0.9", "cpu": "Z80"},
        contents.RUN: {"library_sha256": "00" * 32, "tables_sha256": "11" * 32},
    }
    other = rewrite(log, tmp_path / "a.mcap", metadata=metadata)
    found = check(other)
    assert found.identical
    assert {name: then for name, (then, _) in found.changed.items()} == {
        "numpy": "0.9", "cpu": "Z80", "library_sha256": "00" * 32, "tables_sha256": "11" * 32,
    }  # fmt: skip


def test_recorded_wrenches_drive_the_dynamics(log: Path, tmp_path: Path) -> None:
    """One other bit in a force shows in the motion that follows from it, not in the wrench."""

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, "force", 0) if (topic, number) == ("/wrench/aero", 11) else payload

    other = rewrite(log, tmp_path / "a.mcap", edit)
    difference = check(other, from_recorded_wrenches=True).difference
    assert difference is not None
    assert difference.topic == "/state"
    assert (difference.step, difference.body) == (10, "link1")
    without = rewrite(log, tmp_path / "b.mcap", lambda t, n, p: None if t == "/wrench/aero" else p)
    with pytest.raises(LogError, match="/wrench/aero: expected at least one wrench; got none"):
        check(without, from_recorded_wrenches=True)


def test_a_wrench_of_another_step_is_found(log: Path, tmp_path: Path) -> None:
    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, "step", None) if (topic, number) == ("/wrench/aero", 11) else payload

    difference = check(rewrite(log, tmp_path / "a.mcap", edit), from_recorded_wrenches=True).difference
    assert difference is not None
    assert (difference.topic, difference.step, difference.field) == ("/wrench/aero", 10, "step")


@pytest.mark.parametrize("transport", ["zenoh", "inprocess"])
def test_a_run_that_failed_fails_again_at_the_same_place(transport: str, tmp_path: Path) -> None:
    settings = ["aero.field.link1.fx='1/(t-0.02)**2'", f"bus.transport={transport}", "time.end=0.04"]
    with pytest.raises(FaultError):
        run(load("two_link_field", settings), tmp_path / "out", lambda step: None, report=False)
    found = check(tmp_path / "out" / "log.mcap")
    assert found.identical
    assert found.steps == 19
    assert "the log is not complete: FaultError" in found.remark


TWO_PROVIDERS = """
[time]
end = 0.02
[[bodies]]
name = "a"
mass = 1.0
inertia = 0.1
[[bodies]]
name = "b"
mass = 2.0
inertia = 0.2
[[providers]]
name = "left"
model = "field"
bodies = ["b"]
[providers.field.b]
fx = "-y"
fy = "x"
[[providers]]
name = "right"
model = "field"
bodies = ["a", "b"]
[providers.field.a]
fx = "-vx"
fy = "sin(t)"
"""


@pytest.mark.parametrize("transport", ["zenoh", "inprocess"])
def test_several_providers(transport: str, tmp_path: Path) -> None:
    scenario = tmp_path / "two.toml"
    scenario.write_text(TWO_PROVIDERS)
    path = run(
        load(scenario, [f"bus.transport={transport}"]), tmp_path / "out", lambda step: None, report=False
    ).log
    for recorded in (False, True):
        found = check(path, from_recorded_wrenches=recorded)
        assert (found.difference, found.steps) == (None, 20)

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, "torque", 2) if (topic, number) == ("/wrench/left", 6) else payload

    difference = check(rewrite(path, tmp_path / "other.mcap", edit)).difference
    assert difference is not None
    assert (difference.topic, difference.step, difference.body) == ("/wrench/left", 5, "b")


def test_cut_anywhere_is_verified_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    long = fly("two_link", tmp_path / "out", "bus.transport=inprocess", "time.end=0.4")
    data = long.read_bytes()
    cut = tmp_path / "cut.mcap"
    for share in (0.4, 0.8, 0.97):
        cut.write_bytes(data[: int(share * len(data))])
        states = open_log(cut).topics["/state"]
        for recorded in (False, True):
            found = check(cut, from_recorded_wrenches=recorded)
            assert found.identical
            assert found.steps == states - 1
            assert "the log is not complete" in found.remark
    cut.write_bytes(log.read_bytes()[:6000])
    with pytest.raises(LogError, match=r"expected messages to compare; got none|expected the scenario"):
        check(cut)


def test_behind_a_hole_the_comparison_goes_on(tmp_path: Path) -> None:
    path = fly("two_link", tmp_path / "out", "bus.transport=inprocess", "time.end=0.4")

    def later(topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, "v", 0) if (topic, number) == ("/state", 391) else payload

    other = rewrite(path, tmp_path / "other.mcap", later)
    for source, step in ((path, None), (other, 390)):
        data = bytearray(source.read_bytes())
        data[len(data) // 2] ^= 1
        hole = tmp_path / "hole.mcap"
        hole.write_bytes(data)
        opened = open_log(hole)
        assert opened.damage is not None
        assert not opened.damage.cut
        driven = check(hole, from_recorded_wrenches=True)  # without the wrenches it cannot go on
        assert driven.identical
        assert 0 < driven.steps < 300
        assert "the wrench of aero at step" in driven.remark
        found = check(hole)
        assert "damaged" in found.remark
        clean = check(recover(hole, tmp_path / f"clean-{step}.mcap").file)
        assert (clean.difference, clean.steps, clean.messages) == (
            found.difference, found.steps, found.messages,
        )  # fmt: skip
        if step is None:
            assert (found.difference, found.steps) == (None, 400)
        else:
            assert found.difference is not None
            assert (found.difference.step, found.difference.field) == (step, "v")


def test_command(log: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(app, ["verify", str(log), "--json"])
    assert done.exit_code == 0
    assert json.loads(done.stdout) == {"identical": True, "steps": STEPS, "first_difference": None}
    flip = lambda t, n, p: changed(t, p, "trial.linear", 4) if (t, n) == ("/motion", 6) else p  # noqa: E731
    other = rewrite(log, tmp_path / "other.mcap", flip, {contents.VERSIONS: {"numpy": "0.9"}})
    done = runner.invoke(app, ["verify", str(other), "--json"])
    assert done.exit_code == 5
    summary = json.loads(done.stdout)
    assert set(summary) == {"identical", "steps", "first_difference"}
    first = summary["first_difference"]
    assert (first["topic"], first["step"], first["body"], first["ulp"]) == ("/motion", 5, "link2", 1)
    assert first["changed"]["numpy"][0] == "0.9"
    done = runner.invoke(app, ["verify", str(other)])
    assert done.exit_code == 5
    assert "/motion: trial.linear[4] of link2" in done.stdout
    assert "1 ULP" in done.stdout
    assert "--from-recorded-wrenches" not in done.stdout
    flip = lambda t, n, p: changed(t, p, "force", 0) if (t, n) == ("/wrench/aero", 6) else p  # noqa: E731
    foreign = rewrite(log, tmp_path / "foreign.mcap", flip)
    done = runner.invoke(app, ["verify", str(foreign)])
    assert done.exit_code == 5
    assert "if that provider was one of yours, take its forces as recorded" in done.stdout


def test_a_run_with_a_force_fmu_needs_its_file(tmp_path: Path) -> None:
    from linkwind.fmi.export import export

    runner, fmu, another = CliRunner(), tmp_path / "plate.fmu", tmp_path / "another.fmu"
    export(load("two_link"), fmu, fmi="3", platforms=["host"], part="aero")
    export(load("two_link_gust"), another, fmi="3", platforms=["host"], part="aero")
    options = [
        "--set=time.end=0.02",
        "--set=bus.transport=inprocess",
        "--out",
        str(tmp_path / "out"),
        "--json",
    ]
    done = runner.invoke(app, ["run", "two_link", "--force-fmu", str(fmu), *options])
    assert done.exit_code == 0
    path = str(tmp_path / "out" / "log.mcap")
    done = runner.invoke(app, ["verify", path, "--force-fmu", str(fmu), "--json"])
    assert json.loads(done.stdout) == {"identical": True, "steps": 20, "first_difference": None}
    done = runner.invoke(app, ["verify", path])
    assert isinstance(done.exception, InputError)
    assert "expected the file of its FMU" in str(done.exception)
    done = runner.invoke(app, ["verify", path, "--force-fmu", str(another)])
    assert isinstance(done.exception, InputError)
    assert "expected the FMU with SHA-256" in str(done.exception)
    done = runner.invoke(app, ["verify", path, "--from-recorded-wrenches", "--json"])
    assert json.loads(done.stdout)["identical"] is True


@pytest.mark.parametrize(
    ("one", "other", "distance"),
    [
        (1.0, math.nextafter(1.0, 2.0), 1),
        (1.0, 1.0, 0),
        (0.0, 5e-324, 1),
        (-0.0, 0.0, 1),
        (-5e-324, 5e-324, 3),
        (1.0, 2.0, 2**52),
        (-1.0, -2.0, 2**52),
        (math.inf, 1.0, None),
        (math.nan, math.nan, None),
    ],
)
def test_units_in_the_last_place(one: float, other: float, distance: int | None) -> None:
    assert ulp(one, other) == ulp(other, one) == distance
