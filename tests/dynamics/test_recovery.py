"""Providers that die and come back: at every moment that there is, the run goes on to the same bits."""

from __future__ import annotations

import struct
from collections.abc import Callable, Collection, Mapping
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from linkwind import aero, checkpoints
from linkwind.aero.base import Capabilities
from linkwind.aero.service import session as provider_session
from linkwind.dynamics.service import DynamicsService
from linkwind.errors import LostError, MismatchError, SimulationError
from linkwind.frames import FlowFrame
from linkwind.log import contents
from linkwind.log.reader import open_log
from linkwind.mechanism import build
from linkwind.protocol import ProviderSession
from linkwind.protocol.control import Control
from linkwind.runs import keeping
from linkwind.runs.resume import plan, resume
from linkwind.runs.run import Outcome, drive
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import Scenario, loads
from linkwind.spatial import Motion, Wrench
from tests.dynamics.mortal import MortalLink
from tests.flows import vortices

STEPS = 24
TEXT = """
[time]
end = {end}
[[bodies]]
name = "a"
mass = 2.0
inertia = 1.4
[[bodies]]
name = "b"
mass = 2.0
inertia = 1.4
angular_velocity = 4.0
[[joints]]
name = "hinge"
type = "revolute"
parent = "a"
child = "b"
parent_point = [0.25, 0.0]
child_point = [-0.25, 0.0]
[[events]]
name = "part"
joint = "hinge"
action = "release"
[[providers]]
name = "left"
model = "none"
bodies = ["b"]
[[providers]]
name = "right"
model = "field"
bodies = ["a", "b"]
[providers.field.a]
fx = "-vx"
fy = "sin(t)"
[coupling]
scheme = "{scheme}"
[bus]
recovery = 5.0
transport = "inprocess"
[log]
checkpoint_every = {every}
"""


class Wake:
    """A force from all motion until now, with a picture at every fourth point."""

    def __init__(self, scenario: Scenario, provider: object) -> None:
        self.capabilities = Capabilities(diagnostics=("wake [N]",))
        self.memory, self.committed, self.shown = 0.0, 0, -1

    def commit(self, t: float, motion: Motion) -> None:
        self.memory = 0.9 * self.memory + 0.1 * float(motion.linear[1, 1])
        self.committed = round(t * 1000)

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        wrench.force[:] = 0.0
        wrench.torque[:] = 0.0
        wrench.force[0, 1] = -3.0 * self.memory - float(motion.linear[1, 1])
        if wrench.diagnostics is not None:
            wrench.diagnostics[0] = self.memory

    def frame(self) -> FlowFrame | None:
        if self.committed % 4 or self.committed == self.shown:
            return None
        self.shown = self.committed
        return vortices(self.committed / 1000, 1_000_000, rows=4, columns=4)

    def save(self) -> bytes:
        return struct.pack("<dqq", self.memory, self.committed, self.shown)

    def restore(self, blob: bytes) -> None:
        self.memory, self.committed, self.shown = struct.unpack("<dqq", blob)


class Forgetful(Wake):
    """It cannot save."""

    def save(self) -> bytes:
        raise SimulationError("no FMU state")


class Unable(Wake):
    """It says so."""

    def __init__(self, scenario: Scenario, provider: object) -> None:
        super().__init__(scenario, provider)
        self.capabilities = Capabilities(rollback=False, diagnostics=("wake [N]",))


class Moody(Wake):
    """Never the same twice."""

    lives = 0

    def __init__(self, scenario: Scenario, provider: object) -> None:
        super().__init__(scenario, provider)
        Moody.lives += 1
        self.memory = 1e-15 * Moody.lives


