"""Commands that wait for others say so when others can come, not before."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from typer.testing import CliRunner

from linkwind.bus.zenoh import loopback_endpoint
from linkwind.cli import app
from linkwind.errors import InputError, LostError
from linkwind.runs.run import run
from linkwind.scenario import load


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> str:
    short = load("two_link", ["time.end=0.01", "bus.transport=inprocess", "bus.start_timeout=0.2"])
    return str(run(short, tmp_path_factory.mktemp("run") / "out").log)


WAITING = {
    "dynamics": "waiting for aero: linkwind aero --connect",
    "resume": "waiting for aero: linkwind aero --connect",
    "replay": "waiting at",
    "record": "waiting for a run at",
    "replay --substitute aero": "waiting for aero: linkwind aero --connect",
    "replay --substitute dynamics": "aero: waiting for a dynamics at",
}


def arguments(command: str, log: str) -> list[str]:
    name, *options = command.split()
    settings = {
        "dynamics": ["--set", "bus.start_timeout=0.2"],
        "record": ["--start-timeout", "0.2"],
        "resume": ["--set", "bus.transport=zenoh", "--from-step", "3"],
    }
    source = {"dynamics": ["two_link"], "record": []}.get(name, [log])
    return [name, *source, *options, *settings.get(name, [])]


@pytest.mark.parametrize("command", WAITING)
def test_nobody_is_waited_for_where_nobody_can_come(command, log, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with socket.create_server(("127.0.0.1", 0)) as other:
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        done = CliRunner().invoke(app, [*arguments(command, log), "--listen", endpoint])
    assert isinstance(done.exception, InputError)
    assert f"cannot listen on {endpoint}" in str(done.exception)
    assert "waiting" not in done.output
    assert [path for path in tmp_path.rglob("*") if path != tmp_path / "runs"] == []


@pytest.mark.parametrize("command", WAITING)
def test_whoever_waits_says_where(command, log, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    endpoint = loopback_endpoint()
    done = CliRunner().invoke(app, [*arguments(command, log), "--listen", endpoint])
    assert isinstance(done.exception, LostError)
    assert f"{WAITING[command]} {endpoint}" in done.output
