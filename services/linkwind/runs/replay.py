"""Publish a log on the bus again: the same messages under the same keys, in the order of the run."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from linkwind.credentials import Identity
from linkwind.errors import InputError, LostError
from linkwind.log.contents import FLOW, MOTION, WRENCH
from linkwind.log.reader import Log
from linkwind.scenario import from_json

GRACE = 0.5  # s for subscribers of further topics, once there is one
PROGRESS = 0.1  # s of wall clock between two words about progress
TICK = 0.02  # s between two looks while paused
RESOLUTION = 1e-5  # s in which lateness is counted, so that memory does not grow with the replay


@dataclass(frozen=True)
class Replayed:
    """A finished replay.

    Attributes:
        messages: published.
        wall_s: wall clock from the first to the last of them [s].
        late_ms: median and 99th percentile of how late a message was published [ms]; None at rate 0, where
            none is due.
        heard: whether somebody was still listening at the end.
    """

    messages: int
    wall_s: float
    late_ms: tuple[float, float] | None
    heard: bool

    def as_json(self) -> dict[str, Any]:
        """Return the replay with the keys of ``linkwind replay --json``."""
        median, p99 = self.late_ms or (None, None)
        return {
            "messages": self.messages,
            "wall_s": self.wall_s,
            "late_ms": {"median": median, "p99": p99},
        }


@dataclass(frozen=True)
class Selection:
    """What is replayed.

    Attributes:
        rate: simulation time over wall-clock time; 0 for as fast as the subscribers can.
        start: simulation time to begin at [s]; None for the beginning of the log.
        end: simulation time to end at, itself included [s]; None for the end of the log.
        topics: such as ``/motion``; empty for all that a run publishes.
        loop: begin again at the end, until interrupted.
    """

    rate: float = 1.0
    start: float | None = None
    end: float | None = None
    topics: Sequence[str] = ()
    loop: bool = False


class Steering:
    """Pauses a replay and lets single communication points pass; may be used from another thread."""

    def __init__(self) -> None:
        self._paused = False
        self._steps = 0
        self._at = -1  # simulation time of the communication point that passes [ns]

    def toggle(self) -> None:
        """Pause, or go on."""
        self._paused = not self._paused
        self._steps = 0

    def step(self) -> None:
        """Pause, and let the messages of one more communication point pass."""
        self._steps = self._steps + 1 if self._paused else 1
        self._paused = True

    def holds(self, time_ns: int) -> bool:
        """Tell whether a message of simulation time ``time_ns`` has to wait; asked again until it has not."""
        if self._paused and time_ns != self._at:
            if not self._steps:
                return True
            self._steps -= 1
        self._at = time_ns
        return False


def replay(
    log: Log,
    selection: Selection,
    *,
    listen: Sequence[str],
    connect: Sequence[str],
    identity: Identity | None = None,
    progress: Callable[[float], None] = lambda t: None,
    steering: Steering | None = None,
) -> Replayed:
    """Wait for a subscriber, then publish.

    Args:
        log: of the run.
        selection: what of it, how fast.
        listen: zenoh endpoints to listen on.
        connect: zenoh endpoints to connect to.
        identity: the dynamics' certificate; None without TLS.
        progress: is told now and then the simulation time [s].
        steering: pauses it; None for no pause.

    Raises:
        InputError: a topic, a time or the rate is wrong, or an endpoint cannot be opened.
        LostError: nobody subscribed within bus.start_timeout of the scenario.
    """
    from linkwind.bus.zenoh import ZenohPlayer

    topics = _topics(log, selection)
    _check(log, selection, topics)
    timeout = from_json(log.scenario_json).bus.start_timeout
    participants = ["dynamics", *log.provider_bodies]
    keys = {topic: f"/observe{topic}" if topic.startswith(FLOW) else topic for topic in topics}
    with closing(ZenohPlayer(log.run, keys, participants, listen, connect, identity)) as player:
        if not player.wait(timeout, GRACE):
            raise LostError(
                f"nobody subscribed to linkwind/v1/{log.run}/** within {timeout:g} s. Start the subscriber, "
                f"connected to {', '.join([*listen, *connect])}, and replay again."
            )
        pace = _Pace(selection.rate, steering or Steering())
        messages, start = 0, time.perf_counter()
        told = start
        for topic, time_ns, payload in _published(log, selection, topics, pace):
            now = pace.wait(time_ns)
            player.put(topic, payload)
            messages += 1
            if now - told > PROGRESS:
                told = now
                progress(time_ns / 1e9)
        wall = time.perf_counter() - start
        return Replayed(messages, wall, pace.late_ms, player.heard)


def _topics(log: Log, selection: Selection) -> list[str]:
    """Return the topics to publish; states and diagnostics are in the log only."""
    there = [MOTION, *(f"{WRENCH}{name}" for name in log.provider_bodies)]
    there += [f"{FLOW}{name}" for name in log.flows]
    unknown = [topic for topic in selection.topics if topic not in there]
    if unknown:
        raise InputError(
            f"--topics: expected some of {', '.join(there)}, which a run publishes; got {', '.join(unknown)}."
        )
    return [topic for topic in there if not selection.topics or topic in selection.topics]


def _check(log: Log, selection: Selection, topics: Sequence[str]) -> None:
    """Raise InputError unless there is something to publish, at a rate that makes sense."""
    if not (math.isfinite(selection.rate) and selection.rate >= 0.0):
        raise InputError(f"--rate: expected a number >= 0, 0 for as fast as possible; got {selection.rate}.")
    if next(_window(log, selection, topics), None) is None:
        start, end = selection.start or 0.0, math.inf if selection.end is None else selection.end
        raise InputError(
            f"{log.path}: expected messages of {', '.join(topics)} from {start:g} s to {end:g} s; "
            "got none. Change --start, --end or --topics."
        )


def _published(
    log: Log, selection: Selection, topics: Sequence[str], pace: _Pace
) -> Iterator[tuple[str, int, bytes]]:
    """Yield topic, simulation time [ns] and payload of what is due next, again and again in a loop."""
    while True:
        pace.begin(None if selection.start is None else round(selection.start * 1e9))
        yield from _window(log, selection, topics)
        if not selection.loop:
            return


def _window(log: Log, selection: Selection, topics: Sequence[str]) -> Iterator[tuple[str, int, bytes]]:
    """Yield what lies between start and end."""
    low = -1 if selection.start is None else round(selection.start * 1e9)
    high = math.inf if selection.end is None else round(selection.end * 1e9)
    for channel, number, time_ns, payload in log.messages(*topics):
        if time_ns > high:
            return
        if time_ns >= low:
            topic = log.channels[channel].topic
            yield topic, time_ns, log.as_sent(channel, number, payload)


class _Pace:
    """Lets simulation time pass at a rate of wall-clock time, and keeps how late it was."""

    def __init__(self, rate: float, steering: Steering) -> None:
        self._rate = rate
        self._steering = steering
        self._late: Counter[int] = Counter()
        self._origin_ns: int | None = None
        self._origin = 0.0

    def begin(self, time_ns: int | None) -> None:
        """Let time pass from now on, from simulation time ``time_ns``, else from the next message."""
        self._origin_ns = time_ns
        self._origin = time.perf_counter()

    def wait(self, time_ns: int) -> float:
        """Wait until a message of simulation time ``time_ns`` is due; return the wall clock [s]."""
        now = self._held(time_ns)
        if not self._rate:
            return now
        if self._origin_ns is None:
            self._origin_ns = time_ns
        due = self._origin + (time_ns - self._origin_ns) / (1e9 * self._rate)
        while now < due:
            time.sleep(due - now)
            now = time.perf_counter()
        self._late[round((now - due) / RESOLUTION)] += 1
        return now

    def _held(self, time_ns: int) -> float:
        """Wait while paused, without time passing for the replay; return the wall clock [s]."""
        began = now = time.perf_counter()
        while self._steering.holds(time_ns):
            time.sleep(TICK)
            now = time.perf_counter()
        self._origin += now - began
        return now

    @property
    def late_ms(self) -> tuple[float, float] | None:
        """Median and 99th percentile of the lateness [ms]."""
        if not self._late:
            return None
        return self._quantile(0.5), self._quantile(0.99)

    def _quantile(self, share: float) -> float:
        rest = share * self._late.total()
        for late in sorted(self._late):
            rest -= self._late[late]
            if rest <= 0:
                break
        return late * RESOLUTION * 1e3