@pytest.fixture(autouse=True)
def _models(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(aero.MODELS, "none", Wake)
    monkeypatch.setattr(keeping, "_report", lambda log, report: "")


def scenario(scheme: str = "pec", every: int = 5, end: float = STEPS / 1000) -> Scenario:
    return loads(TEXT.format(end=end, scheme=scheme, every=every), "mortal.toml")


Deaths = Mapping[str, Collection[int]]


def fly(
    what: Scenario,
    folder: Path,
    deaths: Deaths,
    make: Callable[[str], ProviderSession] = provider_session,
    limit: int = 1000,
) -> tuple[Outcome, MortalLink]:
    """Run; the event happens after step 9."""
    folder.mkdir()
    service = DynamicsService(what, build(what), "mortal")
    link = MortalLink(service.session, make, deaths, limit)

    def progress(step: int) -> None:
        if step == 9:
            service.session.control(Control(order={"event": "part"}).SerializeToString())

    return drive(service, folder, progress, link), link


def messages(log: Path) -> list[tuple[str, int, bytes]]:
    return [tuple(m) for m in open_log(log).raw() if m.topic != contents.TIMING]  # type: ignore[misc]


def check_same(done: Outcome, undisturbed: Outcome) -> None:
    assert done.result.final_state_sha256 == undisturbed.result.final_state_sha256
    assert done.result.exchanges == undisturbed.result.exchanges
    assert sorted(messages(done.log)) == sorted(messages(undisturbed.log))
    by_topic = [
        {topic: [m for m in messages(o.log) if m[0] == topic] for topic in open_log(o.log).topics}
        for o in (done, undisturbed)
    ]
    assert by_topic[0] == by_topic[1]


@pytest.mark.parametrize("scheme", ["pec", "explicit", "implicit"])
@pytest.mark.parametrize("name", ["left", "right"])
def test_a_death_at_any_moment_changes_no_bit(scheme: str, name: str, tmp_path: Path) -> None:
    what = scenario(scheme)
    undisturbed, link = fly(what, tmp_path / "undisturbed", {})
    assert verify(*scenario_of(undisturbed.log)).identical
    for moment in range(1, link.moments[name] + 1):
        done, disturbed = fly(what, tmp_path / str(moment), {name: {moment}})
        assert disturbed.lives[name] == 2
        check_same(done, undisturbed)
        if moment > 1:  # before that, nobody had seen it
            (back,) = done.result.returns
            assert back.provider == name
        if moment % 10 == 0:
            assert verify(*scenario_of(done.log)).identical


@pytest.mark.parametrize("scheme", ["pec", "implicit"])
@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_many_deaths(scheme: str, data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Of both, some while they catch up."""
    what = scenario(scheme)
    folder = tmp_path_factory.mktemp("many")
    undisturbed, link = fly(what, folder / "undisturbed", {})
    moments = st.integers(1, link.moments["left"])
    first = data.draw(st.lists(moments, max_size=3, unique_by=lambda m: m // 40))
    deaths = {
        "left": {m + more for m in first for more in data.draw(st.sampled_from([(0,), (0, 1), (0, 9)]))},
        "right": set(data.draw(st.lists(moments, max_size=3, unique_by=lambda m: m // 40))),
    }
    try:
        done, _ = fly(what, folder / "disturbed", deaths)
    except LostError as error:
        if "was lost 3 times without an answer in between: given up" not in str(error):
            raise
        assert max(map(len, deaths.values())) >= 3
        return
    check_same(done, undisturbed)
    assert verify(*scenario_of(done.log)).identical


def test_a_loss_that_is_told_again_is_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(MortalLink, "told", 3)
    undisturbed, link = fly(scenario(), tmp_path / "undisturbed", {})
    for moment in range(2, link.moments["left"], 7):
        done, disturbed = fly(scenario(), tmp_path / str(moment), {"left": {moment}})
        assert disturbed.lives["left"] == 2
        check_same(done, undisturbed)


def test_a_death_between_two_pieces_of_a_checkpoint(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """There, 24 bytes in 4 pieces, and back, in 3."""
    monkeypatch.setattr(checkpoints, "PIECE", 7)
    monkeypatch.setattr(MortalLink, "piece", 11)
    what = scenario(end=0.013)
    undisturbed, link = fly(what, tmp_path / "undisturbed", {})
    assert open_log(undisturbed.log).topics["/checkpoint/left"] == 2 * 4
    for moment in range(1, link.moments["left"] + 1):
        done, _ = fly(what, tmp_path / str(moment), {"left": {moment, moment + 3}})
        check_same(done, undisturbed)


def test_before_the_first_checkpoint_it_begins_again(tmp_path: Path) -> None:
    what = scenario(every=1000)
    undisturbed, link = fly(what, tmp_path / "undisturbed", {})
    done, _ = fly(what, tmp_path / "disturbed", {"left": {link.moments["left"] - 4}})
    check_same(done, undisturbed)


def test_the_log_and_the_terminal_tell(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    done, _ = fly(scenario(), tmp_path / "run", {"left": {40}})
    (back,) = done.result.returns
    where = f"at step {back.step} (t = {back.step / 1000:g} s)"
    assert f'"left" was lost {where}; waiting up to 5 s for it to come back' in caplog.text
    assert '"left" is back after 0.0 s' in caplog.text
    assert f'"provider": "left", "step": {back.step}' in open_log(done.log).record(contents.RETURNS)["1"]
    assert done.as_json()["returns"] == [back._asdict()]


def test_a_resumed_run_recovers_before_and_behind_the_cut(tmp_path: Path) -> None:
    """The record answers up to step 13, the providers begin at the checkpoint of step 10."""
    what = scenario()
    undisturbed, _ = fly(what, tmp_path / "undisturbed", {})
    links: list[MortalLink] = []

    def again(deaths: Deaths, folder: Path, monkeypatch: pytest.MonkeyPatch) -> Outcome:
        def link(session: object, *_: object) -> MortalLink:
            links.append(MortalLink(session, provider_session, deaths))  # type: ignore[arg-type]
            return links[-1]

        monkeypatch.setattr("linkwind.runs.here.inprocess_link", link)
        return resume(plan(open_log(undisturbed.log), 13), folder).outcome

    with pytest.MonkeyPatch.context() as patch:
        check_same(again({}, tmp_path / "resumed", patch), undisturbed)
        for moment in range(1, links[0].moments["left"] + 1):
            check_same(again({"left": {moment}}, tmp_path / f"{moment}", patch), undisturbed)


def test_one_that_cannot_save_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(aero.MODELS, "none", Unable)
    with pytest.raises(LostError, match=r'"left" was lost. "left" cannot come back .*cannot save its memory'):
        fly(scenario(), tmp_path / "unable", {"left": {40}})
    monkeypatch.setitem(aero.MODELS, "none", Forgetful)
    with pytest.raises(LostError, match="sent no checkpoint when one was due"):
        fly(scenario(), tmp_path / "forgetful", {"left": {40}})


def test_one_that_answers_otherwise_ends_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(aero.MODELS, "none", Moody)
    with pytest.raises(MismatchError, match=r'"left" came back, but .* the answers to steps 0 to 3'):
        fly(scenario(), tmp_path / "moody", {"left": {19}})


def test_three_deaths_without_an_answer_are_enough(tmp_path: Path) -> None:
    """Moment 40 is in the middle, the second of each life behind that is when it has been seen."""
    with pytest.raises(LostError, match="was lost 3 times without an answer in between: given up"):
        fly(scenario(), tmp_path / "run", {"left": {40, 42, 44}})
    done, link = fly(scenario(), tmp_path / "twice", {"left": {40, 42}})
    assert link.lives["left"] == 3
    assert len(done.result.returns) == 1


def test_nobody_comes(tmp_path: Path) -> None:
    what = loads(TEXT.format(end=0.01, scheme="pec", every=5).replace("5.0", "0.2"), "mortal.toml")
    with pytest.raises(LostError, match=r'No other "left" came within 0.2 s \(bus.recovery\). Start it'):
        fly(what, tmp_path / "run", {"left": {20}}, limit=1)


def test_without_recovery_a_loss_ends_the_run(tmp_path: Path) -> None:
    what = loads(TEXT.format(end=0.01, scheme="pec", every=5).replace("5.0", "0.0"), "mortal.toml")
    with pytest.raises(LostError, match=r'^"left" was lost\n'):
        fly(what, tmp_path / "run", {"left": {20}})
