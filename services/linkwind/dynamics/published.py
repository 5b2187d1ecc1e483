"""A log that listeners on the bus get a copy of, message by message."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from types import TracebackType

from linkwind.bus.base import LogStream
from linkwind.frames import Frame
from linkwind.listening import ending
from linkwind.log.contents import (
    CHECKPOINT,
    DIAGNOSTICS,
    END,
    FRAMES,
    MOTION,
    PROGRAMS,
    RETURNS,
    STATE,
    STEP,
    TIMING,
    WRENCH,
)
from linkwind.log.frames import topic_of
from linkwind.log.writer import LogWriter


def topics(providers: Sequence[str]) -> list[str]:
    """Return every topic that a run may have messages of."""
    kinds = (WRENCH, *FRAMES, CHECKPOINT)
    return [MOTION, STATE, STEP, TIMING, *(kind + name for name in providers for kind in kinds)]


class PublishedLog:
    """Writes and publishes (:class:`~linkwind.dynamics.recorder.MessageLog`); tells at last how it ended.

    An exception that leaves the block ends the log with it.
    """

    def __init__(self, log: LogWriter, stream: LogStream, run: str) -> None:
        """Write to ``log``, publish on ``stream``."""
        self._log, self._stream, self._run = log, stream, run
        self._numbers: Counter[str] = Counter()
        self.scene, self.diagnostics, self.programs = log.scene, log.diagnostics, log.programs

    def motion(self, payload: bytes, time_ns: int) -> None:
        self._log.motion(payload, time_ns)
        self.publish(MOTION, payload, time_ns)

    def wrench(self, provider: str, payload: bytes, time_ns: int) -> None:
        self._log.wrench(provider, payload, time_ns)
        self.publish(WRENCH + provider, payload, time_ns)

    def state(self, payload: bytes, time_ns: int) -> None:
        self._log.state(payload, time_ns)
        self.publish(STATE, payload, time_ns)

    def step(self, payload: bytes, time_ns: int) -> None:
        self._log.step(payload, time_ns)
        self.publish(STEP, payload, time_ns)

    def timing(self, payload: bytes, time_ns: int) -> None:
        self._log.timing(payload, time_ns)
        self.publish(TIMING, payload, time_ns)

    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None:
        self._log.checkpoint(provider, payload, time_ns)
        self.publish(CHECKPOINT + provider, payload, time_ns)

    def frame(self, provider: str, frame: Frame) -> None:
        self._log.frame(provider, frame)
        topic = topic_of(frame, provider)
        wanted = self._stream.wants(topic)
        payload = frame.encode(self._run, provider, self._numbers[topic] + 1) if wanted else b""
        self.publish(topic, payload, frame.time_ns)

    def publish(self, topic: str, payload: bytes, time_ns: int) -> None:
        """Publish a message, as it is on the bus, that was written."""
        self._numbers[topic] += 1
        if self._stream.wants(topic):
            self._stream.put(topic, self._numbers[topic], time_ns, payload)

    def __enter__(self) -> PublishedLog:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._log.close(error=error)
        records = self._log.records
        later = {name: records[name] for name in (DIAGNOSTICS, PROGRAMS, RETURNS, END) if name in records}
        self._stream.end(ending(later, self._numbers))
        self._stream.linger()
