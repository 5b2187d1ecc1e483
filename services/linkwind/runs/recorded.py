"""A log played to the dynamics: its messages by number, and its wrenches in the place of providers."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from itertools import islice

from google.protobuf.message import DecodeError

from linkwind.errors import LogError
from linkwind.frames import Sent
from linkwind.log.chunks import Message
from linkwind.log.contents import WRENCH
from linkwind.log.difference import Difference
from linkwind.log.reader import Log
from linkwind.protocol import DynamicsSession
from linkwind.schema import MESSAGES, SHA256

Control = MESSAGES["Control"]


class LogEndsError(Exception):
    """The log has no more messages, though the run had: it is of a run that was cut, or damaged."""


class DifferError(Exception):
    """The run made again differs from the recorded one."""

    def __init__(self, difference: Difference) -> None:
        super().__init__(difference)
        self.difference = difference


class Recorded:
    """The messages of one topic, asked for one after the other; a few chunks of the file are in memory."""

    def __init__(self, log: Log, topic: str) -> None:
        self._messages = log.of_topic(topic)
        self._number = 0
        self._waiting = deque(islice(self._messages, 1))

    @property
    def next(self) -> Message | None:
        """The message that comes next in the file, None behind the last one."""
        return self._waiting[0] if self._waiting else None

    def take(self) -> Message | None:
        """Return the next message of the run, None if the file has lost it or has ended."""
        self._number += 1
        found = self.next
        if found is None or found[1] != self._number:
            return None
        self._drop(1)
        return found

    def ahead(self, count: int, time_ns: int, step_ns: int) -> list[bytes]:
        """Return up to ``count`` messages that come next, as far as none is lost.

        The first is expected at ``time_ns`` and each ``step_ns`` after the one before.
        """
        self._waiting.extend(islice(self._messages, max(0, count - len(self._waiting))))
        number, payloads = self._number, list[bytes]()
        for _, sequence, at_ns, payload in islice(self._waiting, count):
            number += 1
            if sequence != number or at_ns != time_ns:
                break
            payloads.append(payload)
            time_ns += step_ns
        return payloads

    def skip(self, count: int) -> None:
        """Pass over messages of which ``ahead`` has told."""
        self._number += count
        self._drop(count)

    def _drop(self, count: int) -> None:
        for _ in range(count):
            self._waiting.popleft()
        if not self._waiting:
            self._waiting.extend(islice(self._messages, 1))


class RecordedWrenches:
    """The dynamics' end of a bus on which the recorded wrenches answer (:class:`~linkwind.bus.base`)."""

    def __init__(self, session: DynamicsSession, log: Log) -> None:
        """Shake hands in the place of every provider.

        Raises:
            LogError: there is no wrench of a provider.
        """
        self._session = session
        self._recorded = {name: Recorded(log, WRENCH + name) for name in session.participants}
        self._waiting: deque[str] = deque()
        for name, recorded in self._recorded.items():
            if recorded.next is None:
                raise LogError(
                    f"{log.path}: {WRENCH}{name}: expected at least one wrench; got none. Verify with the "
                    "provider, without --from-recorded-wrenches."
                )
            first = MESSAGES["WrenchStep"].FromString(recorded.next[3])
            hello = {"name": name, "schema_sha256": SHA256, "instance": "log"}
            ready = {
                "name": name,
                "instance": "log",
                "kind": first.kind,
                "rollback": True,
                "added_inertia": len(first.added_inertia) > 0,
                "response_size": len(first.response),
                "diagnostics": [str(i) for i in range(len(first.diagnostics))],
            }
            session.control(Control(hello=hello).SerializeToString())
            session.control(Control(ready=ready).SerializeToString())

    def wait(self, done: Callable[[], bool], timeout: float, poll: Callable[[], None]) -> bool:
        """Everything has been said by the time that this is called."""
        return done()

    def post(self, motion: bytes) -> None:
        """Get ready to answer."""
        self._waiting.extend(self._recorded)
        if self._session.motion.final:
            for name in self._recorded:
                self._session.control(Control(bye={"name": name}).SerializeToString())

    def repeat(self, motion: bytes) -> None:
        """Nobody is ever lost here."""

    def receive(self) -> tuple[str, bytes]:
        """Return the next recorded wrench.

        Raises:
            LogEndsError: the log has lost it, or has ended.
            DifferError: it is the answer to another motion than the one that was posted.
        """
        name = self._waiting.popleft()
        found = self._recorded[name].take()
        if found is None:
            raise LogEndsError(f"the wrench of {name} at {self._session.where()} is not in the log")
        self._check(name, found[3])
        return name, found[3]

    def _check(self, name: str, payload: bytes) -> None:
        """Raise DifferError unless a wrench belongs to the motion that waits for it."""
        motion = self._session.motion
        try:
            message = MESSAGES["WrenchStep"].FromString(payload)
        except DecodeError as error:
            text = f"{WRENCH}{name}: {self._session.where()}: expected a WrenchStep; got {error}"
            raise LogEndsError(text) from error
        for field, was, asked in zip(
            ("step", "iteration"), (message.step, message.iteration), motion.at, strict=True
        ):
            if was != asked:
                at = (WRENCH + name, motion.at[0], motion.time_ns, motion.at[1])
                raise DifferError(Difference(*at, field, None, None, was, asked, None))

    def frames(self) -> list[tuple[str, Sent]]:
        """Nobody is there to show any."""
        return []

    def listeners(self, topics: Sequence[str], description: bytes) -> None:
        """Nobody else is there."""

    def fault(self, payload: bytes) -> None:
        """Nobody is there to be told."""

    def close(self) -> None:
        """Nothing is open."""
