"""One side recorded, the other live: what was recorded comes out again, and what is changed as it must."""

from __future__ import annotations

import json
import threading
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from linkwind.aero.service import serve, session
from linkwind.bus.zenoh import ZenohProviderLink, loopback_endpoint
from linkwind.cli import app
from linkwind.errors import FaultError, InputError
from linkwind.log.reader import Log, open_log
from linkwind.runs.forces import force_differences, same_answers
from linkwind.runs.keeping import Kept
from linkwind.runs.live_dynamics import answer_dynamics, live_dynamics
from linkwind.runs.live_provider import Answered, live_provider
from linkwind.runs.resume import plan
from linkwind.runs.run import Ends, dynamics, run
from linkwind.runs.substitution import changed
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.runs.edit import changed as flipped
from tests.runs.edit import rewrite

STEPS = 40
INPROCESS = "bus.transport=inprocess"


def fly(name: str | Path, folder: Path, *settings: str) -> Log:
    short = [f"time.end={STEPS * load(name).coupling.step_ns / 1e9!r}", INPROCESS]
    return open_log(run(load(name, [*short, *settings]), folder, lambda step: None).log)


def ask(log: Log, folder: Path, *settings: str, live: str = "aero", **ends: list[str]) -> Kept[Answered]:
    scenario, changes = changed(log, settings)
    return live_provider(log, live, scenario, changes, folder, lambda step: None, **ends)


def move(log: Log, folder: Path, *settings: str) -> Log:
    return open_log(live_dynamics(log, settings, folder, lambda step: None).log)


def state(log: Log, field: str) -> np.ndarray:
    return log.columns("/state")[field]


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return fly("two_link", tmp_path_factory.mktemp("run") / "out")


TWO_PROVIDERS = """
[time]
end = 0.04
[[bodies]]
name = "a"
mass = 1.0
inertia = 0.1
[[bodies]]
name = "b"
mass = 2.0
inertia = 0.2
shape = { type = "plate", length = 0.5, span = 1.0 }
[[providers]]
name = "left"
model = "plate"
bodies = ["b"]
[[providers]]
name = "right"
model = "field"
bodies = ["a", "b"]
[providers.field.a]
fx = "-vx"
fy = "sin(t)"
"""


# ---- a live provider against recorded motion ----


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("two_link", ()),
        ("two_link_gust", ("coupling.scheme=implicit",)),
        ("two_link_flow", ("aero.flow.cells=16", "aero.flow.frames=1", "log.checkpoint_every=15")),
    ],
)
def test_the_same_provider_answers_the_same(name: str, settings: tuple[str, ...], tmp_path: Path) -> None:
    recorded = fly(name, tmp_path / "out", *settings)
    kept = ask(recorded, tmp_path / "again")
    new = open_log(kept.log)
    wanted = [
        topic for topic in recorded.topics if topic.startswith(("/motion", "/wrench", "/flow", "/step"))
    ]
    wanted += [topic for topic in recorded.topics if topic.startswith("/checkpoint")]
    assert len(wanted) == (5 if name == "two_link_flow" else 3)
    assert list(new.raw(*wanted)) == list(recorded.raw(*wanted))
    assert (new.complete, new.final_state_sha256) == (True, recorded.final_state_sha256)
    assert kept.result.exchanges == recorded.topics["/motion"] - 1
    assert verify(*scenario_of(kept.log)).identical
    # The dynamics put its total wrench together otherwise; behind the start they agree to what the coupling
    # leaves between the twist that was asked about and the accepted one.
    one, other = (state(each, "wrench")[5:] for each in (recorded, new))
    assert np.abs(one - other).max() < (2e-2 if name == "two_link_flow" else 1e-7) * np.abs(one).max()
    for field in ("motion.position", "q", "acceleration", "reaction", "kinetic_energy"):
        assert np.array_equal(state(recorded, field), state(new, field))


def test_forces_are_proportional_to_density(log: Log, tmp_path: Path) -> None:
    """All of a plate's wrench is, the part of the acceleration included."""
    kept = ask(log, tmp_path / "out", "environment.density=2.45")
    new = open_log(kept.log)
    same = open_log(ask(log, tmp_path / "same").log)
    np.testing.assert_allclose(state(new, "wrench"), 2.0 * state(same, "wrench"), rtol=1e-12, atol=1e-12)
    assert same_answers(log, new, "aero") == (0, STEPS + 1)
    for each in force_differences(same, new, ["link1", "link2"]):
        assert each.live == pytest.approx(2.0 * each.recorded)
        assert each.difference == pytest.approx(each.recorded)
    assert verify(*scenario_of(kept.log)).identical


