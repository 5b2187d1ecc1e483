"""What a dynamics that is started again finds in its folder, and what it makes of it."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from linkwind.aero.service import serve, session
from linkwind.bus.zenoh import ZenohProviderLink, loopback_endpoint
from linkwind.cli import app
from linkwind.errors import LinkwindError, LogError, LostError, MismatchError
from linkwind.log import contents
from linkwind.log.reader import open_log
from linkwind.log.sink import alone
from linkwind.runs.restart import Finished, restart
from linkwind.runs.resume import Resumed, plan, resume_elsewhere
from linkwind.runs.run import Ends, Outcome, run
from linkwind.runs.successor import NAME
from linkwind.scenario import Scenario, load
from tests.runs.edit import rewrite
from tests.runs.test_resume import cut, messages

PATIENCE = 30.0  # s for a machine under load
SETTINGS = ("time.end=0.06", "log.checkpoint_every=10")


@contextmanager
def provider(endpoint: str) -> Iterator[None]:
    """Let a provider take part in what comes."""

    def take_part() -> None:
        with closing(ZenohProviderLink([endpoint], [], name="aero")) as link, suppress(LinkwindError):
            serve(link, session("aero"), PATIENCE)

    thread = threading.Thread(target=take_part)
    thread.start()
    yield
    thread.join(PATIENCE)
    assert not thread.is_alive()


def started(scenario: Scenario, folder: Path | None, **how: Any) -> Outcome | Resumed | Finished:
    endpoint = loopback_endpoint()
    with provider(endpoint):
        return restart(scenario, folder, lambda step: None, Ends([endpoint], []), **how)


def alone_with(scenario: Scenario, folder: Path | None, **how: Any) -> Outcome | Resumed | Finished:
    """Start it where no provider is."""
    return restart(scenario, folder, lambda step: None, Ends([loopback_endpoint()], []), **how)


@pytest.fixture
def scenario() -> Scenario:
    return load("two_link_field", list(SETTINGS))


@pytest.fixture
def whole(tmp_path: Path) -> Outcome:
    settings = [*SETTINGS, "bus.transport=inprocess"]
    return run(load("two_link_field", settings), tmp_path / "whole" / "out", lambda step: None, report=False)


def left(whole: Outcome, folder: Path, count: int) -> Path:
    """Leave the first so many messages of a log in a folder."""
    folder.mkdir(parents=True)
    return cut(whole.log, folder / "log.mcap", count)


def test_where_there_is_nothing_the_run_begins(scenario: Scenario, whole: Outcome, tmp_path: Path) -> None:
    done = started(scenario, tmp_path / "out")
    assert isinstance(done, Outcome)
    assert messages(done.log) == messages(whole.log)


@pytest.mark.parametrize("count", [0, 1, 4, 5, 50, 150, 230])
def test_where_it_was_cut_it_goes_on_in_its_place(
    count: int, scenario: Scenario, whole: Outcome, tmp_path: Path
) -> None:
    log = left(whole, tmp_path / "out", count)
    (tmp_path / "out" / NAME).write_bytes(b"of a death on the way")
    told: list[int] = []
    done = started(scenario, tmp_path / "out", goes_on=lambda found: told.append(found.last))
    assert isinstance(done, Resumed)
    assert told == [done.plan.last]
    assert done.outcome.log == log
    assert done.outcome.result.final_state_sha256 == whole.result.final_state_sha256
    assert messages(log) == messages(whole.log)
    assert open_log(log).complete
    assert sorted(path.name for path in log.parent.iterdir()) == ["log.mcap", "report.html"]


@pytest.mark.parametrize("size", [0, 5, 20, 60])
def test_a_log_that_says_nothing_is_no_log(
    size: int, scenario: Scenario, whole: Outcome, tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "log.mcap").write_bytes(whole.log.read_bytes()[:size])
    done = started(scenario, tmp_path / "out")
    assert isinstance(done, Outcome)
    assert messages(done.log) == messages(whole.log)


def test_a_finished_run_is_left_alone_but_for_its_report(scenario: Scenario, tmp_path: Path) -> None:
    first = started(scenario, tmp_path / "out")
    assert isinstance(first, Outcome)
    first.report.unlink()
    before = first.log.read_bytes()
    again = alone_with(scenario, tmp_path / "out")
    assert isinstance(again, Finished)
    assert again.as_json()["final_state_sha256"] == first.result.final_state_sha256
    assert again.as_json()["exchanges"] == first.result.exchanges
    assert again.report.exists()
    assert first.log.read_bytes() == before


def test_what_fails_on_the_way_leaves_the_log_as_it_was(
    scenario: Scenario, whole: Outcome, tmp_path: Path
) -> None:
    log = left(whole, tmp_path / "out", 150)
    before = log.read_bytes()
    impatient = load("two_link_field", [*SETTINGS, "bus.start_timeout=0.1"])  # how it is done may change
    with pytest.raises(LostError, match='"aero" did not come'):
        alone_with(impatient, log.parent)
    assert log.read_bytes() == before
    assert not (log.parent / NAME).exists()


def test_what_does_not_come_out_again_leaves_the_log_as_it_was(
    scenario: Scenario, whole: Outcome, tmp_path: Path
) -> None:
    def disturbed(topic: str, number: int, payload: bytes) -> bytes | None:
        if number > 40:
            return None
        return payload[:-1] + bytes([payload[-1] ^ 1]) if (topic, number) == ("/state", 30) else payload

    (tmp_path / "out").mkdir()
    log = rewrite(whole.log, tmp_path / "out" / "log.mcap", disturbed, {contents.END: {"complete": "false"}})
    before = log.read_bytes()
    with pytest.raises(MismatchError, match="as recorded"):
        started(scenario, log.parent)
    assert log.read_bytes() == before


@pytest.mark.parametrize(
    ("settings", "how", "got"),
    [
        (("time.end=0.07",), {}, "another time.end"),
        (("bodies.link1.mass=3",), {}, "another bodies.0.mass"),
        ((), {"run_id": "mine"}, 'another the run id "out"'),
    ],
)
def test_the_log_of_another_run_is_refused(
    settings: tuple[str, ...], how: dict[str, str], got: str, whole: Outcome, tmp_path: Path
) -> None:
    log = left(whole, tmp_path / "out", 150)
    before = log.read_bytes()
    with pytest.raises(LogError, match=got):
        alone_with(load("two_link_field", [*SETTINGS, *settings]), log.parent, **how)
    assert log.read_bytes() == before


def test_a_run_that_goes_on_elsewhere_is_refused(scenario: Scenario, whole: Outcome, tmp_path: Path) -> None:
    log = left(whole, tmp_path / "out", 150)
    with alone(log), pytest.raises(LogError, match="got one that is being written"):
        alone_with(scenario, log.parent)


def test_without_a_folder_the_newest_run_goes_on(
    scenario: Scenario, whole: Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    runs = tmp_path / "runs"
    first = started(scenario, None)
    assert isinstance(first, Outcome)
    # The newest is over: another one begins.
    second = started(scenario, None)
    assert isinstance(second, Outcome)
    assert second.log.parent != first.log.parent
    # It was cut: it goes on, whatever others there are.
    cut(second.log, tmp_path / "cut.mcap", 150).replace(second.log)
    (runs / "two_link_field-heard-20990101-000000").mkdir()
    third = started(scenario, None)
    assert isinstance(third, Resumed)
    assert third.outcome.log == second.log
    # It is another's, now: a new one begins.
    cut(second.log, tmp_path / "cut.mcap", 150).replace(second.log)
    with alone(second.log):
        fourth = started(scenario, None)
    assert isinstance(fourth, Outcome)
    assert len(list(runs.glob("two_link_field-2*"))) == 3


def test_newer_runs_of_other_settings_are_passed_over(
    scenario: Scenario, whole: Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    mine, others, blank = (Path("runs") / f"two_link_field-20260101-00000{n}" for n in (1, 2, 3))
    left(whole, mine, 150)
    longer = load("two_link_field", [*SETTINGS, "time.end=0.07", "bus.transport=inprocess"])
    run(longer, others, lambda step: None)
    blank.mkdir()
    (blank / "log.mcap").write_bytes(whole.log.read_bytes()[:20])
    for age, folder in enumerate((blank, others, mine)):
        os.utime(folder / "log.mcap", (2e9 - age, 2e9 - age))
    told: list[str] = []
    done = started(scenario, None, tell=told.append)
    assert isinstance(done, Resumed)
    assert done.outcome.log == mine / "log.mcap"
    assert told == [f"goes on with {mine}, the newest run of these settings"]
    # Now it is over: nothing older of the same settings is taken up, and no blank log either.
    os.utime(mine / "log.mcap", (2e9, 2e9))
    again = started(scenario, None, tell=told.append)
    assert isinstance(again, Outcome)
    assert told[1:] == [f"begins a new run: the newest of these settings, {mine}, has come to its end"]


def test_why_a_new_run_begins_is_told(
    scenario: Scenario, whole: Outcome, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    told: list[str] = []
    heavier = load("two_link_field", [*SETTINGS, "bodies.link1.mass=3"])
    assert isinstance(started(heavier, None, tell=told.append), Outcome)
    (folder,) = Path("runs").iterdir()
    assert isinstance(started(scenario, None, tell=told.append), Outcome)
    assert told[0] == "begins a new run: none of these settings is under runs/"
    assert told[1] == f"{told[0]}; {folder} has another bodies.0.mass"


def test_a_provider_of_the_dead_dynamics_that_goes_now_is_no_loss(
    scenario: Scenario, whole: Outcome, tmp_path: Path
) -> None:
    """One that was busy when its dynamics died, and hears of it when the next is there."""
    log = left(whole, tmp_path / "out", 150)
    endpoint, met = loopback_endpoint(), threading.Event()
    stale = ZenohProviderLink([endpoint], [], name="aero")
    stale.join("out")

    def leave() -> None:
        deadline = time.monotonic() + PATIENCE
        while not any(True for _ in stale._session.info.peers_zid()) and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(0.3)  # for its token to be seen
        met.set()
        stale.close()
        time.sleep(0.3)
        with closing(ZenohProviderLink([endpoint], [], name="aero")) as link:
            serve(link, session("aero"), PATIENCE)

    thread = threading.Thread(target=leave)
    thread.start()
    done = restart(scenario, log.parent, lambda step: None, Ends([endpoint], []))
    thread.join(PATIENCE)
    assert met.is_set()
    assert isinstance(done, Resumed)
    assert messages(log) == messages(whole.log)


def test_resume_meets_providers_that_are_elsewhere(whole: Outcome, tmp_path: Path) -> None:
    log = left(whole, tmp_path / "cut", 150)
    endpoint = loopback_endpoint()
    found = plan(open_log(log), None, ["bus.transport=zenoh"])
    with provider(endpoint):
        done = resume_elsewhere(found, tmp_path / "again", lambda step: None, Ends([endpoint], []))
    assert done.outcome.result.final_state_sha256 == whole.result.final_state_sha256
    assert messages(done.outcome.log) == messages(whole.log)
    refused = CliRunner().invoke(
        app, ["resume", str(log), "--listen", endpoint, "--force-fmu", "a.fmu"], catch_exceptions=True
    )
    assert "expected the model where the provider runs" in str(refused.exception)


def test_the_command_says_where_it_goes_on_and_that_it_is_over(whole: Outcome, tmp_path: Path) -> None:
    log = left(whole, tmp_path / "out", 150)
    endpoint = loopback_endpoint()
    command = ["dynamics", "two_link_field", "--resume", "--out", str(log.parent), "--listen", endpoint]
    command += [f"--set={setting}" for setting in SETTINGS]
    with provider(endpoint):
        done = CliRunner().invoke(app, command, catch_exceptions=False)
    assert "goes on after step " in done.output
    assert "providers start from a checkpoint of step " in done.output
    over = CliRunner().invoke(app, command, catch_exceptions=False)
    assert over.exit_code == 0
    assert "this run has come to its end, step 60: nothing is left to do" in over.output
    told = json.loads(CliRunner().invoke(app, [*command, "--json"], catch_exceptions=False).output)
    assert told["final_state_sha256"] == whole.result.final_state_sha256
