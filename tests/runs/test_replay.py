"""Replay: every message once, in order, under the keys of the run; at the rate asked for."""

from __future__ import annotations

import json
import math
import os
import pty
import signal
import subprocess
import sys
import termios
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import zenoh

from linkwind.bus.zenoh import ZenohPlayer, ZenohProviderLink, loopback_endpoint, open_session
from linkwind.cli.keys import keys
from linkwind.errors import InputError, LostError
from linkwind.log.reader import open_log
from linkwind.runs.replay import TICK, Replayed, Selection, Steering, replay
from linkwind.runs.run import run
from linkwind.scenario import load
from linkwind.schema import MESSAGES

STEPS, PATIENCE = 300, 60.0


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    settings = [f"time.end={STEPS / 1000}", "bus.transport=inprocess"]
    return run(load("two_link", settings), tmp_path_factory.mktemp("run") / "out", lambda step: None).log


def recorded(log: Path, *topics: str) -> list[tuple[str, bytes]]:
    """What must arrive: key and payload."""
    opened = open_log(log)
    wanted = topics or ("/motion", "/wrench/aero")
    return [(f"linkwind/v1/{opened.run}{m.topic}", m.payload) for m in opened.raw(*wanted)]


class Subscriber:
    """A stranger on the bus that keeps what comes, by the expression that it came for."""

    def __init__(self, endpoint: str, *expressions: str, enough: int) -> None:
        self.got: list[tuple[str, bytes]] = []
        self.present: list[tuple[str, bool]] = []
        self.done, self.gone = threading.Event(), threading.Event()
        self._enough = enough
        self.session = open_session([], [endpoint], "observer")
        self._presence = self.session.liveliness().declare_subscriber(
            "linkwind/v1/*/alive/*", self._on_presence, history=True
        )
        self._subscribers = [self.session.declare_subscriber(e, self._on_sample) for e in expressions]

    def _on_sample(self, sample: zenoh.Sample) -> None:
        self.got.append((str(sample.key_expr), sample.payload.to_bytes()))
        if len(self.got) >= self._enough:
            self.done.set()

    def _on_presence(self, sample: zenoh.Sample) -> None:
        there = sample.kind == zenoh.SampleKind.PUT
        self.present.append((str(sample.key_expr).rsplit("/", 1)[1], there))
        if sum(not there for _, there in self.present) == 2:
            self.gone.set()

    def await_count(self, count: int) -> None:
        self.done.clear()
        self._enough = count
        assert len(self.got) >= count or self.done.wait(PATIENCE)

    def close(self) -> None:
        self.session.close()


@pytest.mark.parametrize("rate", [0.0, 1.0])
def test_every_message_once_and_in_order(log: Path, rate: float) -> None:
    endpoint, expected = loopback_endpoint(), recorded(log)
    assert len(expected) == 2 * (STEPS + 1) + 1
    with closing(Subscriber(endpoint, "linkwind/v1/out/**", enough=len(expected))) as subscriber:
        done = replay(open_log(log), Selection(rate), listen=[endpoint], connect=[])
        assert subscriber.done.wait(PATIENCE)
        assert subscriber.gone.wait(PATIENCE)
        assert subscriber.got == expected
        assert sorted(subscriber.present[:2]) == [("aero", True), ("dynamics", True)]
    assert done.messages == len(expected)
    assert (done.late_ms is None) == (rate == 0.0)
    if rate:
        assert done.wall_s >= STEPS / 1000


def test_separate_subscribers_get_their_topics_in_order(log: Path) -> None:
    endpoint, expected = loopback_endpoint(), recorded(log)
    keys = ("linkwind/v1/*/wrench/*", "linkwind/v1/*/motion")
    with closing(Subscriber(endpoint, *keys, enough=len(expected))) as subscriber:
        replay(open_log(log), Selection(0.0), listen=[endpoint], connect=[])
        assert subscriber.done.wait(PATIENCE)
        for topic in ("/motion", "/wrench/aero"):
            mine = recorded(log, topic)
            assert [message for message in subscriber.got if message[0] == mine[0][0]] == mine


def test_many_messages_as_fast_as_possible(tmp_path: Path) -> None:
    """More than all queues on the way can hold, to a subscriber that takes its time."""
    settings = ["time.end=5", "bus.transport=inprocess"]
    long = run(load("two_link", settings), tmp_path / "out", lambda step: None).log
    endpoint, expected = loopback_endpoint(), recorded(long)
    with closing(Subscriber(endpoint, "linkwind/v1/out/**", enough=len(expected))) as subscriber:
        keep = subscriber.got.append
        subscriber.got = Slow(keep)  # type: ignore[assignment]
        replay(open_log(long), Selection(0.0), listen=[endpoint], connect=[])
        assert subscriber.done.wait(PATIENCE)
        assert list(subscriber.got) == expected


class Slow(list[Any]):
    """A list that takes a while to append to."""

    def __init__(self, keep: Any) -> None:
        super().__init__()

    def append(self, item: Any) -> None:
        sum(range(2000))
        super().append(item)