def test_one_of_two_providers_is_live(tmp_path: Path) -> None:
    (tmp_path / "two.toml").write_text(TWO_PROVIDERS)
    recorded = fly(tmp_path / "two.toml", tmp_path / "out")
    kept = ask(recorded, tmp_path / "live", "providers.right.field.a.fx='1-vx'", live="right")
    new = open_log(kept.log)
    assert list(new.raw("/wrench/left")) == list(recorded.raw("/wrench/left"))
    # One newton more on body a, nothing more on b.
    off = (state(new, "wrench") - state(recorded, "wrench")).reshape(-1, 2, 6)
    assert np.abs(off[5:, 0] - [1, 0, 0, 0, 0, 0]).max() < 1e-6
    assert np.abs(off[5:, 1]).max() < 1e-6
    assert verify(*scenario_of(kept.log)).identical


def test_a_provider_from_elsewhere(log: Log, tmp_path: Path) -> None:
    endpoint = loopback_endpoint()

    def provider() -> None:
        link = ZenohProviderLink([endpoint], [], name="aero")
        try:
            serve(link, session("aero"), 30.0)
        finally:
            link.close()

    thread = threading.Thread(target=provider)
    thread.start()
    kept = ask(log, tmp_path / "out", listen=[endpoint])
    thread.join(10.0)
    assert not thread.is_alive()
    assert same_answers(log, open_log(kept.log), "aero") == (STEPS + 1, STEPS + 1)


def test_another_wrench_in_the_new_log_is_found(log: Log, tmp_path: Path) -> None:
    kept = ask(log, tmp_path / "out")

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return flipped(topic, payload, "force", 3) if (topic, number) == ("/wrench/aero", 11) else payload

    found = verify(*scenario_of(rewrite(kept.log, tmp_path / "other.mcap", edit))).difference
    assert found is not None
    assert (found.topic, found.step, found.body, found.ulp) == ("/wrench/aero", 10, "link2", 1)
    with pytest.raises(InputError, match="whose motion follows from its wrenches"):
        verify(*scenario_of(kept.log), from_recorded_wrenches=True)
    with pytest.raises(InputError, match="expected a run with both sides live"):
        plan(open_log(kept.log), 10)


def test_a_cut_record_and_a_shorter_run(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "out", "time.end=0.4")
    shorter = ask(whole, tmp_path / "shorter", "time.end=0.3")
    assert (shorter.result.steps, shorter.result.missing) == (300, "")
    assert open_log(shorter.log).complete
    assert verify(*scenario_of(shorter.log)).steps == 300
    cut = tmp_path / "cut.mcap"
    data = whole.path.read_bytes()
    cut.write_bytes(data[: int(0.7 * len(data))])
    motions = open_log(cut).topics["/motion"]
    kept = ask(open_log(cut), tmp_path / "again")
    assert kept.result.exchanges == motions
    assert f"the record ends at step {motions - 1} of 400: byte" in kept.result.missing
    new = open_log(kept.log)
    assert (new.complete, new.error) == (False, f"LogError: {cut}: {kept.result.missing}")
    found = verify(*scenario_of(kept.log))
    assert (found.difference, found.steps) == (None, new.steps)


# ---- live dynamics under recorded forces ----


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("two_link", ()),
        ("two_link_gust", ("coupling.scheme=implicit",)),
        ("two_link_flow", ("aero.flow.cells=16", "aero.flow.frames=0")),
    ],
)
def test_the_same_dynamics_move_the_same(name: str, settings: tuple[str, ...], tmp_path: Path) -> None:
    recorded = fly(name, tmp_path / "out", *settings)
    new = move(recorded, tmp_path / "again")
    topics = ("/motion", "/wrench/aero", "/state", "/step")
    assert list(new.raw(*topics)) == list(recorded.raw(*topics))
    assert verify(*scenario_of(new.path)).identical


CONSTANT = """
[time]
end = 0.04
[environment]
gravity = [0.0, 0.0, 0.0]
[[bodies]]
name = "stone"
mass = 1.0
inertia = 0.1
[aero]
model = "field"
[aero.field.stone]
fx = "3"
"""


