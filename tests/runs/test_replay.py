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
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import zenoh

from linkwind.bus.zenoh import ZenohPlayer, ZenohProviderLink, loopback_endpoint, open_session
from linkwind.cli.keys import keys
from linkwind.errors import InputError, LostError
from linkwind.log.reader import open_log
from linkwind.runs.playback import TICK, Steering
from linkwind.runs.replay import Replayed, Selection, replay
from linkwind.runs.run import run
from linkwind.scenario import load
from linkwind.schema import MESSAGES

STEPS, PATIENCE = 300, 60.0
NOTHING: dict[str, Any] = {"topics": [], "description": b"", "playback": lambda request: b""}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    settings = [f"time.end={STEPS / 1000}", "bus.transport=inprocess"]
    return run(
        load("two_link", settings), tmp_path_factory.mktemp("run") / "out", lambda step: None, report=False
    ).log


def recorded(log: Path, *topics: str) -> list[tuple[str, bytes]]:
    """What must arrive: key and payload."""
    opened = open_log(log)
    wanted = topics or ("/motion", "/wrench/aero")
    return [(f"linkwind/v1/{opened.run}{m.topic}", m.payload) for m in opened.raw(*wanted)]


def as_logged(log: Path) -> list[tuple[str, bytes]]:
    """What listeners must hear, but for the end."""
    opened = open_log(log)
    topics = ("/motion", "/wrench/aero", "/state", "/step", "/timing")
    return [(f"linkwind/v1/{opened.run}/log{m.topic}", m.payload) for m in opened.raw(*topics)]


class Subscriber:
    """A stranger on the bus that keeps what comes, by the expression that it came for."""

    def __init__(self, endpoint: str, *expressions: str, enough: int) -> None:
        self.got: list[tuple[str, bytes]] = []  # what participants exchange
        self.heard: list[tuple[str, bytes]] = []  # what the dynamics tells of its log
        self.present: list[tuple[str, bool]] = []
        self.done, self.gone = threading.Event(), threading.Event()
        self._enough = enough
        self.session = open_session([], [endpoint], "observer")
        self._presence = self.session.liveliness().declare_subscriber(
            "linkwind/v1/*/alive/*", self._on_presence, history=True
        )
        self._subscribers = [self.session.declare_subscriber(e, self._on_sample) for e in expressions]

    def _on_sample(self, sample: zenoh.Sample) -> None:
        if "/log/" in str(sample.key_expr):
            self.heard.append((str(sample.key_expr), sample.payload.to_bytes()))
            return
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
        done = replay(open_log(log), Selection(), listen=[endpoint], connect=[], steering=Steering(rate))
        assert subscriber.done.wait(PATIENCE)
        assert subscriber.gone.wait(PATIENCE)
        assert subscriber.got == expected
        *told, end = subscriber.heard
        assert told == as_logged(log)
        assert end[0] == "linkwind/v1/out/log/end"
        assert sorted(subscriber.present[:2]) == [("aero", True), ("dynamics", True)]
    assert done.messages == len(expected) + len(recorded(log, "/state", "/step", "/timing"))
    assert (done.late_ms is None) == (rate == 0.0)
    if rate:
        assert done.wall_s >= STEPS / 1000


