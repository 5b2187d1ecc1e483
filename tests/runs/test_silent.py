"""A provider that lives and says nothing, its model hangs: who has started it may start another one."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from threading import Event, Thread
from typing import Any

import pytest

from linkwind.aero.service import serve
from linkwind.aero.service import session as provider_session
from linkwind.bus.zenoh import ZenohProviderLink, loopback_endpoint
from linkwind.dynamics import exchanges
from linkwind.errors import AnswerTimeoutError, FaultError, LostError
from linkwind.log import contents
from linkwind.log.reader import open_log
from linkwind.runs import children
from linkwind.runs.run import Ends, dynamics, run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load

SETTINGS = ("time.end=0.06", "coupling.timeout=1.0", "bus.recovery=60", "log.checkpoint_every=10")

LAST = -1  # in the place of a step: the commit of the last one

# ``linkwind``, whose force model hangs at a step as often as it is told.
HANGS = """
import sys, threading
from pathlib import Path
from linkwind.cli import app
from linkwind.protocol import ProviderSession

answer = ProviderSession.answer
step, left = int(sys.argv.pop(1)), Path(sys.argv.pop(1))

def hang(self, payload):
    times = int(left.read_text())
    self._motion.load(payload, "motion")
    if (-1 if self._motion.final else self._motion.at[0]) == step and times:
        left.write_text(str(times - 1))
        threading.Event().wait()
    return answer(self, payload)

ProviderSession.answer = hang
app()
"""


@pytest.fixture
def hanging(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[int, int], list[Any]]:
    """Return what lets providers of a run hang at a step, so many times; that returns the processes."""
    started: list[Any] = []
    popen = subprocess.Popen

    def hangs(step: int, times: int) -> list[Any]:
        (tmp_path / "hangs.py").write_text(HANGS)
        (tmp_path / "left").write_text(str(times))
        program = [sys.executable, str(tmp_path / "hangs.py"), str(step), str(tmp_path / "left")]

        def start(command: list[str], **options: Any) -> Any:
            assert command[:3] == [sys.executable, "-m", "linkwind"]
            started.append(popen([*program, *command[3:]], **options))
            return started[-1]

        monkeypatch.setattr(children.subprocess, "Popen", start)
        return started

    return hangs


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> str:
    what = load("two_link", [*SETTINGS, "bus.transport=inprocess"])
    return run(what, tmp_path_factory.mktemp("undisturbed") / "out").result.final_state_sha256


@pytest.mark.parametrize(
    ("step", "times", "said"),
    [
        (1, 1, 'no Wrench from "aero" for step 1 (t = 0.001 s) within 1 s; it is alive'),
        (37, 2, 'no Wrench from "aero" for step 37 (t = 0.037 s) within 1 s; it is alive'),
        (LAST, 1, '"aero" did not say Bye within 1 s of the last step; it is alive. It is ended'),
    ],
)
def test_it_is_ended_and_another_one_takes_its_place(
    step: int,
    times: int,
    said: str,
    hanging: Callable[[int, int], list[Any]],
    undisturbed: str,
    tmp_path: Path,
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(exchanges, "GOODBYE_TIMEOUT", 1.0)
    started = hanging(step, times)
    done = run(load("two_link", list(SETTINGS)), tmp_path / "out")
    assert (tmp_path / "left").read_text() == "0"
    assert len(started) >= times + 1
    assert all(process.returncode is not None for process in started)
    assert done.result.final_state_sha256 == undisturbed
    assert {back.provider for back in done.result.returns} == {"aero"}
    assert said in caplog.text
    log = open_log(done.log)
    assert '"provider": "aero"' in log.record(contents.RETURNS)["1"]
    assert verify(*scenario_of(done.log)).identical


def test_one_that_always_hangs_is_given_up(hanging: Callable[[int, int], list[Any]], tmp_path: Path) -> None:
    started = hanging(20, 100)
    with pytest.raises(LostError, match=r'no Wrench from "aero" for step 20 .* lost 3 times .* given up'):
        run(load("two_link", list(SETTINGS)), tmp_path / "out")
    assert len(started) >= 3
    assert all(process.returncode is not None for process in started)


def test_without_recovery_it_ends_the_run(hanging: Callable[[int, int], list[Any]], tmp_path: Path) -> None:
    started = hanging(20, 100)
    with pytest.raises(AnswerTimeoutError, match=r'no Wrench from "aero" for step 20 .* it is alive'):
        run(load("two_link", [*SETTINGS, "bus.recovery=0"]), tmp_path / "out")
    assert len(started) == 1


def test_one_that_was_started_elsewhere_is_told(tmp_path: Path) -> None:
    """Nobody here can end it, and there is no place for another one as long as it lives."""
    endpoint, release = loopback_endpoint(), Event()
    ended: list[BaseException] = []

    def provide() -> None:
        session = provider_session("aero")
        answer = session.answer
        asked: list[bytes] = []

        def hang(payload: bytes) -> bytes | None:
            asked.append(payload)
            if len(asked) > 20:
                release.wait(60.0)
            return answer(payload)

        session.answer = hang  # type: ignore[method-assign]
        with closing(ZenohProviderLink([endpoint], [], name="aero")) as link:
            try:
                serve(link, session, 60.0)
            except FaultError as error:
                ended.append(error)

    provider = Thread(target=provide, daemon=True)
    provider.start()
    what = load("two_link", list(SETTINGS))
    with pytest.raises(AnswerTimeoutError, match=r'no Wrench from "aero" for step \d+ .* it is alive'):
        dynamics(what, tmp_path / "out", lambda step: None, Ends([endpoint], []))
    release.set()
    provider.join(60.0)
    assert "AnswerTimeoutError" in str(ended[0])