def test_who_wants_to_take_part_is_refused(log: Path) -> None:
    endpoint = loopback_endpoint()
    with (
        closing(ZenohPlayer("out", {"/motion": "/motion"}, ["dynamics"], [endpoint], [])),
        closing(ZenohProviderLink([endpoint], [], name="aero")) as link,
    ):
        hello = MESSAGES["Control"](hello={"name": "aero"}).SerializeToString()
        reply = MESSAGES["Control"].FromString(link.request(hello, PATIENCE))
    assert reply.refuse.reason == "run out is a replay; nobody can take part in it"


class FakeTime:
    """A clock that only sleeping moves, always half a millisecond too far."""

    def __init__(self) -> None:
        self.now = 100.0

    def perf_counter(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds + 0.5e-3


class FakePlayer:
    """Keeps what is published and when; interrupts at a number of messages."""

    made: FakePlayer
    subscribed = True
    stop_at = -1

    def __init__(self, *arguments: Any) -> None:
        FakePlayer.made = self
        self.run, self.topics, self.participants, *_ = arguments
        self.sent: list[tuple[float, str, bytes]] = []
        self.closed = False
        self.heard = True

    def wait(self, timeout: float, grace: float) -> bool:
        return FakePlayer.subscribed

    def put(self, topic: str, payload: bytes) -> None:
        if len(self.sent) == FakePlayer.stop_at:
            raise KeyboardInterrupt
        self.sent.append((clock.now, topic, payload))

    def close(self) -> None:
        self.closed = True


clock = FakeTime()


@pytest.fixture
def faked(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    clock.now = 100.0
    monkeypatch.setattr("linkwind.runs.replay.time", clock)
    monkeypatch.setattr("linkwind.bus.zenoh.ZenohPlayer", FakePlayer)
    monkeypatch.setattr(FakePlayer, "subscribed", True)
    monkeypatch.setattr(FakePlayer, "stop_at", -1)
    yield
    assert FakePlayer.made.closed


def play(log: Path, *arguments: Any, **options: Any) -> tuple[Replayed, list[tuple[float, str, bytes]]]:
    done = replay(open_log(log), Selection(*arguments, **options), listen=["x"], connect=[])
    return done, FakePlayer.made.sent


@pytest.mark.usefixtures("faked")
@pytest.mark.parametrize("rate", [0.5, 1.0, 4.0])
def test_time_passes_at_the_rate(log: Path, rate: float) -> None:
    done, sent = play(log, rate)
    messages = open_log(log).raw("/motion", "/wrench/aero")
    late = [
        wall - 100.0 - message.time_ns / 1e9 / rate
        for (wall, _, _), message in zip(sent, messages, strict=True)
    ]
    assert min(late) >= -1e-9
    assert max(late) <= 0.5e-3 + 1e-9  # one sleep, never the sum of them
    ranked = [1e3 * sorted(late)[math.ceil(share * len(late)) - 1] for share in (0.5, 0.99)]
    assert done.late_ms == tuple(pytest.approx(value, abs=0.011) for value in ranked)
    assert done.wall_s == pytest.approx(STEPS / 1000 / rate, abs=1e-3)
    assert done.as_json().keys() == {"messages", "wall_s", "late_ms"}


@pytest.mark.usefixtures("faked")
def test_start_end_and_topics(log: Path) -> None:
    done, sent = play(log, 1.0, 0.1, 0.2, ("/wrench/aero",))
    assert list(FakePlayer.made.topics) == ["/wrench/aero"]
    assert done.messages == 101
    steps = [MESSAGES["WrenchStep"].FromString(payload).step for _, _, payload in sent]
    assert steps == list(range(100, 201))
    assert sent[0][0] == 100.0  # the first one at once
    _, sent = play(log, 0.0, end=0.0)
    assert [topic for _, topic, _ in sent] == ["/motion", "/wrench/aero"]
    assert FakePlayer.made.participants == ["dynamics", "aero"]


@pytest.mark.usefixtures("faked")
def test_loop_begins_again_until_interrupted(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FakePlayer, "stop_at", 25)
    with pytest.raises(KeyboardInterrupt):
        play(log, 1.0, None, 0.009, ("/motion",), loop=True)
    sent = FakePlayer.made.sent
    steps = [MESSAGES["MotionStep"].FromString(payload).step for _, _, payload in sent]
    assert steps == [*range(10), *range(10), *range(5)]
    assert sent[10][0] >= sent[9][0]
    assert sent[24][0] - sent[20][0] == pytest.approx(0.004, abs=1e-3)


@pytest.mark.usefixtures("faked")
def test_nobody_subscribes(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(FakePlayer, "subscribed", False)
    with pytest.raises(LostError, match=r"nobody subscribed to linkwind/v1/out/\*\* within 60 s"):
        play(log)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((1.0, None, None, ("/state",)), "--topics: expected some of /motion, /wrench/aero, .*; got /state"),
        ((1.0, 7.0), "expected messages of /motion, /wrench/aero from 7 s to inf s; got none"),
        ((1.0, 0.2, 0.1), "from 0.2 s to 0.1 s; got none"),
        ((float("nan"),), "--rate: expected a number >= 0"),
        ((float("inf"),), "--rate: expected a number >= 0"),
        ((-1.0,), "--rate: expected a number >= 0"),
    ],
)
def test_what_makes_no_sense_is_refused(log: Path, arguments: tuple[Any, ...], text: str) -> None:
    with pytest.raises(InputError, match=text):
        play(log, *arguments)


def test_steering_holds_and_lets_single_points_pass() -> None:
    steering = Steering()
    assert [steering.holds(t) for t in (0, 0, 1)] == [False, False, False]
    steering.toggle()
    assert not steering.holds(1)  # the point that has begun is finished
    assert steering.holds(2)
    assert steering.holds(2)
    steering.step()
    assert [steering.holds(t) for t in (2, 2, 3)] == [False, False, True]
    steering.step()
    steering.step()
    assert [steering.holds(t) for t in (3, 4, 4, 5)] == [False, False, False, True]
    steering.toggle()
    assert not steering.holds(5)
    steering.step()  # while it goes on: pauses after the next one
    assert [steering.holds(t) for t in (5, 6, 6, 7)] == [False, False, False, True]


@pytest.mark.usefixtures("faked")
def test_a_pause_makes_nothing_late(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steering, slept = Steering(), clock.sleep

    def sleep(seconds: float) -> None:
        slept(seconds)
        if seconds == TICK and clock.now > 110.0:
            steering.toggle()

    monkeypatch.setattr(clock, "sleep", sleep)
    put = FakePlayer.put

    def pause(player: FakePlayer, topic: str, payload: bytes) -> None:
        put(player, topic, payload)
        if len(player.sent) == 100:
            steering.toggle()

    monkeypatch.setattr(FakePlayer, "put", pause)
    done = replay(open_log(log), Selection(), listen=["x"], connect=[], steering=steering)
    sent = FakePlayer.made.sent
    assert done.messages == len(sent) == 2 * (STEPS + 1) + 1
    assert sent[99][0] < 100.1
    assert sent[100][0] > 110.0
    assert sent[-1][0] - sent[100][0] == pytest.approx((STEPS - 50) / 1000, abs=2e-3)
    assert done.late_ms is not None
    assert done.late_ms[1] < 1.0


def test_keys_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    ours, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    pressed = threading.Event()
    seen: list[str] = []
    with os.fdopen(terminal, "r") as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        with keys({" ": lambda: seen.append("space"), ".": pressed.set}):
            os.write(ours, b" x .")
            assert pressed.wait(PATIENCE)
            assert seen == ["space", "space"]
        assert termios.tcgetattr(terminal) == before
    os.close(ours)


def test_paused_stepped_and_resumed_from_the_keyboard(log: Path) -> None:
    endpoint, expected = loopback_endpoint(), recorded(log)
    ours, terminal = pty.openpty()
    with closing(Subscriber(endpoint, "linkwind/v1/out/**", enough=1)) as subscriber:
        process = start(log, endpoint, "--rate", "0.2", stdin=terminal)
        os.close(terminal)
        try:
            assert subscriber.done.wait(PATIENCE)
            os.write(ours, b" ....")
            subscriber.await_count(
                min(len(subscriber.got) + 2, len(expected))
            )  # paused, it goes on by the steps alone
            os.write(ours, b" ")
            subscriber.await_count(len(expected))
            output, errors = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            process.wait()
        assert process.returncode == 0, errors
        assert subscriber.got == expected
    assert f"{len(expected)} messages" in output
    os.close(ours)


def start(log: Path, endpoint: str, *options: str, stdin: int = subprocess.DEVNULL) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "linkwind", "replay", str(log), "--listen", endpoint, *options],
        stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def test_command(log: Path) -> None:
    endpoint, expected = loopback_endpoint(), recorded(log)
    with closing(Subscriber(endpoint, "linkwind/v1/out/**", enough=len(expected))) as subscriber:
        process = start(log, endpoint, "--rate", "20", "--topics", "/motion,/wrench/aero", "--json")
        output, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0, errors
        assert subscriber.done.wait(PATIENCE)
        assert subscriber.got == expected
    summary = json.loads(output)
    assert summary.keys() == {"messages", "wall_s", "late_ms"}
    assert summary["messages"] == len(expected)
    assert 0.0 <= summary["late_ms"]["median"] <= summary["late_ms"]["p99"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
def test_interrupted_replay_leaves_the_bus(log: Path, number: int) -> None:
    endpoint = loopback_endpoint()
    with closing(Subscriber(endpoint, "linkwind/v1/out/**", enough=1000)) as subscriber:
        process = start(log, endpoint, "--loop")
        try:
            assert subscriber.done.wait(PATIENCE)
            os.kill(process.pid, number)
            _, errors = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            process.wait()
        assert process.returncode == 130
        assert "Traceback" not in errors
        assert subscriber.gone.wait(PATIENCE)
        whole = recorded(log)
        again_and_again = whole * (len(subscriber.got) // len(whole) + 1)
        assert subscriber.got == again_and_again[: len(subscriber.got)]
