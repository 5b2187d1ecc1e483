"""Reading a log, whole, cut or damaged.

What can be read is read, and what is missing is said: :attr:`Log.damage`. Numbers come only from bytes
whose checksum holds::

    log = open_log("runs/two_link-1/log.mcap")
    for message in log.decoded("/state"):
        print(message.time_ns, message.message.joint_gap)
"""

from __future__ import annotations

import json
import mmap
from collections.abc import Container, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any

from google.protobuf.message import DecodeError

from linkwind.errors import LogError
from linkwind.frames import FlowFrame, Frame, VolumeFrame, WakeFrame
from linkwind.log import contents, frames, tables
from linkwind.log.chunks import ChannelInfo, Data, Message, Span, chunk_records, latest, messages_of
from linkwind.log.facts import Damage, DecodedMessage, LogInfo, RawMessage
from linkwind.log.head import Head, check_magic
from linkwind.log.scan import scan
from linkwind.schema import MESSAGES

CHUNKS_KEPT = 8  # in memory, for topics that are read side by side but not in step


class Log(Head):
    """One log file, open for reading; made by :func:`open_log`.

    Attributes:
        topics: number of readable messages by topic.
        channels: by number, as in :meth:`messages`.
    """

    def __init__(self, path: Path, data: Data) -> None:
        self._data = data
        self._sorted: dict[Span, dict[int | None, list[Message]]] = {}  # messages of the last chunks
        super().__init__(path, scan(data))
        self.channels: dict[int, ChannelInfo] = dict(self._contents.channels)
        counts = self._counts()
        self.topics = {self.channels[number].topic: counts[number] for number in sorted(counts)}
        self.check_schemas(self.channels.values())

    def close(self) -> None:
        """Let go of the file, which may be gone already; nothing can be read any more."""
        if not isinstance(self._data, bytes):
            self._data.close()

    def _counts(self) -> dict[int, int]:
        """Return the readable messages by channel, and find out the damage."""
        gaps, written = self._contents.gaps, self._contents.counts
        if not gaps and written is not None:
            return {number: count for number, count in written.items() if count}
        counts: dict[int, int] = {}
        last: dict[int, int] = {}  # sequence numbers of a channel count from 1
        for channel, sequence, _, _ in self._messages():
            counts[channel] = counts.get(channel, 0) + 1
            last[channel] = sequence
        known = {number: count for number, count in counts.items() if number in self.channels}
        all_written = sum(last.values() if written is None else written.values())
        self.damage = Damage(
            sum(gap.size for gap in gaps),
            all_written - sum(known.values()),
            written is None,
            "; ".join(f"byte {gap.offset}: {gap.reason} ({gap.size} bytes)" for gap in gaps),
        )
        return known

    def _messages(self, wanted: Container[int] | None = None, start_ns: int = 0) -> Iterator[Message]:
        for chunk in self._contents.chunks:
            if self._contents.verified and latest(self._data, chunk) < start_ns:
                continue
            records = chunk_records(self._data, chunk, verified=self._contents.verified)
            if records is not None:  # they were read before
                yield from messages_of(records, self.channels, wanted)

    def of_topic(self, topic: str) -> Iterator[Message]:
        """Iterate like :meth:`messages` over one topic; several such side by side read the file only once."""
        channel = next((n for n, channel in self.channels.items() if channel.topic == topic), None)
        for chunk in self._contents.chunks if channel is not None else ():
            if chunk not in self._sorted:
                if len(self._sorted) == CHUNKS_KEPT:
                    del self._sorted[next(iter(self._sorted))]
                self._sorted[chunk] = self._by_channel(chunk)
            yield from self._sorted[chunk].get(channel, ())

    def _by_channel(self, chunk: Span) -> dict[int | None, list[Message]]:
        found: dict[int | None, list[Message]] = {}
        records = chunk_records(self._data, chunk, verified=self._contents.verified)
        if records is not None:
            for message in messages_of(records, self.channels):
                found.setdefault(message[0], []).append(message)
        return found

    @property
    def steps(self) -> int:
        """Communication steps of the run; of a cut log, those that can be read."""
        if "steps" in self.ending:
            return int(self.ending["steps"])
        first = last = b""
        for message in self.raw(contents.STATE):
            first, last = first or message.payload, message.payload
        begin, end = (MESSAGES["State"].FromString(payload).step for payload in (first, last))
        return int(end - begin)

    @property
    def info(self) -> LogInfo:
        """What ``linkwind log info`` tells."""
        scenario = json.loads(self.scenario_json)["name"]
        topics = dict(self.topics)
        missed = {topic: int(count) for topic, count in self.record(contents.HEARD).items()}
        return LogInfo(
            sum(topics.values()), topics, self.steps, self.complete, scenario, self.versions, missed
        )

    def raw(self, *topics: str) -> Iterator[RawMessage]:
        """Iterate over the readable messages in the order of logging: of ``topics``, or all."""
        for channel, _, time_ns, payload in self.messages(*topics):
            yield RawMessage(self.channels[channel].topic, time_ns, payload)

    def messages(self, *topics: str, start_ns: int = 0) -> Iterator[Message]:
        """Iterate like :meth:`raw` over channel, number, simulation time [ns] and payload.

        The number counts the messages of a channel from 1, in a damaged log those that are lost as well. What
        is before simulation time ``start_ns`` [ns] may be left out.
        """
        wanted = {n for n, channel in self.channels.items() if not topics or channel.topic in topics}
        return self._messages(wanted, start_ns)

    def decoded(self, *topics: str) -> Iterator[DecodedMessage]:
        """Iterate like :meth:`raw` over parsed messages of ``linkwind.v1``; pictures are left out.

        Raises:
            LogError: a message is not what its topic carries.
        """
        for topic, time_ns, payload in self.raw(*topics):
            name = contents.message_name(topic)
            if name is None:
                continue
            try:
                yield DecodedMessage(topic, time_ns, MESSAGES[name].FromString(payload))
            except DecodeError as error:
                raise LogError(f"{self.path}: {topic}: expected a {name}; got {error}.") from error

    @property
    def flows(self) -> tuple[str, ...]:
        """Providers of whose fluid there are frames in a plane."""
        return contents.providers(contents.FLOW, self.topics)

    @property
    def volumes(self) -> tuple[str, ...]:
        """Providers of whose fluid there are frames in a box."""
        return contents.providers(contents.VOLUME, self.topics)

    @property
    def wakes(self) -> tuple[str, ...]:
        """Providers of whose wings and wakes there are frames."""
        return contents.providers(contents.WAKE, self.topics)

    def frames(self, provider: str) -> Iterator[FlowFrame]:
        """Iterate over the frames of a provider's fluid, in order; one chunk of the file is in memory.

        Raises:
            LogError: a message is no such frame.
        """
        return (f for f in self.shown(contents.FLOW + provider) if isinstance(f, FlowFrame))

    def volume_frames(self, provider: str) -> Iterator[VolumeFrame]:
        """Iterate like :meth:`frames` over a provider's fluid in a box."""
        return (f for f in self.shown(contents.VOLUME + provider) if isinstance(f, VolumeFrame))

    def wake_frames(self, provider: str) -> Iterator[WakeFrame]:
        """Iterate like :meth:`frames` over a provider's wings with their wakes."""
        return (f for f in self.shown(contents.WAKE + provider) if isinstance(f, WakeFrame))

    def shown(self, topic: str) -> Iterator[Frame]:
        """Iterate like :meth:`frames` over the frames of a topic, of any kind."""
        for channel, _, _, payload in self.messages(topic):
            yield self._frame(channel, payload)

    def as_sent(self, channel: int, number: int, payload: bytes) -> bytes:
        """Return a message of :meth:`messages` as it was on the bus; a frame is logged in another form."""
        topic = self.channels[channel].topic
        if not topic.startswith(contents.FRAMES):
            return payload
        provider = topic.split("/", 2)[2]
        return self._frame(channel, payload).encode(self.run, provider, number)

    def _frame(self, channel: int, payload: bytes) -> Frame:
        topic, schema, _ = self.channels[channel]
        try:
            return frames.decode(topic, schema, payload, self._step_ns)
        except LogError as error:
            raise LogError(f"{self.path}: {topic}: {error}.") from error

    @cached_property
    def _step_ns(self) -> int:
        return round(float(json.loads(self.scenario_json)["coupling"]["step"]) * 1e9)

    def columns(self, topic: str) -> dict[str, Any]:
        """Return the values of every field of a topic's messages, by dotted name, one row a message.

        Raises:
            LogError: the topic has no message, or messages of different sizes.
        """
        name = contents.message_name(topic)
        if name is None:
            raise LogError(f"{self.path}: expected a topic of linkwind; got {topic}.")
        return tables.columns([m.payload for m in self.raw(topic)], name, f"{self.path}: {topic}")

    def trajectory(self) -> tables.Trajectory:
        """Return the accepted trajectory, stacked over the communication points."""
        return tables.trajectory(self.columns(contents.STATE))

    def steps_table(self) -> tables.Steps:
        """Return what the coupling did, stacked over the exchanges."""
        return tables.steps(self.columns(contents.STEP))

    def timing(self) -> tables.Timing:
        """Return the wall-clock times, stacked over the exchanges."""
        return tables.timing(self.columns(contents.TIMING))


def open_log(path: str | Path) -> Log:
    """Open a log for reading, whole, cut or damaged.

    Args:
        path: the MCAP file, or the folder of a run with its ``log.mcap``.

    Raises:
        LogError: the file is missing, empty, not MCAP, or not a log of linkwind.
    """
    path = Path(path)
    path = path / contents.LOG if path.is_dir() else path
    check_magic(path)
    with path.open("rb") as file:
        return Log(path, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
