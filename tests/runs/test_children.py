"""Provider processes of a run: which are started again, and when; the processes are made up."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest

from linkwind.errors import LostError
from linkwind.protocol import Course, DynamicsSession
from linkwind.runs import children
from linkwind.runs.children import Children


class Process:
    """It runs until its status is set."""

    started: ClassVar[list[Process]] = []

    def __init__(self, command: list[str], stdout: Any, **rest: object) -> None:
        stdout.write(b"what it says last\n")
        self.status: int | None = None
        self.started.append(self)

    def poll(self) -> int | None:
        return self.status

    def kill(self) -> None:
        self.status = -9 if self.status is None else self.status

    def wait(self, timeout: float = 0.0) -> int | None:
        return self.status


@pytest.fixture
def session(monkeypatch: pytest.MonkeyPatch) -> DynamicsSession:
    monkeypatch.setattr(children.subprocess, "Popen", Process)
    monkeypatch.setattr(Process, "started", [])
    made = DynamicsSession("r1", "{}", 1_000_000, 10, ["a"], {"aero": ["a"]})
    made.course = Course(checkpoint_every=5, recovery=True)
    return made


def start(session: DynamicsSession, folder: Path) -> Children:
    made = Children(folder, session)
    made.start("aero", ["aero"])
    made.check()
    assert len(Process.started) == 1
    return made


def test_without_recovery_an_end_with_an_error_is_one(session: DynamicsSession, tmp_path: Path) -> None:
    session.course = Course()
    made = start(session, tmp_path)
    Process.started[0].status = 4
    with pytest.raises(LostError, match=r'"aero" ended with status 4: what it says last \(see .*aero.log\)'):
        made.check()


def test_one_on_the_bus_is_started_again_when_its_loss_has_been_told(
    session: DynamicsSession, tmp_path: Path
) -> None:
    """Before that, as while a run is held, it would be refused."""
    made = start(session, tmp_path)
    session.seen("aero", True)
    Process.started[0].status = -9
    made.check()
    assert len(Process.started) == 1
    session.lose("aero")
    made.check()
    made.check()
    assert len(Process.started) == 2


def test_one_that_is_stopped_is_ended(session: DynamicsSession, tmp_path: Path) -> None:
    made = start(session, tmp_path)
    session.seen("aero", True)
    session.lose("aero")
    made.check()
    assert [process.status for process in Process.started] == [-9, None]


def test_one_that_never_comes_on_the_bus_is_started_three_times(
    session: DynamicsSession, tmp_path: Path
) -> None:
    made = start(session, tmp_path)
    for count in (2, 3):
        Process.started[-1].status = 3
        made.check()
        assert len(Process.started) == count
    Process.started[-1].status = 3
    with pytest.raises(LostError, match="ended with status 3"):
        made.check()


def test_an_answer_in_between_counts(session: DynamicsSession, tmp_path: Path) -> None:
    made = start(session, tmp_path)
    known = session.participants["aero"]
    for count in range(2, 7):
        known.payload = bytes([count])
        Process.started[-1].status = -11
        made.check()
        assert len(Process.started) == count
