"""Listening to runs: everything comes, in the bytes of the run's own log; what does not come is told.

A run cannot be disturbed by who listens: it makes the same bits beside a recorder that is stopped or killed.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from linkwind.aero.service import serve, session
from linkwind.bus.zenoh import ZenohListener, ZenohProviderLink, loopback_endpoint, open_session
from linkwind.bus.zenoh import session as session_settings
from linkwind.cli import app
from linkwind.errors import InputError, LinkwindError, LostError
from linkwind.listening import described
from linkwind.log.reader import Log, open_log
from linkwind.runs.diff import diff
from linkwind.runs.listen import Recording, listen_to
from linkwind.runs.playback import Steering
from linkwind.runs.replay import Selection, replay
from linkwind.runs.restart import restart
from linkwind.runs.run import Ends, dynamics, run
from linkwind.runs.verify import scenario_of, verify
from linkwind.scenario import load
from tests.runs.edit import rewrite
from tests.runs.test_resume import cut

PATIENCE = 60.0


class Job(threading.Thread):
    """Something that is done beside, and what came of it."""

    def __init__(self, job: Any) -> None:
        super().__init__(daemon=True)
        self.result: Any = None
        self.error: LinkwindError | None = None
        self._job = job
        self.start()

    def run(self) -> None:
        try:
            self.result = self._job()
        except LinkwindError as error:
            self.error = error

    def done(self) -> Any:
        self.join(PATIENCE)
        assert not self.is_alive()
        return self.result


def provide(endpoint: str) -> None:
    with closing(ZenohProviderLink([endpoint], [], name="aero")) as link:
        serve(link, session("aero"), PATIENCE)


def fly(
    folder: Path, endpoint: str, *settings: str, name: str = "two_link", listened: bool = False, **parts: Any
) -> Log:
    """Run the dynamics here, its provider in a thread that starts once ``before`` has been called.

    ``progress`` is called between two steps, and may hold the run.
    """
    scenario = load(name, list(settings))
    before, progress = parts.get("before", lambda: None), parts.get("progress", lambda step: None)
    provider = Job(lambda: (before(), provide(endpoint)))
    try:
        dynamics(scenario, folder, progress, Ends([endpoint], []), run_id="r", listened=listened)
    finally:
        provider.done()
    return open_log(folder / "log.mcap")


def listening(endpoint: str, folder: Path, **more: Any) -> Job:
    """Record in a thread."""
    return Job(
        lambda: listen_to(listen=[], connect=[endpoint], run="*", out=folder, timeout=PATIENCE, **more)
    )


@pytest.fixture(autouse=True)
def no_signals(monkeypatch: pytest.MonkeyPatch) -> None:
    """Signals are the main thread's; here several jobs go on beside each other."""

    @contextmanager
    def nothing() -> Iterator[None]:
        yield

    for module in ("listen", "keeping"):
        monkeypatch.setattr(f"linkwind.runs.{module}.stops_as_interrupt", nothing)


