"""The exchanges that a log holds, one after the other, and the checkpoints to begin from."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from typing import Any, NamedTuple

from linkwind import checkpoints
from linkwind.checkpoints import Checkpoint, Joining, Sequence
from linkwind.errors import LogError, ProtocolError
from linkwind.log.chunks import Message
from linkwind.log.contents import CHECKPOINT, FRAMES, MOTION, TIMING, WRENCH
from linkwind.log.reader import Log


class Shown(NamedTuple):
    """A message that is no part of the lock step: topic, simulation time [ns].

    ``logged`` returns its payload, and ``sent`` that as it was on the bus. A piece of a checkpoint is only
    read then: call it once for each, in order.
    """

    topic: str
    time_ns: int
    logged: Callable[[], bytes]
    sent: Callable[[bytes], bytes]


class Exchange(NamedTuple):
    """A motion and what came of it.

    Attributes:
        step: of the motion.
        iteration: of the motion, from 0.
        motion: the message.
        wrenches: the answers by provider, in the order in which they came.
        shown: what else was logged, in order: timing, checkpoints, frames.
    """

    step: int
    iteration: int
    motion: bytes
    wrenches: dict[str, bytes]
    shown: list[Shown]


def exchanges(log: Log, step_ns: int) -> Iterator[Exchange]:
    """Iterate over the exchanges from the beginning up to the first that is not whole.

    Whole is one that another motion follows, so that everything that belongs to it is there; behind a hole
    in the file nothing counts.
    """
    providers = tuple(log.provider_bodies)
    kinds = (WRENCH, *FRAMES, CHECKPOINT)
    topics = (MOTION, TIMING, *(kind + name for kind in kinds for name in providers))
    numbers: dict[int, int] = {}
    pieces = {CHECKPOINT + name: log.of_topic(CHECKPOINT + name) for name in providers}
    current: Exchange | None = None
    for channel, number, time_ns, payload in log.messages(*topics):
        numbers[channel] = numbers.get(channel, 0) + 1
        if number != numbers[channel]:
            return
        topic = log.channels[channel].topic
        if topic == MOTION:
            if current is not None:
                if len(current.wrenches) < len(providers):
                    return
                yield current
            step = time_ns // step_ns
            again = current is not None and current.step == step
            iteration = current.iteration + 1 if current is not None and again else 0
            current = Exchange(step, iteration, payload, {}, [])
        elif current is None:
            return
        elif topic.startswith(WRENCH):
            current.wrenches[topic.removeprefix(WRENCH)] = payload
        else:
            logged = partial(_next, pieces[topic]) if topic in pieces else partial(bytes, payload)
            current.shown.append(Shown(topic, time_ns, logged, partial(log.as_sent, channel, number)))


def _next(messages: Iterator[Message]) -> bytes:
    return next(messages)[3]


class Record:
    """The exchanges of a log up to a step, taken one after the other as the run made again asks for them.

    Attributes:
        current: the last one that was taken; None before the first and behind the last.
    """

    def __init__(self, log: Log, step_ns: int, last: int) -> None:
        """Begin at the beginning; ``last`` is the last step to take."""
        self._path = log.path
        self._exchanges = exchanges(log, step_ns)
        self._last = last
        self._done = False
        self.current: Exchange | None = None

    def take(self) -> Exchange | None:
        """Return the next exchange; None behind the last."""
        if not self._done:
            self.current = next(self._exchanges, None)
            if self.current is None or self.current.step > self._last:
                self.current, self._done = None, True
                self._exchanges.close()  # type: ignore[attr-defined]
        return self.current


def last_step(log: Log, step_ns: int) -> int:
    """Return the step of the last exchange that is whole.

    Raises:
        LogError: there is none.
    """
    last = -1
    for exchange in exchanges(log, step_ns):
        last = exchange.step
    if last < 0:
        wrenches = {name: log.topics.get(WRENCH + name, 0) for name in log.provider_bodies}
        names = [name for name, count in wrenches.items() if count == 0]
        missing = f"no wrench of {', '.join(names)}" if names else "none that another motion follows"
        raise LogError(
            f"{log.path}: expected an exchange of motion and wrenches to go on from; got {missing}. Run the "
            "scenario again."
        )
    return last


def checkpoint_steps(log: Log, step_ns: int) -> list[int]:
    """Return the steps, in order, at which the log has a checkpoint of every provider with all its pieces.

    Raises:
        LogError: a piece is none.
    """
    found: dict[int, set[str]] = {}
    arriving: dict[str, Sequence] = {}
    for provider, time_ns, piece in _pieces(log):
        if not piece.offset:
            arriving[provider] = Sequence(checkpoints.named(provider))
        with suppress(ProtocolError, KeyError):  # behind a hole, or a beginning that is not there
            if arriving[provider].take(piece):
                found.setdefault(time_ns // step_ns, set()).add(provider)
    return sorted(step for step, whole in found.items() if len(whole) == len(log.provider_bodies))


def states_at(log: Log, step: int, step_ns: int) -> dict[str, Checkpoint]:
    """Return each provider's checkpoint of a step that is among :func:`checkpoint_steps`.

    Raises:
        LogError: a checkpoint is damaged.
    """
    states: dict[str, Checkpoint] = {}
    joining: dict[str, Joining] = {}
    for provider, time_ns, piece in _pieces(log, step * step_ns):
        if time_ns != step * step_ns:
            continue
        if not piece.offset:
            joining[provider] = Joining(f"{log.path}: {CHECKPOINT}{provider}: step {step}")
        try:
            whole = joining[provider].add(piece)
        except ProtocolError as error:
            raise LogError(str(error)) from error
        if whole is not None:
            states[provider] = whole
    return states


def _pieces(log: Log, start_ns: int = 0) -> Iterator[tuple[str, int, Any]]:
    """Yield provider, simulation time [ns] and message of the pieces of all checkpoints, in order.

    Those before ``start_ns`` may be left out.
    """
    topics = [CHECKPOINT + name for name in log.provider_bodies]
    for channel, _, time_ns, payload in log.messages(*topics, start_ns=start_ns):
        topic = log.channels[channel].topic
        provider = topic.removeprefix(CHECKPOINT)
        try:
            yield provider, time_ns, checkpoints.decode(payload, log.run, provider)
        except ProtocolError as error:
            raise LogError(f"{log.path}: {topic}: {error}.") from error