def test_separate_subscribers_get_their_topics_in_order(log: Path) -> None:
    endpoint, expected = loopback_endpoint(), recorded(log)
    keys = ("linkwind/v1/*/wrench/*", "linkwind/v1/*/motion")
    with closing(Subscriber(endpoint, *keys, enough=len(expected))) as subscriber:
        replay(open_log(log), Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
        assert subscriber.done.wait(PATIENCE)
        for topic in ("/motion", "/wrench/aero"):
            mine = recorded(log, topic)
            assert [message for message in subscriber.got if message[0] == mine[0][0]] == mine


def test_many_messages_as_fast_as_possible(tmp_path: Path) -> None:
    """More than all queues on the way can hold, to a subscriber that takes its time."""
    settings = ["time.end=5", "bus.transport=inprocess"]
    long = run(load("two_link", settings), tmp_path / "out", lambda step: None, report=False).log
    endpoint, expected = loopback_endpoint(), recorded(long)
    with closing(Subscriber(endpoint, "linkwind/v1/out/**", enough=len(expected))) as subscriber:
        keep = subscriber.got.append
        subscriber.got = Slow(keep)  # type: ignore[assignment]
        replay(open_log(long), Selection(), listen=[endpoint], connect=[], steering=Steering(0.0))
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
        closing(ZenohPlayer("out", {"/motion": "/motion"}, ["dynamics"], [endpoint], [], **NOTHING)),
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


class Silence:
    """A log that nobody listens to."""

    def wants(self, topic: str) -> bool:
        return False

    def end(self, payload: bytes) -> None:
        pass


class FakePlayer:
    """Keeps what is published and when; interrupts at a number of messages."""

    made: FakePlayer
    subscribed = True
    stop_at = -1

    def __init__(self, *arguments: Any, **more: Any) -> None:
        FakePlayer.made = self
        self.run, self.topics, self.participants, *_ = arguments
        self.rename = more["rename"]
        self.log = Silence()
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
    for module in ("replay", "playback"):
        monkeypatch.setattr(f"linkwind.runs.{module}.time", clock)
    monkeypatch.setattr("linkwind.bus.zenoh.ZenohPlayer", FakePlayer)
    monkeypatch.setattr(FakePlayer, "subscribed", True)
    monkeypatch.setattr(FakePlayer, "stop_at", -1)
    yield
    assert FakePlayer.made.closed


def play(
    log: Path, rate: float = 1.0, *selection: Any, loop: bool = False, **options: Any
) -> tuple[Replayed, list[tuple[float, str, bytes]]]:
    steering = Steering(rate, loop=loop)
    chosen = Selection(*selection, **options)
    done = replay(open_log(log), chosen, listen=["x"], connect=[], steering=steering)
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
    late = late[::2][:-1] + late[-1:]  # of each point: its motion
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
        ((1.0, None, None, ("/lift",)), "--topics: expected some of /motion, /wrench/aero, .*; got /lift"),
        ((1.0, 7.0), "expected messages of /motion, .* from 7 s to inf s; got none"),
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
    assert [steering.holds(t) for t in (0, 1)] == [False, False]
    steering.toggle()
    assert [steering.holds(2) for _ in range(2)] == [True, True]
    steering.step()
    assert [steering.holds(t) for t in (2, 3)] == [False, True]
    steering.step()
    steering.step()
    assert [steering.holds(t) for t in (3, 4, 5)] == [False, False, True]
    steering.toggle()
    assert not steering.holds(5)
    steering.step()  # while it goes on: pauses after the next one
    assert [steering.holds(t) for t in (6, 7)] == [False, True]


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
    assert " messages in " in output
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


# ---- seek, rate, other keys: what is published is exact, whatever was asked for ----


def steps_of(sent: list[tuple[float, str, bytes]]) -> list[int]:
    return [
        MESSAGES["MotionStep"].FromString(payload).step for _, topic, payload in sent if topic == "/motion"
    ]


@pytest.mark.usefixtures("faked")
def test_seek_and_rate_while_it_plays(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steering, put = Steering(), FakePlayer.put
    asked: dict[int, Callable[[], None]] = {
        50: lambda: steering.seek(200_000_000),
        60: lambda: steering.seek_by(-0.1),
        80: lambda: steering.scale(4.0),
    }

    def ask(player: FakePlayer, topic: str, payload: bytes) -> None:
        put(player, topic, payload)
        asked.get(len(player.sent), lambda: None)()

    monkeypatch.setattr(FakePlayer, "put", ask)
    selection = Selection(topics=("/motion",), end=0.25)
    replay(open_log(log), selection, listen=["x"], connect=[], steering=steering)
    sent = FakePlayer.made.sent
    assert steps_of(sent) == [*range(50), *range(200, 210), *range(109, 251)]
    wall = [at for at, _, _ in sent]
    assert wall[59] - wall[50] == pytest.approx(0.009, abs=1e-3)
    assert wall[79] - wall[60] == pytest.approx(0.019, abs=1e-3)
    assert wall[-1] - wall[79] == pytest.approx((250 - 128) / 4000, abs=2e-3)


@pytest.mark.usefixtures("faked")
def test_seek_while_paused_shows_that_point(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    steering, slept = Steering(0.0, paused=True), clock.sleep
    wishes = [
        lambda: steering.seek(120_000_000),
        lambda: steering.seek(10_000_000),
        lambda: steering.step(2),
        lambda: steering.seek(10**15),  # behind the end: the last point
        steering.toggle,
    ]

    def sleep(seconds: float) -> None:
        slept(seconds)
        if wishes:
            wishes.pop(0)()

    monkeypatch.setattr(clock, "sleep", sleep)
    selection = Selection(topics=("/motion",), end=0.2)
    replay(open_log(log), selection, listen=["x"], connect=[], steering=steering)
    assert steps_of(FakePlayer.made.sent) == [120, 10, 11, 12, 200]


@pytest.mark.usefixtures("faked")
def test_other_keys(log: Path) -> None:
    play(log, 0.0, end=0.0, remap=[("/motion", "lab/motion"), ("linkwind/v1/out", "linkwind/v1/copy")])
    rename = FakePlayer.made.rename
    assert rename("linkwind/v1/out/motion") == "lab/motion"
    assert rename("linkwind/v1/out/motions") == "linkwind/v1/copy/motions"
    assert rename("linkwind/v1/out/alive/aero") == "linkwind/v1/copy/alive/aero"


@pytest.mark.parametrize("pair", [("/motion", ""), ("/motion", "/x"), ("linkwind/v1/other", "x")])
def test_other_keys_that_make_no_sense(log: Path, pair: tuple[str, str]) -> None:
    with pytest.raises(InputError, match="--remap: expected linkwind/v1/out, a key below it or a topic"):
        play(log, remap=[pair])


def test_the_state_is_told_and_changed_by_a_message() -> None:
    playback, steering = MESSAGES["Playback"], Steering(2.0)
    steering.begin_ns, steering.end_ns = 0, 1_000_000

    def ask(**wish: Any) -> Any:
        return playback.FromString(steering.answer(playback(**wish).SerializeToString()))

    assert playback.FromString(steering.answer(b"no protobuf")) == ask()
    assert {field.name for field, _ in ask().ListFields()} == set(playback.DESCRIPTOR.fields_by_name)
    assert (ask(paused=True).paused, ask(rate=0.5).rate, ask(loop=True).loop) == (True, 0.5, True)
    assert ask(rate=-1.0).rate == ask(rate=math.nan).rate == 0.5  # no rates
    assert ask(points=3).points == 3
    assert not steering.sought
    ask(time_ns=7)
    assert steering.taken() == 7
    assert (ask(paused=False).paused, ask().points) == (False, 0)


def test_steered_over_the_bus(log: Path) -> None:
    """Paused before its first point, then there and back again, by queries alone."""
    endpoint, playback = loopback_endpoint(), MESSAGES["Playback"]
    expected = recorded(log, "/motion")
    with closing(Subscriber(endpoint, "linkwind/v1/out/motion", enough=1)) as subscriber:

        def ask(**wish: Any) -> Any:
            request = playback(**wish).SerializeToString()
            (reply,) = subscriber.session.get("linkwind/v1/out/playback", payload=request, timeout=PATIENCE)
            return playback.FromString(reply.ok.payload.to_bytes())

        process = start(log, endpoint, "--paused", "--json")
        try:
            wait_until(lambda: ("dynamics", True) in subscriber.present)
            state = ask(points=2)
            assert (state.paused, state.rate, state.end_ns) == (True, 1.0, STEPS * 1_000_000)
            subscriber.await_count(2)
            ask(time_ns=290_000_000)
            subscriber.await_count(3)
            assert ask().time_ns == 290_000_000
            ask(time_ns=280_000_000, rate=0.0, paused=False)
            subscriber.await_count(3 + 22)
            _, errors = process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            process.wait()
        assert process.returncode == 0, errors
        assert subscriber.got == [*expected[:2], expected[290], *expected[280:]]


def wait_until(done: Any) -> None:
    end = time.monotonic() + PATIENCE
    while not done():
        assert time.monotonic() < end
        time.sleep(0.01)
