"""Where two messages differ, to the bit: field, body, both values, distance in ULP."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from google.protobuf.message import DecodeError

from linkwind.errors import LogError
from linkwind.log import contents, frames
from linkwind.log.chunks import SchemaInfo
from linkwind.schema import MESSAGES

Value = float | int | str | None

# Numbers that a body has in a field, by the field's last name.
WIDTHS = {
    "position": 3, "orientation": 4, "linear": 3, "angular": 3, "acceleration": 6, "reaction": 6,
    "wrench": 6, "force": 3, "torque": 3, "added_inertia": 36,
}  # fmt: skip


class Difference(NamedTuple):
    """The first place at which two runs differ.

    Attributes:
        topic: of the log.
        step: index of the communication point.
        time_ns: its simulation time [ns].
        iteration: coupling iteration, from 0.
        field: of the message, dotted; ``message`` where only one side has it, ``log_time``, ``encoding``.
        element: which number of the field, from 0; None for a scalar.
        body: that the number belongs to; None for none.
        recorded: value in the log, or in the first one of two.
        again: value of the run made again, or in the second log.
        ulp: how many float64 lie between the two, plus one; None for what is no finite number.
    """

    topic: str
    step: int
    time_ns: int
    iteration: int
    field: str
    element: int | None
    body: str | None
    recorded: Value
    again: Value
    ulp: int | None

    def as_json(self) -> dict[str, Any]:
        """Return the difference for JSON, which knows no infinite number and none that is not one."""
        return {name: printable(value) for name, value in self._asdict().items()}

    def lines(self, one: str, other: str) -> list[tuple[str, str]]:
        """Return the difference for people, as name and text; ``one`` and ``other`` name the two sides."""
        place = self.field if self.element is None else f"{self.field}[{self.element}]"
        return [
            ("step", f"{self.step}  (t = {self.time_ns / 1e9:g} s, iteration {self.iteration})"),
            ("where", f"{self.topic}: {place}" + (f" of {self.body}" if self.body else "")),
            (one, str(self.recorded)),
            (other, str(self.again)),
            ("distance", "none that could be counted" if self.ulp is None else f"{self.ulp} ULP"),
        ]


def printable(value: Any) -> Any:
    """Return a value that JSON can carry: a float that is not finite as text."""
    return str(value) if isinstance(value, float) and not math.isfinite(value) else value


def ulp(one: float, other: float) -> int | None:
    """Return the distance of two float64 in units in the last place; None if one is not finite."""
    if not (math.isfinite(one) and math.isfinite(other)):
        return None
    return abs(_ordinal(one) - _ordinal(other))


def _ordinal(value: float) -> int:
    """Return the place of a float64 among all of them, in order; −0 is one before 0."""
    bits: int = struct.unpack("<q", struct.pack("<d", value))[0]
    return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF) - 1


class Finder:
    """Finds what differs between two messages of a topic.

    Args:
        bodies: of the scenario, in order.
        provider_bodies: of each provider.
        coordinates: body of every joint coordinate (``q``) and joint velocity (``v``).
    """

    def __init__(
        self,
        bodies: Sequence[str],
        provider_bodies: Mapping[str, Sequence[str]],
        coordinates: Mapping[str, Sequence[str]],
    ) -> None:
        self._bodies = bodies
        self._provider_bodies = provider_bodies
        self._coordinates = coordinates

    def between(self, topic: str, time_ns: int, recorded: bytes, again: bytes) -> Difference:
        """Return the first difference of two payloads that are not equal.

        Args:
            topic: that both belong to.
            time_ns: simulation time [ns].
            recorded: message of the log.
            again: message of the other side, which can be parsed.
        """
        kind = MESSAGES[str(contents.message_name(topic))]
        right = kind.FromString(again)
        at = (topic, right.step, time_ns, getattr(right, "iteration", 0))
        try:
            left = kind.FromString(recorded)
        except DecodeError as error:
            return Difference(*at, "encoding", None, None, str(error), f"a {kind.DESCRIPTOR.name}", None)
        for field, index, values in _differences(left, right, ""):
            return Difference(*at, field, index, self.body(topic, field, index), *values, _ulp(*values))
        lengths = (f"{len(recorded)} bytes", f"{len(again)} bytes")
        return Difference(*at, "encoding", None, None, *lengths, None)

    def body(self, topic: str, field: str, index: int | None) -> str | None:
        """Return the body that a number of a field belongs to, None if it belongs to none."""
        leaf = field.rsplit(".", 1)[-1]
        if index is None:
            return None
        if leaf in self._coordinates and topic == contents.STATE:
            names, place = self._coordinates[leaf], index
        elif leaf in WIDTHS:
            provider = topic.removeprefix(contents.WRENCH)
            names = self._provider_bodies.get(provider, self._bodies)
            place = index // WIDTHS[leaf]
        else:
            return None
        return names[place] if place < len(names) else None


def between_frames(topic: str, step_ns: int, recorded: bytes, again: bytes) -> Difference:
    """Return the first difference of two frames of a fluid that are not equal.

    Args:
        topic: that both belong to.
        step_ns: communication step size [ns].
        recorded: message of the log.
        again: of the run made again.
    """
    from foxglove.messages import Grid

    of_grids = Grid.get_schema()
    kind = SchemaInfo(of_grids.name, of_grids.encoding, of_grids.data)
    right = frames.decode(topic, kind, again, step_ns)
    at = (topic, right.step, right.time_ns, 0)
    try:
        left = frames.decode(topic, kind, recorded, step_ns)
    except LogError as error:
        return Difference(*at, "encoding", None, None, str(error), "a frame", None)
    for field in (*right.PLACE, *right.ARRAYS):
        one, other = (np.ascontiguousarray(getattr(frame, field)) for frame in (left, right))
        if one.shape != other.shape:
            return Difference(*at, field, None, None, str(one.shape), str(other.shape), None)
        bits = [side.ravel().view(f"i{side.itemsize}") for side in (one, other)]
        differing = np.flatnonzero(bits[0] != bits[1])
        if differing.size:
            i = int(differing[0])
            values = one.flat[i].item(), other.flat[i].item()
            distance = single_ulp(*(int(side[i]) for side in bits)) if one.itemsize == 4 else ulp(*values)
            return Difference(*at, field, i if one.ndim else None, None, *values, distance)
    lengths = (f"{len(recorded)} bytes", f"{len(again)} bytes")
    return Difference(*at, "encoding", None, None, *lengths, None)


def single_ulp(one: int, other: int) -> int | None:
    """Return the distance of two float32, given as the int32 of the same bits; None if one is not finite."""
    sizes = one & 0x7FFF_FFFF, other & 0x7FFF_FFFF
    if max(sizes) >= 0x7F80_0000:
        return None
    places = [bits if bits >= 0 else -size - 1 for bits, size in zip((one, other), sizes, strict=True)]
    return abs(places[0] - places[1])


def _differences(left: Any, right: Any, prefix: str) -> Iterator[tuple[str, int | None, tuple[Value, Value]]]:
    """Yield field, index and both values of everything that differs, in the order of the fields."""
    for field in left.DESCRIPTOR.fields:
        name = prefix + field.name
        one, other = getattr(left, field.name), getattr(right, field.name)
        if field.is_repeated:
            pairs = zip(one, other, strict=False)
            yield from ((name, i, pair) for i, pair in enumerate(pairs) if not _same(*pair))
            if len(one) != len(other):
                yield name, None, (f"{len(one)} values", f"{len(other)} values")
        elif left.HasField(field.name) != right.HasField(field.name):
            there = [str(side.HasField(field.name)) for side in (left, right)]
            yield name, None, (f"present: {there[0]}", f"present: {there[1]}")
        elif field.type == FieldDescriptor.TYPE_MESSAGE:
            yield from _differences(one, other, f"{name}.")
        elif not _same(one, other):
            yield name, None, (one, other)


def _same(one: Value, other: Value) -> bool:
    """Tell whether two values have the same bits: NaN equals itself, −0 does not equal 0."""
    if isinstance(one, float) and isinstance(other, float):
        return struct.pack("<d", one) == struct.pack("<d", other)
    return one == other


def _ulp(one: Value, other: Value) -> int | None:
    return ulp(one, other) if isinstance(one, float) and isinstance(other, float) else None