@pytest.fixture
def long_lease(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both sides of a run are in this process, which a loaded machine may give no time for a second."""
    monkeypatch.setattr(session_settings, "LEASE", 10.0)


def heard_from_the_start(folder: Path, *settings: str, name: str = "two_link") -> tuple[Log, Recording]:
    """Run with a recorder that listens before the provider is there."""
    endpoint, there = loopback_endpoint(), threading.Event()
    recorder = listening(endpoint, folder / "heard", found=lambda run, scenario: there.set())
    try:
        own = fly(folder / "own", endpoint, *settings, name=name, before=lambda: there.wait(PATIENCE))
    except LinkwindError:
        own = open_log(folder / "own" / "log.mcap")
    recording = recorder.done()
    assert recorder.error is None
    return own, recording


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("two_link", ("time.end=0.3",)),
        (
            "two_link_flow",
            ("time.end=0.001", "aero.flow.cells=16", "aero.flow.frames=2", "log.checkpoint_every=10"),
        ),
    ],
)
def test_a_log_from_the_start_is_the_run_s_own(name: str, settings: tuple[str, ...], tmp_path: Path) -> None:
    own, recording = heard_from_the_start(tmp_path, *settings, name=name)
    heard = open_log(recording.log)
    assert (recording.missed, recording.error) == ("", "")
    assert (heard.complete, heard.final_state_sha256) == (True, own.final_state_sha256)
    assert list(heard.raw()) == list(own.raw())  # pictures for Foxglove included, in the same order
    assert heard.topics == own.topics
    assert (heard.metadata, heard.versions) == (own.metadata, own.versions)
    assert (heard.diagnostics, heard.scenario_json) == (own.diagnostics, own.scenario_json)
    assert heard.info.missed == {}
    assert diff(own.path, heard.path).identical
    assert verify(*scenario_of(heard.path)).identical
    if name == "two_link_flow":
        assert {topic.rsplit("/", 1)[0] for topic in heard.topics} >= {"/flow", "/checkpoint", "/wrench"}


@pytest.mark.usefixtures("long_lease")
def test_who_comes_late_says_what_is_missing(tmp_path: Path) -> None:
    """The recorder starts when half of the messages have passed; until it is there, nothing more happens."""
    endpoint, folder = loopback_endpoint(), tmp_path / "heard"
    half, there = threading.Event(), threading.Event()

    def progress(step: int) -> None:
        if step >= 750:
            half.set()
            there.wait(PATIENCE)

    runner = Job(lambda: fly(tmp_path / "own", endpoint, "time.end=1.5", progress=progress))
    assert half.wait(PATIENCE)
    recording = listening(endpoint, folder, found=lambda run, scenario: there.set()).done()
    runner.done()
    assert runner.error is None
    heard, own_log = open_log(recording.log), runner.result
    missed = heard.info.missed
    assert missed.keys() == {"/motion", "/wrench/aero", "/state", "/step", "/timing"}
    for topic, count in missed.items():
        assert 0 < count < own_log.topics[topic]
        assert heard.topics[topic] + count == own_log.topics[topic]
        numbers = [number for _, number, _, _ in heard.messages(topic)]
        assert numbers == list(range(count + 1, own_log.topics[topic] + 1))
    assert f"missed {missed['/state']} of 1501 messages (number 1–{missed['/state']}) of " in recording.missed
    assert not heard.complete
    assert heard.error == f"MissedError: {recording.missed}"
    found = verify(*scenario_of(heard.path))
    assert found.identical
    assert recording.missed in found.remark
    shown = CliRunner().invoke(app, ["log", "info", str(heard.path)]).stdout
    assert "heard on the bus by linkwind record" in shown
    assert recording.missed in shown


def test_a_run_that_awaits_its_listener(tmp_path: Path) -> None:
    """The provider is there at once, the recorder later; nothing is missed."""
    endpoint = loopback_endpoint()
    runner = Job(lambda: fly(tmp_path / "own", endpoint, "time.end=0.1", listened=True))
    time.sleep(0.5)
    recording = listening(endpoint, tmp_path / "heard").done()
    own = runner.done()
    assert (recording.missed, recording.error) == ("", "")
    assert list(open_log(recording.log).raw()) == list(own.raw())
    alone = loopback_endpoint()
    settings = ["bus.start_timeout=0.3", "time.end=0.1"]
    with pytest.raises(LostError, match=r"nobody listened within 0\.3 s \(bus\.start_timeout\)"):
        dynamics(
            load("two_link", settings), tmp_path / "alone", lambda step: None,
            Ends([alone], []), run_id="r", listened=True,
        )  # fmt: skip


def test_a_run_that_fails_is_recorded_to_its_end(tmp_path: Path) -> None:
    settings = ("aero.field.link1.fx='1/(t-0.02)**2'", "time.end=0.04")
    own, recording = heard_from_the_start(tmp_path, *settings, name="two_link_field")
    heard = open_log(recording.log)
    assert recording.missed == ""
    assert own.error is not None
    assert recording.error == own.error == heard.error
    assert list(heard.raw()) == list(own.raw())


# ---- what happens to the recorder does not happen to the run ----


def command(endpoint: str, folder: Path) -> subprocess.Popen[str]:
    arguments = ["record", "--connect", endpoint, "--out", str(folder), "--json"]
    return subprocess.Popen(
        [sys.executable, "-m", "linkwind", *arguments],
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def wait_for(file: Path, size: int) -> None:
    end = time.monotonic() + PATIENCE
    while not file.exists() or file.stat().st_size < size:
        assert time.monotonic() < end
        time.sleep(0.001)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> str:
    digest = fly(
        tmp_path_factory.mktemp("alone") / "own", loopback_endpoint(), "time.end=1.2"
    ).final_state_sha256
    assert digest is not None
    return digest


@pytest.mark.usefixtures("long_lease")
@pytest.mark.parametrize("what", ["killed", "stopped for a while", "told to end"])
def test_the_run_is_not_disturbed(what: str, undisturbed: str, tmp_path: Path) -> None:
    """The run is held in its middle until that has happened to the recorder."""
    endpoint, file = loopback_endpoint(), tmp_path / "heard" / "log.mcap"
    recorder, happened = command(endpoint, tmp_path / "heard"), threading.Event()
    parts = {
        "before": lambda: wait_for(file, 1),
        "progress": lambda step: step < 600 or happened.wait(PATIENCE),
    }
    try:
        runner = Job(lambda: fly(tmp_path / "own", endpoint, "time.end=1.2", "coupling.timeout=60", **parts))
        wait_for(file, 80_000)
        if what == "killed":
            recorder.kill()
        elif what == "told to end":
            recorder.terminate()
        else:
            os.kill(recorder.pid, signal.SIGSTOP)
        happened.set()
        if what == "stopped for a while":
            time.sleep(0.3)
            os.kill(recorder.pid, signal.SIGCONT)
        own = runner.done()
        assert runner.error is None
        output, errors = recorder.communicate(timeout=PATIENCE)
    finally:
        recorder.kill()
        recorder.wait()
    assert own.complete
    assert own.final_state_sha256 == undisturbed
    assert "Traceback" not in errors
    heard = open_log(file)
    mine = {(topic, number): payload for topic, number, payload in numbered(own)}
    assert all(mine[topic, number] == payload for topic, number, payload in numbered(heard))
    assert heard.topics["/state"] > 5
    if what == "killed":
        assert heard.damage is not None
    elif what == "told to end":
        assert recorder.returncode == 130
        assert heard.error == "MissedError: the recorder was stopped before the run ended"
    else:
        missed = json.loads(output)["missed"]
        assert (recorder.returncode, not missed) == ((0, True) if heard.complete else (4, False))
        assert heard.complete is (heard.error is None)
        if "the dynamics was lost" not in (missed or ""):  # else nobody has told it how many there were
            for topic, count in heard.info.missed.items():
                assert heard.topics.get(topic, 0) + count == own.topics[topic]


def numbered(log: Log) -> Iterator[tuple[str, int, bytes]]:
    for channel, number, _, payload in log.messages():
        topic = log.channels[channel].topic
        if topic not in ("/tf", "/scene"):
            yield topic, number, payload


SLOW = """
import sys, time
from linkwind.bus.zenoh import open_session

def take(sample):
    print("taken", flush=True)
    time.sleep(0.01)

session = open_session([], [sys.argv[1]], "observer")
subscriber = session.declare_subscriber("linkwind/v1/*/log/**", take)
print("there", flush=True)
time.sleep(60)
"""


def test_a_listener_that_is_too_slow_holds_nobody_up(undisturbed: str, tmp_path: Path) -> None:
    """Six thousand messages come for it; the run is over before it has taken half of them."""
    endpoint = loopback_endpoint()
    with subprocess.Popen([sys.executable, "-c", SLOW, endpoint], stdout=subprocess.PIPE) as slow:
        try:
            assert slow.stdout is not None
            assert slow.stdout.readline() == b"there\n"
            arguments = ["dynamics", "two_link", "--set", "time.end=1.2", "--listen", endpoint, "--json"]
            there = ["--out", str(tmp_path / "own"), "--await-listener"]
            run_ = subprocess.Popen(
                [sys.executable, "-m", "linkwind", *arguments, *there], stdout=subprocess.PIPE, text=True
            )
            provide(endpoint)
            output, _ = run_.communicate(timeout=PATIENCE)
        finally:
            slow.kill()
        taken = len(slow.stdout.read().splitlines())
    assert json.loads(output)["final_state_sha256"] == undisturbed
    assert 0 < taken < 3000


def test_a_lost_dynamics_ends_the_recording(tmp_path: Path) -> None:
    endpoint = loopback_endpoint()
    process = subprocess.Popen(
        [sys.executable, "-m", "linkwind", "dynamics", "two_link", "--listen", endpoint, "--out", "own"],
        cwd=tmp_path, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        there = threading.Event()
        recorder = listening(endpoint, tmp_path / "heard", found=lambda run, scenario: there.set())
        assert there.wait(PATIENCE)
        process.kill()
        recording = recorder.done()
    finally:
        process.kill()
        process.wait()
    assert recording.missed == recording.error == "the dynamics was lost, or the network to it was cut"
    assert open_log(recording.log).error == f"MissedError: {recording.error}"


# ---- a replay is a run to a listener ----


def test_a_replay_is_recorded_like_a_run(tmp_path: Path) -> None:
    endpoint = loopback_endpoint()
    own = fly(tmp_path / "own", endpoint, "time.end=0.2")
    recorder = listening(loopback := loopback_endpoint(), tmp_path / "heard")
    replay(own, Selection(), listen=[loopback], connect=[], steering=Steering(0.0))
    recording = recorder.done()
    assert (recording.missed, recording.error) == ("", "")
    assert list(open_log(recording.log).raw()) == list(own.raw())
    # Less than everything is told as missing.
    recorder = listening(loopback, tmp_path / "part")
    replay(own, Selection(start=0.1), listen=[loopback], connect=[], steering=Steering(0.0))
    assert "missed 100 of 201 messages (number 1–100) of /" in recorder.done().missed


class Stranger:
    """A plain zenoh session that hears everything on the bus, by key."""

    def __init__(self, listen: list[str], connect: list[str]) -> None:
        self.heard: dict[str, list[tuple[bytes, bytes | None]]] = {}
        self.present: list[tuple[str, str]] = []
        self.order: list[str] = []
        self.session = open_session(listen, connect, "observer")
        self._log = self.session.declare_subscriber("linkwind/v1/**", self._take)
        self._alive = self.session.liveliness().declare_subscriber(
            "linkwind/v1/*/alive/*",
            lambda s: self.present.append((str(s.key_expr), str(s.kind))),
            history=True,
        )

    def _take(self, sample: Any) -> None:
        key, attachment = str(sample.key_expr), sample.attachment
        content = sample.payload.to_bytes(), None if attachment is None else attachment.to_bytes()
        if len(content[0]):  # an empty payload means nothing
            self.heard.setdefault(key, []).append(content)
            self.order.append(key)

    def close(self) -> None:
        self.session.close()


def run_beside_a_stranger(folder: Path, settings: list[str]) -> tuple[Log, Stranger]:
    """Both participants connect to a third party, which is all that the bus needs for it to hear both."""
    mine, theirs = loopback_endpoint(), loopback_endpoint()
    with closing(Stranger([mine], [])) as stranger:

        def provider() -> None:
            with closing(ZenohProviderLink([theirs, mine], [], name="aero")) as link:
                serve(link, session("aero"), PATIENCE)

        answering = Job(provider)
        dynamics(
            load("two_link_flow", settings),
            folder,
            lambda step: None,
            Ends([theirs], [mine]),
            run_id="r",
        )
        answering.done()
        wait_until(lambda: [kind for _, kind in stranger.present].count("SampleKind.DELETE") == 2)
    return open_log(folder / "log.mcap"), stranger


def wait_until(done: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_a_stranger_cannot_tell_a_replay_from_the_run(tmp_path: Path) -> None:
    """Same keys, same bytes, same order on each, frames and checkpoints before the wrench; same tokens."""
    settings = ["time.end=0.001", "aero.flow.cells=16", "aero.flow.frames=2", "log.checkpoint_every=10"]
    log, live = run_beside_a_stranger(tmp_path / "own", settings)
    endpoint = loopback_endpoint()
    with closing(Stranger([], [endpoint])) as again:
        replay(log, Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
        wait_until(lambda: [kind for _, kind in again.present].count("SampleKind.DELETE") == 2)
    assert again.heard.keys() == live.heard.keys()
    base = "linkwind/v1/r"
    assert live.heard.keys() >= {f"{base}/motion", f"{base}/wrench/aero", f"{base}/observe/flow/aero"}
    for key in live.heard:
        assert again.heard[key] == live.heard[key], key
    assert sorted(again.present) == sorted(live.present)
    provided = [key for key in live.order if "/wrench/" in key or "/observe/" in key]
    provided = [key for key in provided if "/log/" not in key]
    assert [key for key in again.order if key in set(provided)] == provided


# ---- finding runs ----


def test_runs_are_found_and_told_apart(tmp_path: Path) -> None:
    endpoints = [loopback_endpoint(), loopback_endpoint()]
    log = fly(tmp_path / "one", endpoints[0], "time.end=0.05")
    other = rewrite(log.path, tmp_path / "other.mcap", metadata={"linkwind": {"run": "s"}})
    steering = Steering(paused=True)

    def play(path: Path, endpoint: str) -> None:
        replay(open_log(path), Selection(), listen=[endpoint], connect=[], steering=steering)

    jobs = [Job(partial(play, *each)) for each in zip((log.path, other), endpoints, strict=True)]
    with closing(ZenohListener([], endpoints, "s")) as listener:
        assert described(listener.find(PATIENCE)).run == "s"
        with closing(ZenohListener([], endpoints[:1], "r")) as another:
            assert described(another.find(PATIENCE)).run == "r"
    wait_until(lambda: "expected one run; got r, s. Choose one with --run" in _trouble(endpoints))
    steering.toggle()
    with closing(ZenohListener([], endpoints)):  # the replays wait for somebody who stays
        for job in jobs:
            job.done()
            assert job.error is None


def _trouble(endpoints: list[str]) -> str:
    """Listen to all; while only one run has been heard of, there is none."""
    with closing(ZenohListener([], endpoints)) as listener:
        try:
            listener.find(PATIENCE)
        except LinkwindError as error:
            return str(error)
    return ""


def test_nobody_there(tmp_path: Path) -> None:
    with pytest.raises(LostError, match=r"no run at tcp/.* within 0\.3 s"):
        listen_to(listen=[], connect=[loopback_endpoint()], run="*", out=tmp_path, timeout=0.3)
    with pytest.raises(InputError, match="--run: expected letters"):
        listen_to(listen=[], connect=[loopback_endpoint()], run="a/b", out=tmp_path, timeout=0.3)


@pytest.mark.parametrize("name", ["two_link", "two_link_flow"])
def test_a_run_that_goes_on_is_heard_from_its_beginning(name: str, tmp_path: Path) -> None:
    settings = ["log.checkpoint_every=10", "bus.transport=inprocess"]
    settings += ["time.end=0.06"] if name == "two_link" else [
        "time.end=4e-3", "aero.flow.cells=16", "aero.flow.frames=8",
    ]  # fmt: skip
    whole = run(load(name, settings), tmp_path / "whole" / "out", lambda step: None, report=False)
    (tmp_path / "out").mkdir()
    cut(whole.log, tmp_path / "out" / "log.mcap", sum(open_log(whole.log).topics.values()) // 2)
    endpoint = loopback_endpoint()
    recorder, provider = listening(endpoint, tmp_path / "heard"), Job(lambda: provide(endpoint))
    scenario = load(name, [setting for setting in settings if "inprocess" not in setting])
    restart(scenario, tmp_path / "out", lambda step: None, Ends([endpoint], []), listened=True)
    provider.done()
    assert not recorder.done().missed
    own, heard = open_log(tmp_path / "out" / "log.mcap"), open_log(tmp_path / "heard" / "log.mcap")
    assert own.final_state_sha256 == whole.result.final_state_sha256
    assert heard.complete
    assert list(heard.raw()) == list(own.raw())
    assert heard.metadata == own.metadata