def test_twice_the_mass_half_the_way(tmp_path: Path) -> None:
    """Under a recorded constant force F: x = F t²/2m; a force of another model has no say."""
    (tmp_path / "stone.toml").write_text(CONSTANT)
    recorded = fly(tmp_path / "stone.toml", tmp_path / "out")
    settings = ["bodies.stone.mass=2.0", "aero.field.stone.fx='7'", "dynamics.integrator=dopri5"]
    new = move(recorded, tmp_path / "again", *settings)
    t = state(new, "time_ns")[:, 0] / 1e9
    np.testing.assert_allclose(state(new, "motion.position")[:, 0], 0.5 * (3.0 / 2.0) * t**2, atol=1e-15)
    assert (
        "live dynamics under the forces recorded in"
        in (new.path.with_name("report.html")).read_text().lower()
    )
    found = verify(*scenario_of(new.path))
    assert (found.difference, found.steps) == (None, STEPS)


def test_dynamics_elsewhere(log: Log, tmp_path: Path) -> None:
    endpoint = loopback_endpoint()
    answered: list[int] = []
    thread = threading.Thread(target=lambda: answered.append(answer_dynamics(log, [], [endpoint])))
    thread.start()
    scenario = load("two_link", [f"time.end={STEPS / 1000}"])
    done = dynamics(scenario, tmp_path / "out", lambda step: None, Ends([endpoint], []), run_id="there")
    thread.join(10.0)
    assert answered == [STEPS]
    assert done.result.final_state_sha256 == log.final_state_sha256


def test_where_the_record_ends_the_run_ends(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "out", "time.end=0.4")
    data = bytearray(whole.path.read_bytes())
    data[len(data) // 2] ^= 1
    hole = tmp_path / "hole.mcap"
    hole.write_bytes(data)
    with pytest.raises(FaultError, match="expected a recorded answer; got none") as caught:
        move(open_log(hole), tmp_path / "again", "environment.gravity=[0, -1.6, 0]")
    assert "report.html" in str(caught.value)
    assert 0 < open_log(tmp_path / "again" / "log.mcap").steps < 300


# ---- what does not fit ----


@pytest.mark.parametrize(
    ("setting", "text"),
    [
        ("coupling.step=0.0005", "coupling.step: expected 1000000 ns, as recorded; got 500000 ns"),
        ("time.end=0.05", "time.end: expected an end at step 40, .*; got step 50"),
        ("bodies.0.name=wing", "bodies: expected link1, link2, as recorded; got wing, link2"),
    ],
)
def test_what_was_recorded_must_fit(log: Log, setting: str, text: str, tmp_path: Path) -> None:
    renamed = ["joints.0.parent=wing", "providers.0.bodies=['wing', 'link2']"]
    settings = [setting, *(renamed if "name" in setting else [])]
    for side in (ask, move):
        with pytest.raises(InputError, match=text):
            side(log, tmp_path / "out", *settings)
    assert not (tmp_path / "out").exists()


def test_command(log: Log, tmp_path: Path) -> None:
    runner, path = CliRunner(), str(log.path)
    base = ["replay", path, "--out", str(tmp_path / "out")]
    done = runner.invoke(app, [*base, "--substitute", "aero", "--set", "aero.model=none", "--json"])
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert (summary["steps"], summary["exchanges"], summary["identical_answers"]) == (STEPS, STEPS + 1, 0)
    assert {each["body"] for each in summary["forces"]} == {"link1", "link2"}
    assert all(each["live"] == 0.0 < each["recorded"] == each["difference"] for each in summary["forces"])
    assert "live against the motion recorded" in runner.invoke(app, ["log", "info", summary["log"]]).stdout
    base[-1] = str(tmp_path / "b")
    done = runner.invoke(app, [*base, "--substitute", "dynamics", "--set", "bodies.link1.mass=2.1", "--json"])
    assert json.loads(done.stdout)["difference"]["identical"] is False
    done = runner.invoke(app, ["replay", path, "--substitute", "wing"])
    assert "--substitute: expected one of dynamics, aero; got wing" in str(done.exception)
    assert runner.invoke(app, ["replay", path, "--set", "aero.model=none"]).exit_code == 2
