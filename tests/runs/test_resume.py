"""Runs that go on from their log: the same to the bit as if they had not been cut, or branches."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from typer.testing import CliRunner

from linkwind import aero, checkpoints
from linkwind.aero.base import Capabilities
from linkwind.cli import app
from linkwind.errors import FaultError, InputError, LogError, MismatchError, ScenarioError
from linkwind.log import contents
from linkwind.log.reader import open_log
from linkwind.runs.diff import diff
from linkwind.runs.record import checkpoint_steps
from linkwind.runs.resume import Resumed, plan, resume
from linkwind.runs.run import Outcome, run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from linkwind.spatial import Motion, Wrench
from tests.flows import VortexModel
from tests.fmi.scenes import SERVO
from tests.runs.edit import rewrite

STEPS, EVERY = 60, 10
PIECE_9 = "/checkpoint/aero", 9  # the third of the second one
FAST = ("two_link", "two_link_free", "two_link_field", "two_link_gust")


def fly(name: str, folder: Path, *settings: str) -> Outcome:
    usual = [f"time.end={STEPS / 1000}", "bus.transport=inprocess", f"log.checkpoint_every={EVERY}"]
    return run(load(name, [*usual, *settings]), folder, lambda step: None, report=False)


def go_on(
    log: Path, folder: Path, step: int | None = None, settings: Sequence[str] = (), *, report: bool = False
) -> Resumed:
    return resume(plan(open_log(log), step, settings), folder, report=report)


def cut(log: Path, target: Path, messages: int) -> Path:
    """Copy the first so many messages of a log, as if the run had been killed then."""
    left = iter(range(messages))
    return rewrite(
        log,
        target,
        lambda topic, number, payload: None if next(left, None) is None else payload,
        {contents.END: {"complete": "false"}},
    )


def messages(log: Path) -> list[tuple[str, int, bytes]]:
    """Return all messages in order but for how long exchanges took."""
    return [tuple(m) for m in open_log(log).raw() if m.topic != contents.TIMING]  # type: ignore[misc]


def check_same(done: Resumed, whole: Outcome) -> None:
    """A resumed run ends where the other does, its log holds the same in the same order, and is verified."""
    outcome = done.outcome
    assert outcome.result.final_state_sha256 == whole.result.final_state_sha256
    assert messages(outcome.log) == messages(whole.log)
    assert outcome.result.steps == whole.result.steps
    assert outcome.result.exchanges == whole.result.exchanges
    timing = [[m.payload for m in open_log(path).raw(contents.TIMING)] for path in (outcome.log, whole.log)]
    last = done.plan.last + 1
    assert timing[0][:last] == timing[1][:last]
    found = verify(*scenario_of(outcome.log))
    assert (found.difference, found.remark, found.steps) == (None, "", whole.result.steps)


def exchange_ends(log: Path) -> list[int]:
    """Return how many messages there are before each motion."""
    return [i for i, m in enumerate(open_log(log).raw()) if m.topic == contents.MOTION]


@pytest.mark.parametrize("name", FAST)
def test_cut_anywhere_it_ends_in_the_same_state(name: str, tmp_path: Path) -> None:
    whole = fly(name, tmp_path / "whole")
    motions = exchange_ends(whole.log)
    beside = (0, 1, 4, 5, 6, 10, 11, 12, 29, 59, 60)
    places = {motions[k + 1] + more for k in beside for more in (0, 1, 2, 3)}
    for place in sorted(places):
        log = cut(whole.log, tmp_path / f"{place}.mcap", place)
        last = max(k for k in range(STEPS + 1) if motions[k + 1] < place) if place > motions[1] else -1
        if last < 0:
            with pytest.raises(LogError, match=r"none that another motion follows|no wrench"):
                plan(open_log(log))
            continue
        done = go_on(log, tmp_path / str(place))
        assert done.plan.last == last
        saved = [m.time_ns // 1_000_000 for m in open_log(log).raw("/checkpoint/aero")]
        assert done.plan.start == max((k for k in saved if k <= last), default=-1)
        assert last - done.plan.start <= EVERY + 1 or last < EVERY
        check_same(done, whole)


@pytest.mark.parametrize("name", FAST)
def test_from_every_checkpoint_and_beside_it(name: str, tmp_path: Path) -> None:
    whole = fly(name, tmp_path / "whole")
    for step in (0, *(k + d for k in range(EVERY, STEPS + 1, EVERY) for d in (-1, 0, 1) if k + d <= STEPS)):
        done = go_on(whole.log, tmp_path / str(step), step)
        assert (done.plan.last, done.plan.start) == (step, step // EVERY * EVERY or -1)
        check_same(done, whole)


def test_cut_within_a_checkpoint_the_one_before_is_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It has 16 bytes, in 6 pieces."""
    monkeypatch.setattr(checkpoints, "PIECE", 3)
    whole = fly("two_link_field", tmp_path / "whole")
    topics = [m.topic for m in open_log(whole.log).raw()]
    pieces = [place for place, topic in enumerate(topics) if topic == "/checkpoint/aero"][:12]
    assert pieces[6:] == list(range(pieces[6], pieces[6] + 6))
    for there in range(7):
        log = cut(whole.log, tmp_path / f"{there}.mcap", pieces[6] + there)
        done = go_on(log, tmp_path / str(there))
        assert (done.plan.last, done.plan.start) == (20, 20 if there == 6 else 10)
        check_same(done, whole)


