"""A recorded beginning in front of a run: on the bus the recorded wrenches answer, then the providers.

The dynamics cannot tell the difference. Everything that it makes on the way is held against the record, to
the bit, and written to the new log in the order of the old one.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress

from google.protobuf.message import DecodeError

from linkwind.bus.base import DynamicsLink
from linkwind.dynamics.published import PublishedLog
from linkwind.errors import MismatchError
from linkwind.frames import Frame
from linkwind.log.contents import WRENCH
from linkwind.log.difference import Difference, Finder
from linkwind.log.writer import LogWriter
from linkwind.protocol import DynamicsSession
from linkwind.runs.comparison import Comparison
from linkwind.runs.record import Exchange, Record
from linkwind.runs.recorded import DifferError, LogEndsError
from linkwind.runs.successor import Successor
from linkwind.schema import MESSAGES


def mismatch(difference: Difference, who: str) -> MismatchError:
    """Return the error that tells where ``who`` does not do what was recorded."""
    at = f"step {difference.step}" + (f", iteration {difference.iteration}" if difference.iteration else "")
    place = difference.field if difference.element is None else f"{difference.field}[{difference.element}]"
    body = f" of {difference.body}" if difference.body else ""
    return MismatchError(
        f"{who}: {at} (t = {difference.time_ns / 1e9:g} s): {difference.topic}: {place}{body}: expected "
        f"{difference.recorded}, as recorded; got {difference.again}. Something is not as it was when the "
        "log was made: linkwind verify tells what."
    )


class SplicedLink:
    """The dynamics' end of a bus (:class:`~linkwind.bus.base.DynamicsLink`) behind a record.

    Providers that begin before the end of the record are given its motions, and their answers are compared.
    """

    def __init__(
        self, session: DynamicsSession, link: DynamicsLink, record: Record, start: int, finder: Finder
    ) -> None:
        """Put a record in front of ``link``; the providers begin with the step after ``start``."""
        self._session, self._link, self._record = session, link, record
        self._start, self._finder = start, finder
        self._recorded: deque[tuple[str, bytes]] = deque()
        self._behind: Exchange | None = None  # the recorded exchange that the providers do again
        self._live = False
        self.wait, self.repeat, self.fault, self.close = link.wait, link.repeat, link.fault, link.close
        self.frames, self.listeners = link.frames, link.listeners

    def post(self, motion: bytes) -> None:
        """Send a motion message to the providers if they have begun; get the recorded answers ready."""
        exchange = None if self._live else self._record.take()
        self._live = exchange is None
        if exchange is not None:
            self._recorded.extend(exchange.wrenches.items())
        if exchange is None or exchange.step > self._start:
            self._link.post(motion)
            self._behind = exchange

    def receive(self) -> tuple[str, bytes]:
        """Return the next wrench message, recorded or live, and its provider."""
        if self._behind is not None:
            self._catch_up(self._behind)
            self._behind = None
        return self._recorded.popleft() if self._recorded else self._link.receive()

    def _catch_up(self, exchange: Exchange) -> None:
        """Hold the providers' answers against the recorded ones.

        Raises:
            MismatchError: they differ.
        """
        waiting = dict(exchange.wrenches)
        while waiting:
            provider, again = self._link.receive()
            recorded = waiting.get(provider)
            if recorded == again:
                del waiting[provider]
            elif recorded is not None and self._is_answer(again):
                time_ns = self._session.motion.time_ns
                difference = self._finder.between(WRENCH + provider, time_ns, recorded, again)
                raise mismatch(difference, f'"{provider}"')

    def _is_answer(self, payload: bytes) -> bool:
        """Tell whether a wrench is the answer to the last motion rather than a late one to another."""
        try:
            message = MESSAGES["WrenchStep"].FromString(payload)
        except DecodeError:
            return True
        return (message.step, message.iteration) == self._session.motion.at


class ContinuedLog:
    """Where the messages of a resumed run go (:class:`~linkwind.dynamics.recorder.MessageLog`): a new log."""

    def __init__(
        self,
        writer: LogWriter,
        log: LogWriter | PublishedLog,
        record: Record,
        comparison: Comparison,
        last: int,
        step_ns: int,
        successor: Successor | None = None,
    ) -> None:
        """Write to ``log``, and so to ``writer``; up to the step ``last``, compare with the record.

        What the run lacks up to there is taken from the record.
        """
        self._writer, self._log, self._record, self._comparison = writer, log, record, comparison
        self._last_ns = last * step_ns
        self._successor = successor
        self.scene, self.wrench = log.scene, log.wrench
        self.diagnostics, self.programs = log.diagnostics, log.programs

    def motion(self, payload: bytes, time_ns: int) -> None:
        """Write a motion."""
        if self._record.current is not None:
            self._compare(self._comparison.motion, payload, time_ns)
        self._log.motion(payload, time_ns)
        if self._successor is not None:
            self._successor.reached(self._writer, time_ns)

    def state(self, payload: bytes, time_ns: int) -> None:
        """Write an accepted state."""
        if time_ns <= self._last_ns:
            self._compare(self._comparison.state, payload, time_ns)
        self._log.state(payload, time_ns)

    def step(self, payload: bytes, time_ns: int) -> None:
        """Write what the coupling did."""
        if time_ns <= self._last_ns:
            self._compare(self._comparison.step, payload, time_ns)
        self._log.step(payload, time_ns)

    def timing(self, payload: bytes, time_ns: int) -> None:
        """Write how long an exchange took; of a recorded one, all that it brought beside the wrenches."""
        exchange = self._record.current
        if exchange is None:
            self._log.timing(payload, time_ns)
            return
        for topic, shown_ns, logged, sent in exchange.shown:
            payload = logged()
            self._writer.copy(topic, payload, shown_ns)
            if isinstance(self._log, PublishedLog):
                self._log.publish(topic, sent(payload), shown_ns)

    def frame(self, provider: str, frame: Frame) -> None:
        """Write a frame, unless it is in the record."""
        if self._record.current is None:
            self._log.frame(provider, frame)

    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None:
        """Write a checkpoint, unless it is in the record."""
        if self._record.current is None:
            self._log.checkpoint(provider, payload, time_ns)

    def _compare(self, compare: Callable[[bytes, int], None], payload: bytes, time_ns: int) -> None:
        """Hold a message against the recorded one, if the log has that.

        Raises:
            MismatchError: they differ.
        """
        try:
            with suppress(LogEndsError):
                compare(payload, time_ns)
        except DifferError as found:
            raise mismatch(found.difference, "dynamics") from None
