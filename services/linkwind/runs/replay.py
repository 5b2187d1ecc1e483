"""Publish a log on the bus again: the same messages under the same keys, in the order of the run.

Participants exchanged motions, wrenches, frames and checkpoints; beside that, the dynamics told its log to
whoever listened. Both are done again, communication point after communication point.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from linkwind.credentials import Identity
from linkwind.errors import InputError, LostError
from linkwind.listening import description, ending
from linkwind.log.chunks import Message
from linkwind.log.contents import (
    CHECKPOINT,
    DIAGNOSTICS,
    END,
    FRAMES,
    MOTION,
    PROGRAMS,
    RUN,
    STATE,
    STEP,
    TIMING,
    VERSIONS,
    WRENCH,
)  # fmt: skip
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded
from linkwind.runs.playback import Pace, Steering

if TYPE_CHECKING:
    from linkwind.bus.zenoh import ZenohPlayer

GRACE = 0.5  # s for further subscribers, once there is one
PROGRESS = 0.1  # s of wall clock between two words about progress


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
        start: simulation time to begin at [s]; None for the beginning of the log.
        end: simulation time to end at, itself included [s]; None for the end of the log.
        topics: such as ``/motion``; empty for all.
        remap: pairs of keys; the beginning of a key that is the first of a pair becomes the second.
    """

    start: float | None = None
    end: float | None = None
    topics: Sequence[str] = ()
    remap: Sequence[tuple[str, str]] = ()


class Sent(NamedTuple):
    """A message of the log: topic, number on it, simulation time [ns], payload as it was on the bus."""

    topic: str
    number: int
    time_ns: int
    payload: bytes


def replay(
    log: Log,
    selection: Selection,
    *,
    listen: Sequence[str],
    connect: Sequence[str],
    identity: Identity | None = None,
    progress: Callable[[float], None] = lambda t: None,
    steering: Steering | None = None,
    opened: Callable[[], None] = lambda: None,
) -> Replayed:
    """Wait for a subscriber, then publish.

    Args:
        log: of the run.
        selection: what of it.
        listen: zenoh endpoints to listen on.
        connect: zenoh endpoints to connect to.
        identity: the dynamics' certificate; None without TLS.
        progress: is told now and then the simulation time [s].
        steering: how it goes on; None for once through at rate 1.
        opened: is called when the endpoints are open.

    Raises:
        InputError: a topic, a time, a key or the rate is wrong, or an endpoint cannot be opened.
        LostError: nobody subscribed within bus.start_timeout of the scenario.
    """
    from linkwind.bus.zenoh import ZenohPlayer

    steering = steering or Steering()
    topics = _topics(log, selection)
    _check(log, selection, topics, steering)
    timeout = recorded(log).bus.start_timeout
    keys = {topic: _key(topic) for topic in topics if topic not in (STATE, STEP, TIMING)}
    player = ZenohPlayer(
        log.run,
        keys,
        ["dynamics", *log.provider_bodies],
        listen,
        connect,
        identity,
        topics=topics,
        description=description(log.run, log.scenario_json, _records(log, RUN, VERSIONS)),
        playback=steering.answer,
        rename=_renaming(log, selection),
    )
    with closing(player):
        opened()
        if not player.wait(timeout, GRACE):
            raise LostError(
                f"nobody subscribed to linkwind/v1/{log.run}/** within {timeout:g} s. Start the subscriber, "
                f"connected to {', '.join([*listen, *connect])}, and replay again."
            )
        pace = Pace(steering)
        start = time.perf_counter()
        messages = _Reel(log, selection, topics, steering, player, progress).play(pace)
        wall = time.perf_counter() - start
        return Replayed(messages, wall, pace.late_ms, player.heard)


class _Reel:
    """The points of a log on their way to the bus."""

    def __init__(
        self,
        log: Log,
        selection: Selection,
        topics: Sequence[str],
        steering: Steering,
        player: ZenohPlayer,
        progress: Callable[[float], None],
    ) -> None:
        self._log, self._topics = log, topics
        self._low, self._high = _limits(selection)
        self._steering, self._player, self._progress = steering, player, progress
        self._told = time.perf_counter()

    def play(self, pace: Pace) -> int:
        """Publish point after point until the end; return how many messages that were."""
        messages, place = 0, self._low
        while True:
            pace.begin(None if place < 0 else place)
            sought = None
            for time_ns, point in points(self._log, self._topics, place, self._high):
                if not pace.wait(time_ns):
                    sought = self._steering.taken()
                    break
                messages += self._publish(point)
                self._tell(time_ns)
            else:
                self._player.log.end(self._ending())
                if not self._steering.loop:
                    return messages
            place = self._low if sought is None else sought

    def _publish(self, point: Sequence[Sent]) -> int:
        """Publish the messages of a point as participants did, then its log; return how many were sent."""
        player, count = self._player, 0
        for topic, _, _, payload in as_exchanged(point):
            player.put(topic, payload)
            count += 1
        for topic, number, time_ns, payload in point:
            if player.log.wants(topic):
                player.log.put(topic, number, time_ns, payload)
                count += topic in (STATE, STEP, TIMING)
        return count

    def _tell(self, time_ns: int) -> None:
        now = time.perf_counter()
        if now - self._told > PROGRESS:
            self._told = now
            self._progress(time_ns / 1e9)

    def _ending(self) -> bytes:
        counts = {topic: self._log.topics.get(topic, 0) for topic in self._topics}
        return ending(_records(self._log, DIAGNOSTICS, PROGRAMS, END), counts)


