"""A log made from what a listener hears of a run, which says what it has missed.

Every message has its number on its topic, so that a hole shows with the next one; what is missing behind the
last one shows with the end of the run.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import IO, Any

from foxglove.messages import FrameTransforms, Grid, SceneUpdate

from linkwind import schema
from linkwind.errors import MissedError
from linkwind.frames import Sent, decode
from linkwind.interrupt import uninterrupted
from linkwind.listening import Described, Ended
from linkwind.log import contents, frames
from linkwind.log.chunks import SchemaInfo
from linkwind.log.copies import CopyWriter
from linkwind.log.scene import Scene
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion
from linkwind.wire import FixedLayout

CHUNK_SIZE = 64 * 1024  # bytes; a listener that is killed loses no more
SHOWN = 20  # holes that are told one by one, of a topic
PICTURES = {contents.TRANSFORMS: FrameTransforms, contents.SCENE: SceneUpdate}


class HeardLog:
    """A log in the making."""

    def __init__(self, file: IO[bytes], about: Described) -> None:
        """Begin with what the run says of itself."""
        self._about = about
        self._copy = CopyWriter(file, "linkwind record", CHUNK_SIZE)
        for name, record in about.records.items():
            self._copy.record(name, dict(record))
        self._copy.scenario(about.scenario_json)
        self._pictures = Pictures(about.scenario_json)
        self._channels: dict[str, int] = {}
        self._last: Counter[str] = Counter()
        self._taken: Counter[str] = Counter()
        self._missed: Counter[str] = Counter()
        self._holes: dict[str, list[str]] = {}

    @uninterrupted
    def message(self, topic: str, number: int, time_ns: int, payload: bytes) -> None:
        """Take a message.

        Args:
            topic: of the log.
            number: of the message on its topic, from 1.
            time_ns: simulation time [ns].
            payload: the message, a frame as it was sent by its provider.

        Raises:
            ProtocolError: a frame is none.
        """
        if number <= self._last[topic]:
            return
        self._missing(topic, number - 1)
        self._last[topic] = number
        self._taken[topic] += 1
        if topic.startswith(contents.FRAMES):
            _, kind, provider = topic.split("/", 2)
            payload = frames.encode(decode(Sent(kind, payload), self._about.run, provider)[1])
        self._copy.message(self._channel(topic), number, time_ns, payload)
        if topic == contents.STATE:
            self._pictures.take(number, time_ns, payload)
        elif topic == contents.STEP:  # a run draws a point when that is written
            for drawn in self._pictures.due():
                self._draw(*drawn)
        elif (picture := frames.picture(topic, payload)) is not None:
            self._draw(picture[0], time_ns, picture[1])

    def _draw(self, topic: str, time_ns: int, drawn: bytes) -> None:
        """Write a picture, which is of a topic that listeners do not get."""
        self._last[topic] += 1
        self._copy.message(self._channel(topic), self._last[topic], time_ns, drawn)

    def _missing(self, topic: str, last: int) -> None:
        """Note that messages behind the last one up to number ``last`` did not come."""
        first = self._last[topic] + 1
        if last >= first:
            self._missed[topic] += last - first + 1
            self._holes.setdefault(topic, []).append(f"{first}" if first == last else f"{first}–{last}")

    def _channel(self, topic: str) -> int:
        if topic not in self._channels:
            self._channels[topic] = self._copy.channel(topic, _schema(topic))
        return self._channels[topic]

    @uninterrupted
    def finish(self, ended: Ended | None, reason: str) -> str:
        """Write how the run ended, and what was missed; make the file whole.

        Args:
            ended: what the run says; None if it did not come to that.
            reason: why not.

        Returns:
            what was missed, for people; empty if nothing was.
        """
        counts: Mapping[str, int] = ended.counts if ended else {}
        for topic, count in counts.items():
            self._missing(topic, count)
        missed = self._text()
        records = dict(ended.records) if ended else {}
        end = dict(records.pop(contents.END, {"complete": "false"}))
        if missed or ended is None:
            text = "; ".join(filter(None, (reason, missed)))
            end |= {"complete": "false", "error": MissedError.__name__, "text": text}
        for name in records.keys() - self._about.records.keys():
            self._copy.record(name, dict(records[name]))
        self._copy.record(contents.HEARD, {topic: str(count) for topic, count in self._missed.items()})
        self._copy.record(contents.END, end)
        self._copy.finish()
        return missed

    def _text(self) -> str:
        """Return what was missed; topics with the same holes together."""
        alike: dict[str, list[str]] = {}
        for topic, missed in self._missed.items():
            holes = self._holes[topic]
            more = f" and {len(holes) - SHOWN} more" if len(holes) > SHOWN else ""
            total = missed + self._taken[topic]
            text = f"missed {missed} of {total} messages (number {', '.join(holes[:SHOWN])}{more})"
            alike.setdefault(text, []).append(topic)
        return "; ".join(f"{text} of {', '.join(topics)}" for text, topics in alike.items())


class Pictures:
    """What Foxglove shows of the states, as the log of a run has it."""

    def __init__(self, scenario_json: str) -> None:
        self._scene = Scene(json.loads(scenario_json))
        self._state: tuple[int, bytes] | None = None

    def take(self, number: int, time_ns: int, payload: bytes) -> None:
        """Keep the ``number``-th State if a picture of it is due."""
        if (number - 1) % self._scene.stride == 0:
            self._state = time_ns, payload

    def due(self) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, simulation time and message of what is due."""
        if self._state is None:
            return
        time_ns, payload = self._state
        self._state = None
        views = FixedLayout(MESSAGES["State"].FromString(payload)).views
        motion = Motion.of(views, "motion")
        force = views["wrench"].reshape(-1, 6)[:, :3]
        yield contents.TRANSFORMS, time_ns, self._scene.transforms(time_ns, motion).encode()
        yield contents.SCENE, time_ns, self._scene.update(time_ns, motion, force).encode()


def _schema(topic: str) -> SchemaInfo:
    name = contents.message_name(topic)
    if name is not None:
        return SchemaInfo(contents.PACKAGE + name, "protobuf", schema.DESCRIPTOR_SET)
    shown = topic.startswith(tuple(contents.SCENE_OF.values()))
    kind: Any = SceneUpdate if shown else PICTURES.get(topic, Grid)
    found = kind.get_schema()
    return SchemaInfo(found.name, found.encoding, found.data)