def test_a_piece_that_is_lost_in_the_middle_of_a_log(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is behind it does not count."""
    monkeypatch.setattr(checkpoints, "PIECE", 3)
    whole = fly("two_link_field", tmp_path / "whole")
    log = rewrite(
        whole.log,
        tmp_path / "hole.mcap",
        lambda topic, number, payload: None if (topic, number) == PIECE_9 else payload,
        {contents.END: {"complete": "false"}},
    )
    assert checkpoint_steps(open_log(log), 1_000_000) == [10, 30, 40, 50, 60]
    done = go_on(log, tmp_path / "again")
    assert (done.plan.last, done.plan.start) == (20, 10)
    check_same(done, whole)


def test_cut_between_two_coupling_iterations(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "whole", "coupling.scheme=implicit")
    motions = exchange_ends(whole.log)
    assert len(motions) > 2 * STEPS
    for number in (2, 3, 4, 5, 47, 48, 49, 50, len(motions) - 2):
        log = cut(whole.log, tmp_path / f"{number}.mcap", motions[number] + 1)
        check_same(go_on(log, tmp_path / str(number)), whole)
    for step in (0, 1, 10, 17):
        check_same(go_on(whole.log, tmp_path / f"step-{step}", step), whole)


@pytest.mark.parametrize("step", [7, 20, 25])
def test_over_zenoh(step: int, tmp_path: Path) -> None:
    whole = fly("two_link_field", tmp_path / "whole", "bus.transport=zenoh")
    check_same(go_on(whole.log, tmp_path / "again", step), whole)


def test_the_transport_may_change(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "whole")
    done = go_on(whole.log, tmp_path / "again", 33, ["bus.transport=zenoh", "log.checkpoint_every=5"])
    assert done.outcome.result.final_state_sha256 == whole.result.final_state_sha256
    assert not done.plan.changes
    assert verify(*scenario_of(done.outcome.log)).identical


@pytest.mark.parametrize("step", ["1e-4", "4e-4"], ids=["one lattice step", "several"])
def test_a_flow(step: str, tmp_path: Path) -> None:
    settings = (
        f"coupling.step={step}",
        f"time.end={30 * float(step)}",
        "aero.flow.frames=4",
        "aero.flow.cells=24",
    )
    whole = fly("two_link_flow", tmp_path / "whole", *settings)
    assert checkpoint_steps(open_log(whole.log), round(float(step) * 1e9)) == [10, 20, 30]
    for at in (5, 10, 14, 20, 30):
        check_same(go_on(whole.log, tmp_path / str(at), at), whole)


def test_without_checkpoints_the_provider_begins_at_the_beginning(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(aero.MODELS, "none", lambda scenario, provider: VortexModel(every=4))
    whole = fly("two_link", tmp_path / "whole", "aero.model=none")
    assert "/checkpoint/aero" not in open_log(whole.log).topics
    done = go_on(whole.log, tmp_path / "again", 33)
    assert done.plan.start == -1
    check_same(done, whole)


class Drifting:
    """A force that grows with the number of commits, which is its memory, and with ``factor``."""

    factor = 1.0

    def __init__(self, *, rollback: bool = True) -> None:
        self.capabilities = Capabilities(rollback=rollback)
        self._count = 0

    def commit(self, t: float, motion: Motion) -> None:
        self._count += 1

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        wrench.force[:] = -motion.linear[: len(wrench)] * (self._count * self.factor)
        wrench.torque[:] = 0.0

    def save(self) -> bytes:
        return self._count.to_bytes(8, "little")

    def restore(self, blob: bytes) -> None:
        self._count = int.from_bytes(blob, "little")


def test_a_provider_that_does_not_do_it_again_is_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(aero.MODELS, "none", lambda scenario, provider: Drifting())
    whole = fly("two_link", tmp_path / "whole", "aero.model=none")
    check_same(go_on(whole.log, tmp_path / "same", 33), whole)
    monkeypatch.setattr(Drifting, "factor", 1.0 + 1e-15)
    expected = r'"aero": step 31 \(t = 0.031 s\): /wrench/aero: force\[0\] of link1: expected .*; got '
    with pytest.raises(MismatchError, match=expected):
        go_on(whole.log, tmp_path / "other", 33)
    assert "MismatchError" in str(open_log(tmp_path / "other" / "log.mcap").error)


def test_a_dynamics_that_does_not_do_it_again_is_an_error(tmp_path: Path) -> None:
    from tests.runs.edit import changed

    whole = fly("two_link", tmp_path / "whole")

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        return changed(topic, payload, "trial.linear", 3) if (topic, number) == ("/motion", 11) else payload

    log = rewrite(whole.log, tmp_path / "other.mcap", edit)
    with pytest.raises(
        MismatchError, match=r"dynamics: step 10 .*: /motion: trial.linear\[3\] of link2: expected"
    ):
        go_on(log, tmp_path / "again", 33)


def test_several_providers(tmp_path: Path) -> None:
    from tests.runs.test_verify import TWO_PROVIDERS

    scenario = tmp_path / "two.toml"
    scenario.write_text(TWO_PROVIDERS)
    for transport in ("inprocess", "zenoh"):
        settings = (f"bus.transport={transport}", "time.end=0.03")
        whole = fly(str(scenario), tmp_path / transport, *settings)
        done = go_on(whole.log, tmp_path / f"{transport}-again", 24)
        assert done.plan.start == 20
        assert done.outcome.result.final_state_sha256 == whole.result.final_state_sha256
        assert verify(*scenario_of(done.outcome.log)).identical


def test_damaged_files(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "whole", "time.end=0.4", "log.checkpoint_every=100")
    data = whole.log.read_bytes()
    for place in (0.5, 0.8, 0.97):
        at = int(place * len(data))
        hole = bytearray(data)
        hole[at] ^= 1
        for kind, content in (("cut", data[:at]), ("hole", bytes(hole))):
            log = tmp_path / f"{kind}.mcap"
            log.write_bytes(content)
            done = go_on(log, tmp_path / f"{kind}-{place}")
            assert 50 < done.plan.last <= 400
            check_same(done, whole)


# ---- branches ----


GRAVITY = "environment.gravity=[0.0, -1.62, 0.0]"


@pytest.mark.parametrize("transport", ["inprocess", "zenoh"])
@pytest.mark.parametrize(
    ("name", "setting"),
    [
        ("two_link", GRAVITY),
        ("two_link", "environment.wind=[-2.0, 1.0, 0.0]"),
        ("two_link_field", "aero.field.link1.fx=3.0*t"),
        ("two_link", "joints.hinge.damping=0.5"),
    ],
)
def test_a_branch_differs_behind_its_step_only(
    name: str, setting: str, transport: str, tmp_path: Path
) -> None:
    whole = fly(name, tmp_path / "whole", f"bus.transport={transport}")
    done = go_on(whole.log, tmp_path / "branch", 25, [setting])
    found = diff(whole.log, done.outcome.log)
    assert found.first is not None
    assert found.first.step == 26
    before = [m for m in messages(whole.log) if m[1] <= 25_000_000]
    branch = messages(done.outcome.log)
    assert [m for m in branch if m[1] <= 25_000_000] == before
    verified = verify(*scenario_of(done.outcome.log))
    assert (verified.difference, verified.steps) == (None, STEPS)


def test_inputs_of_actuators_may_change(tmp_path: Path) -> None:
    arm = tmp_path / "servo.toml"
    arm.write_text(SERVO)
    whole = fly(str(arm), tmp_path / "whole")
    done = go_on(whole.log, tmp_path / "branch", 25, ["forces.motor.inputs.u=3.0"])
    found = diff(whole.log, done.outcome.log)
    assert found.first is not None
    assert found.first.step == 26
    assert verify(*scenario_of(done.outcome.log)).identical


def test_a_branch_is_resumed_and_branched_again(tmp_path: Path) -> None:
    whole = fly("two_link_field", tmp_path / "whole")
    one = go_on(whole.log, tmp_path / "one", 25, ["aero.field.link1.fx=3.0*t"])
    for step in (12, 24, 25, 26, 30, 31, 47):
        again = go_on(one.outcome.log, tmp_path / f"again-{step}", step)
        if step >= 25:
            check_same(again, one.outcome)
        else:  # before the branch
            check_same(again, whole)
    two = go_on(one.outcome.log, tmp_path / "two", 40, [GRAVITY])
    assert sorted(two.plan.changes) == [25, 40]
    assert two.plan.changes[40].providers == two.plan.changes[25].providers
    assert verify(*scenario_of(two.outcome.log)).identical
    assert diff(one.outcome.log, two.outcome.log).first.step == 41  # type: ignore[union-attr]


def test_a_later_end(tmp_path: Path) -> None:
    short, long = fly("two_link", tmp_path / "short"), fly("two_link", tmp_path / "long", "time.end=0.1")
    done = go_on(short.log, tmp_path / "on", settings=["time.end=0.1"])
    assert (done.plan.last, done.plan.start, done.plan.steps) == (60, 60, 100)
    assert done.outcome.result.final_state_sha256 == long.result.final_state_sha256
    assert done.outcome.result.steps == 100
    assert verify(*scenario_of(done.outcome.log)).steps == 100
    with pytest.raises(InputError, match=r"time.end: expected an end after step 60, .*; got step 20"):
        plan(open_log(short.log), None, ["time.end=0.02"])


def test_the_new_log_says_where_it_comes_from(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "whole")
    log = open_log(go_on(whole.log, tmp_path / "again", 25, [GRAVITY], report=True).outcome.log)
    assert log.run == "whole"
    assert (log.metadata["resumed_run"], log.metadata["resumed_step"]) == ("whole", "25")
    assert list(log.changes) == [25]
    done = CliRunner().invoke(app, ["log", "info", str(log.path)])
    assert "how  resumed after step 25 of run whole" in done.stdout
    assert "how  other settings count after step 25" in done.stdout
    assert "Resumed after step 25 of run whole." in log.path.with_name("report.html").read_text()
    assert json.loads(log.scenario_json)["environment"]["gravity"] == [0.0, -9.81, 0.0]


# ---- what is refused ----


def refused(kind: type[Exception], text: str, do: Callable[[], object]) -> None:
    with pytest.raises(kind, match=text):
        do()


@pytest.mark.parametrize(
    "setting",
    [
        "bodies.link1.mass=3",
        "coupling.step=5e-4",
        "coupling.order=2",
        "aero.model=none",
        "joints.hinge.child=link1",
    ],
)
def test_settings_that_may_not_change(setting: str, tmp_path: Path) -> None:
    log = fly("two_link", tmp_path / "whole").log
    key = setting.partition("=")[0]
    with pytest.raises(ScenarioError) as error:
        plan(open_log(log), 25, [setting])
    assert str(error.value).startswith(f"--set {setting}: expected ") or "joints" in key
    assert "; got " in str(error.value)


def test_what_a_flow_remembers_may_not_change(tmp_path: Path) -> None:
    log = fly("two_link_flow", tmp_path / "whole", "time.end=3e-3", "aero.flow.cells=24").log
    expected = (
        r"expected a setting that the fluid does not remember; got environment.wind.0, with the model flow"
    )
    refused(ScenarioError, expected, lambda: plan(open_log(log), 25, ["environment.wind=[-4.0, 0.0, 0.0]"]))


def test_places_that_are_refused(tmp_path: Path) -> None:
    log = fly("two_link", tmp_path / "whole").log
    expected = r"--from-step: expected a step from 0 to 60, .*; got 61"
    refused(LogError, expected, lambda: plan(open_log(log), 61))
    refused(
        InputError, "expected a run that was cut; got one that came to its end", lambda: plan(open_log(log))
    )
    without = rewrite(log, tmp_path / "a.mcap", lambda t, n, p: None if t == "/wrench/aero" else p)
    refused(LogError, "to go on from; got no wrench of aero", lambda: plan(open_log(without), 25))
    refused(LogError, "expected an MCAP file", lambda: plan(open_log(Path(__file__))))
    started = r"step 3: expected a point behind the start of pec; got one of the first 6"
    refused(ScenarioError, started, lambda: go_on(log, tmp_path / "early", 3, [GRAVITY]))


def test_a_damaged_checkpoint_is_refused(tmp_path: Path) -> None:
    whole = fly("two_link_field", tmp_path / "whole")

    def edit(topic: str, number: int, payload: bytes) -> bytes:
        wrong = topic == "/checkpoint/aero" and number == 2
        return payload[:-40] + bytes([payload[-40] ^ 1]) + payload[-39:] if wrong else payload

    log = rewrite(whole.log, tmp_path / "other.mcap", edit)
    refused(LogError, r"/checkpoint/aero: step 20: .*SHA-256", lambda: go_on(log, tmp_path / "a", 25))
    check_same(go_on(log, tmp_path / "b", 15), whole)


def test_a_change_needs_a_model_that_can_save(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(aero.MODELS, "none", lambda scenario, provider: Drifting(rollback=False))
    log = fly("two_link", tmp_path / "whole", "aero.model=none").log
    expected = "step 25: expected a model that can save its memory"
    refused(FaultError, expected, lambda: go_on(log, tmp_path / "branch", 25, [GRAVITY]))


# ---- the command ----


def test_command(tmp_path: Path) -> None:
    whole = fly("two_link", tmp_path / "whole")
    log = cut(whole.log, tmp_path / "cut.mcap", 150)
    runner = CliRunner()
    done = runner.invoke(app, ["resume", str(log), "--out", str(tmp_path / "a"), "--json"])
    assert done.exit_code == 0
    summary = json.loads(done.stdout)
    assert set(summary) >= set(whole.as_json())
    assert summary["final_state_sha256"] == whole.result.final_state_sha256
    assert summary["resumed_at"] == plan(open_log(log)).last
    done = runner.invoke(app, ["resume", str(log), "--out", str(tmp_path / "b")])
    assert done.exit_code == 0
    assert "goes on after step" in done.stdout
    assert (tmp_path / "b" / "report.html").exists()


def test_a_force_fmu_needs_its_file(tmp_path: Path) -> None:
    from linkwind.fmi.export import export

    runner, fmu, another = CliRunner(), tmp_path / "plate.fmu", tmp_path / "another.fmu"
    export(load("two_link"), fmu, fmi="3", platforms=["host"], part="aero")
    export(load("two_link_gust"), another, fmi="3", platforms=["host"], part="aero")
    settings = ["time.end=0.03", "bus.transport=inprocess", "log.checkpoint_every=10"]
    options = ["--force-fmu", str(fmu), "--out", str(tmp_path / "out"), "--json"]
    done = runner.invoke(app, ["run", "two_link", *(f"--set={s}" for s in settings), *options])
    whole = json.loads(done.stdout)
    command = ["resume", whole["log"], "--from-step", "24", "--json", "--out"]
    done = runner.invoke(app, [*command, str(tmp_path / "a"), "--force-fmu", str(fmu)])
    assert done.exit_code == 0
    again = json.loads(done.stdout)
    assert again["final_state_sha256"] == whole["final_state_sha256"]
    assert (again["resumed_at"], again["checkpoint"]) == (24, 20)
    done = runner.invoke(app, [*command, str(tmp_path / "b")])
    assert "expected the file of its FMU" in str(done.exception)
    done = runner.invoke(app, [*command, str(tmp_path / "c"), "--force-fmu", str(another)])
    assert "expected the FMU with SHA-256" in str(done.exception)