def points(log: Log, topics: Sequence[str], low: int, high: float) -> Iterator[tuple[int, list[Sent]]]:
    """Yield simulation time [ns] and messages of point after point, from ``low`` to ``high`` [ns].

    A point begins with its motion; an iteration counts as one.
    """
    current: list[Message] = []
    at = -1
    for message in log.messages(MOTION, *topics, start_ns=low):
        channel, _, time_ns, _ = message
        topic = log.channels[channel].topic
        if topic == MOTION or time_ns > at:
            if current and at >= low:
                yield at, _sent(log, current)
            if time_ns > high:
                return
            at, current = time_ns, []
        if topic in topics:
            current.append(message)
    if current and at >= low:
        yield at, _sent(log, current)


def _sent(log: Log, messages: Sequence[Message]) -> list[Sent]:
    return [
        Sent(log.channels[channel].topic, number, time_ns, log.as_sent(channel, number, payload))
        for channel, number, time_ns, payload in messages
    ]


def as_exchanged(point: Sequence[Sent]) -> Iterator[Sent]:
    """Yield what participants sent, in their order: a provider's frames and checkpoints before its wrench."""
    waiting = [sent for sent in point if sent.topic.startswith((*FRAMES, CHECKPOINT))]
    waiting.sort(key=lambda sent: sent.topic.startswith(CHECKPOINT))
    for sent in point:
        if sent.topic.startswith(WRENCH):
            provider = f"/{sent.topic.removeprefix(WRENCH)}"
            yield from (shown for shown in waiting if shown.topic.endswith(provider))
            waiting = [shown for shown in waiting if not shown.topic.endswith(provider)]
        if sent.topic == MOTION or sent.topic.startswith(WRENCH):
            yield sent
    yield from waiting


def _key(topic: str) -> str:
    """Return the key of a topic below that of the run."""
    return f"/observe{topic}" if topic.startswith(FRAMES) else topic


def _records(log: Log, *names: str) -> dict[str, dict[str, str]]:
    return {name: record for name in names if (record := log.record(name))}


def _renaming(log: Log, selection: Selection) -> Callable[[str], str]:
    """Return what gives a key to use in the place of a usual one.

    Raises:
        InputError: a pair has no effect.
    """
    base = f"linkwind/v1/{log.run}"
    pairs = [(f"{base}{old}" if old.startswith("/") else old, new) for old, new in selection.remap]
    for old, new in pairs:
        if not (old == base or old.startswith(f"{base}/")) or new.strip("/") != new or not new:
            raise InputError(
                f"--remap: expected {base}, a key below it or a topic such as /motion, and a new key; got "
                f"{old}={new}."
            )

    def rename(key: str) -> str:
        fitting = [(old, new) for old, new in pairs if key == old or key.startswith(f"{old}/")]
        old, new = max(fitting, key=lambda pair: len(pair[0]), default=("", ""))
        return new + key.removeprefix(old)

    return rename


def _topics(log: Log, selection: Selection) -> list[str]:
    """Return the topics to publish."""
    there = [MOTION]
    for name in log.provider_bodies:
        there += [topic for kind in (*FRAMES, CHECKPOINT) if (topic := kind + name) in log.topics]
        there.append(WRENCH + name)
    there += [topic for topic in (STATE, STEP, TIMING) if topic in log.topics]
    unknown = [topic for topic in selection.topics if topic not in there]
    if unknown:
        raise InputError(f"--topics: expected some of {', '.join(there)}; got {', '.join(unknown)}.")
    return [topic for topic in there if not selection.topics or topic in selection.topics]


def _limits(selection: Selection) -> tuple[int, float]:
    low = -1 if selection.start is None else round(selection.start * 1e9)
    return low, math.inf if selection.end is None else round(selection.end * 1e9)


def _check(log: Log, selection: Selection, topics: Sequence[str], steering: Steering) -> None:
    """Tell the steering where the replay begins and ends.

    Raises:
        InputError: there is nothing to publish, or the rate makes no sense.
    """
    if not (math.isfinite(steering.rate) and steering.rate >= 0.0):
        raise InputError(f"--rate: expected a number >= 0, 0 for as fast as possible; got {steering.rate}.")
    low, high = _limits(selection)
    first = next(points(log, topics, low, high), None)
    if first is None:
        start, end = max(low, 0) / 1e9, high / 1e9
        raise InputError(
            f"{log.path}: expected messages of {', '.join(topics)} from {start:g} s to {end:g} s; "
            "got none. Change --start, --end or --topics."
        )
    steering.begin_ns = first[0]
    steering.end_ns = int(min(high, log.steps * recorded(log).coupling.step_ns))
