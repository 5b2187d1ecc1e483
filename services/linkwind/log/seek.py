"""A log of any size, also one that is still being written: read where somebody looks.

A chunk is read, and its checksum tested, when a message of it is asked for, and kept by nobody::

    log = open_seekable("runs/two_link-1/log.mcap")
    first, last = log.extent("/state")
    states = log.sampled(("/state",), first, last, 1000)["/state"]
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from linkwind.errors import LogError
from linkwind.frames import FlowFrame, Frame, VolumeFrame, WakeFrame
from linkwind.log import contents, frames
from linkwind.log.chunks import MESSAGE, messages_of
from linkwind.log.head import Head, check_magic
from linkwind.log.index import ChunkAt, Index, Times

EVER = (0, np.iinfo(np.int64).max)  # ns

_MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time; payload
_CONTENT = 9  # where what the length counts begins


class SeekableLog(Head):
    """One log file, open for looking into it; made by :func:`open_seekable`."""

    def __init__(self, path: Path) -> None:
        self._index = Index(path)
        super().__init__(path, self._index.contents)
        self.check_schemas(self._index.channels.values())

    @property
    def ended(self) -> bool:
        """Whether the writer has finished the file."""
        return self._index.ended

    def refresh(self) -> bool:
        """Take in what was written since the last look; tell whether there was anything."""
        return self._index.grow()

    @property
    def replaced(self) -> bool:
        """Whether another log has its name now: that of the same run, which goes on."""
        return not self._index.has_name(self.path)

    @property
    def trouble(self) -> str | None:
        """What was found damaged so far, for people."""
        gaps = self._contents.gaps
        return "; ".join(f"byte {gap.offset}: {gap.reason} ({gap.size} bytes)" for gap in gaps) or None

    @property
    def flows(self) -> tuple[str, ...]:
        """Providers of whose fluid there are frames in a plane."""
        return self._providers(contents.FLOW)

    @property
    def volumes(self) -> tuple[str, ...]:
        """Providers of whose fluid there are frames in a box."""
        return self._providers(contents.VOLUME)

    @property
    def wakes(self) -> tuple[str, ...]:
        """Providers of whose wings and wakes there are frames."""
        return self._providers(contents.WAKE)

    def _providers(self, kind: str) -> tuple[str, ...]:
        topics = (channel.topic for channel in self._index.channels.values())
        return tuple(sorted(contents.providers(kind, topics)))

    def extent(self, topic: str) -> tuple[int, int] | None:
        """Return the first and the last time of a topic's messages [ns]; None without any."""
        channel = self._number(topic)
        if channel is None:
            return None
        chunks = self._index.chunks
        first = next(chunk for chunk in chunks if channel in chunk.indexes)
        last = next(chunk for chunk in reversed(chunks) if channel in chunk.indexes)
        begins, ends = (self._index.entries(chunk, channel)[:, 0] for chunk in (first, last))
        return int(begins[0]), int(ends[-1])

    def times(self, topic: str) -> Times:
        """Return the times [ns] of all messages of a topic, shape (k,); for one that has few."""
        parts = [self._index.entries(chunk, channel)[:, 0] for chunk, channel in self._holding(topic, *EVER)]
        return np.concatenate(parts) if parts else np.empty(0, np.int64)

    def bytes_between(self, low: int, high: int) -> int:
        """Return how much has to be read for all messages between two times [ns]."""
        return sum(chunk.span.end - chunk.span.start for chunk in self._chunks(low, high))

    def between(self, topics: Sequence[str], low: int, high: int) -> dict[str, list[bytes]]:
        """Return all messages of some topics between two times [ns], both included, each topic's in order."""
        found: dict[str, list[bytes]] = {topic: [] for topic in topics}
        topic_of = {n: topic for topic in topics if (n := self._number(topic)) is not None}
        for chunk in self._chunks(low, high):
            records = self._index.records(chunk)
            for channel, _, time_ns, payload in messages_of(records, self._index.channels, topic_of.keys()):
                if low <= time_ns <= high:
                    found[topic_of[channel]].append(payload)
        return found

    def sampled(self, topics: Sequence[str], low: int, high: int, count: int) -> dict[str, list[bytes]]:
        """Return about ``count`` messages of each topic, evenly spread between two times [ns], and both ends.

        A chunk is read once for all topics.
        """
        found: dict[str, list[bytes]] = {topic: [] for topic in topics}
        wanted = np.linspace(low, high, count).astype(np.int64)
        numbers = [(topic, n) for topic in topics if (n := self._number(topic)) is not None]
        chunks = list(self._chunks(low, high))
        followed_by = [chunk.start_ns for chunk in chunks[1:]] + [high + 1]
        for chunk, next_ns in zip(chunks, followed_by, strict=True):
            begin, end = np.searchsorted(wanted, (chunk.start_ns, max(chunk.end_ns + 1, next_ns)))
            here = [(topic, number) for topic, number in numbers if number in chunk.indexes]
            if begin == end or not here:
                continue
            records = self._index.records(chunk)
            for topic, number in here:
                entries = self._index.entries(chunk, number)
                rows = np.searchsorted(entries[:, 0], wanted[begin:end], side="right") - 1
                for row in np.unique(rows[rows >= 0]).tolist():
                    found[topic] += _payload(records, number, *entries[row].tolist())
        return found

    def at(self, topic: str, time_ns: int) -> bytes | None:
        """Return the message of a topic at a time [ns]; None if there is none that can be read."""
        for chunk, channel in self._holding(topic, time_ns, time_ns):
            entries = self._index.entries(chunk, channel)
            for row in np.flatnonzero(entries[:, 0] == time_ns).tolist():
                for payload in _payload(self._index.records(chunk), channel, *entries[row].tolist()):
                    return payload
        return None

    def frame(self, provider: str, time_ns: int, step_ns: int) -> FlowFrame | None:
        """Return the frame of a provider's fluid at a time [ns]; None if it cannot be read.

        Raises:
            LogError: the message is no such frame.
        """
        found = self._shown(contents.FLOW + provider, time_ns, step_ns)
        return found if isinstance(found, FlowFrame) else None

    def volume_frame(self, provider: str, time_ns: int, step_ns: int) -> VolumeFrame | None:
        """Return a provider's fluid in a box at a time [ns], like :meth:`frame`."""
        found = self._shown(contents.VOLUME + provider, time_ns, step_ns)
        return found if isinstance(found, VolumeFrame) else None

    def wake_frame(self, provider: str, time_ns: int, step_ns: int) -> WakeFrame | None:
        """Return a provider's wings and wakes at a time [ns], like :meth:`frame`."""
        found = self._shown(contents.WAKE + provider, time_ns, step_ns)
        return found if isinstance(found, WakeFrame) else None

    def _shown(self, topic: str, time_ns: int, step_ns: int) -> Frame | None:
        number, payload = self._number(topic), self.at(topic, time_ns)
        if number is None or payload is None:
            return None
        _, schema, _ = self._index.channels[number]
        try:
            return frames.decode(topic, schema, payload, step_ns)
        except LogError as error:
            raise LogError(f"{self.path}: {topic}: {error}.") from error

    def _number(self, topic: str) -> int | None:
        channels = self._index.channels.items()
        return next((number for number, channel in channels if channel.topic == topic), None)

    def _chunks(self, low: int, high: int) -> Iterator[ChunkAt]:
        """Iterate over the chunks that have something between two times [ns]."""
        times = self._index.times
        for i in np.flatnonzero((times[:, 1] >= low) & (times[:, 0] <= high)).tolist():
            yield self._index.chunks[i]

    def _holding(self, topic: str, low: int, high: int) -> Iterator[tuple[ChunkAt, int]]:
        """Iterate over the chunks that may have messages of a topic then, with the channel."""
        channel = self._number(topic)
        if channel is not None:
            yield from ((chunk, channel) for chunk in self._chunks(low, high) if channel in chunk.indexes)


def _payload(records: bytes, channel: int, time_ns: int, at: int) -> list[bytes]:
    """Return the message at a place among the records; none if the index that told the place is wrong."""
    if at + _MESSAGE.size > len(records):
        return []
    opcode, length, number, _, time, _ = _MESSAGE.unpack_from(records, at)
    right = (opcode, number, time) == (MESSAGE, channel, time_ns)
    return [records[at + _MESSAGE.size : at + _CONTENT + length]] if right else []


def open_seekable(path: str | Path) -> SeekableLog:
    """Open a log for looking into it, whole, cut, or still being written.

    Raises:
        LogError: the file is missing, empty, not MCAP, or not a log of linkwind.
    """
    path = Path(path)
    check_magic(path)
    return SeekableLog(path)
