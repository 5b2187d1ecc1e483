"""Protobuf messages whose byte layout does not change, read and written in place.

A protobuf message in which every field has fixed width and is always present has constant byte offsets.
Such a message is serialised once as a template; after that, encoding is a numpy copy into the template
and decoding a comparison of the bytes between the values. Any protobuf parser reads what is written::

    layout = FixedLayout(motion_step)                   # a message with every field filled to its size
    layout.views["trial.position"][:] = position.ravel()
    publisher.put(layout.payload())

The wire format: https://protobuf.dev/programming-guides/encoding/.
"""

from __future__ import annotations

import reprlib
import struct
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from google.protobuf.descriptor import FieldDescriptor
from numpy.typing import NDArray

if sys.byteorder != "little":
    raise ImportError(
        f"linkwind.wire: expected a little-endian host, because protobuf values are viewed in place; "
        f"got {sys.byteorder}-endian. Run linkwind on x86-64 or ARM64."
    )

VARINT, FIXED64, DELIMITED, FIXED32 = 0, 1, 2, 5  # wire types

DTYPES: dict[int, np.dtype[Any]] = {
    FieldDescriptor.TYPE_DOUBLE: np.dtype("<f8"),
    FieldDescriptor.TYPE_FIXED64: np.dtype("<u8"),
    FieldDescriptor.TYPE_SFIXED64: np.dtype("<i8"),
    FieldDescriptor.TYPE_FLOAT: np.dtype("<f4"),
    FieldDescriptor.TYPE_FIXED32: np.dtype("<u4"),
    FieldDescriptor.TYPE_SFIXED32: np.dtype("<i4"),
}


class Region(NamedTuple):
    """Where the values of one field lie in a message: ``size`` times ``dtype`` from byte ``offset`` on."""

    offset: int
    dtype: np.dtype[Any]
    size: int

    @property
    def end(self) -> int:
        """First byte behind the values."""
        return self.offset + self.size * self.dtype.itemsize


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """Return the varint at byte ``at`` and the position behind it."""
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7


def preamble(number: int, size: int) -> bytes:
    """Return what goes before the ``size`` bytes of field ``number``: tag and length.

    Large ones are joined to a message by hand: protobuf copies them several times over.
    """
    out = bytearray()
    for value in (number << 3 | DELIMITED, size):
        while value > 0x7F:
            out.append(value & 0x7F | 0x80)
            value >>= 7
        out.append(value)
    return bytes(out)


def _regions(data: bytes, at: int, end: int, descriptor: Any, prefix: str) -> Iterator[tuple[str, Region]]:
    """Yield dotted name and place of every fixed-width field of ``data[at:end]``, in wire order."""
    fields = descriptor.fields_by_number
    while at < end:
        tag, at = _varint(data, at)
        field, wire_type = fields[tag >> 3], tag & 7
        name, dtype = prefix + field.name, DTYPES.get(field.type)
        if wire_type == VARINT:
            _, at = _varint(data, at)
            continue
        if wire_type == DELIMITED:
            length, at = _varint(data, at)
        else:
            length = 8 if wire_type == FIXED64 else 4
        if dtype is not None and field.is_repeated and wire_type != DELIMITED:
            raise TypeError(f"{field.full_name}: expected a packed field in a fixed layout")
        if field.type == FieldDescriptor.TYPE_MESSAGE:
            yield from _regions(data, at, at + length, field.message_type, f"{name}.")
        elif dtype is not None:
            yield name, Region(at, dtype, length // dtype.itemsize)
        at += length


def _empty(message: Any, prefix: str = "") -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield dotted name and an empty array for every repeated fixed-width field that has no element."""
    for field in message.DESCRIPTOR.fields:
        name = prefix + field.name
        if field.is_repeated:
            if field.type == FieldDescriptor.TYPE_MESSAGE:
                raise TypeError(f"{field.full_name}: expected no repeated message in a fixed layout")
            if field.type in DTYPES and not len(getattr(message, field.name)):
                yield name, np.empty(0, DTYPES[field.type])
        elif field.type == FieldDescriptor.TYPE_MESSAGE and message.HasField(field.name):
            yield from _empty(getattr(message, field.name), f"{name}.")


class FixedLayout:
    """One message of constant layout in a persistent buffer, with a view of every fixed-width field.

    Strings, enums and varints are part of the template: they cannot be changed, and a message in which
    they differ is not loaded. The views are not aligned to their item size in general: numpy copes with
    that, compiled code must be given an aligned copy.

    Args:
        message: protobuf message with every field that shall be present set to its final size;
            nested messages may be present, repeated messages may not.

    Attributes:
        regions: place of every fixed-width field, by dotted name such as ``"trial.position"``.
        views: 1-D array into the buffer for every fixed-width field, one element for a scalar, none for
            an empty repeated field. A message or scalar that is absent has no view.
        buffer: the message with the present values, which the views look into.
        size: length of the message [bytes].
        template: the bytes of the message as first given.

    Raises:
        TypeError: the message has repeated messages or unpacked arrays.
    """

    def __init__(self, message: Any) -> None:
        self.template: bytes = message.SerializeToString()
        self.size = len(self.template)
        self.regions = dict(_regions(self.template, 0, self.size, message.DESCRIPTOR, ""))
        self.buffer = bytearray(self.template)
        self.views: dict[str, NDArray[Any]] = {
            name: np.frombuffer(self.buffer, region.dtype, region.size, region.offset)
            for name, region in self.regions.items()
        }
        self.views.update(_empty(message))
        self._constants = _constants(self.regions, self.size)
        self._unpack = self._constants.unpack
        self._expected = self._unpack(self.template)

    def payload(self) -> bytes:
        """Return the message with the present values, as protobuf itself would serialise it."""
        return bytes(self.buffer)

    def load(self, data: bytes) -> bool:
        """Take over the values of a serialised message if it has this very layout.

        Args:
            data: a serialised message.

        Returns:
            False, and nothing is changed, if the length or any byte outside the values differs: then
            parse ``data`` and :meth:`fill` the result.
        """
        if len(data) != self.size or self._unpack(data) != self._expected:
            return False
        self.buffer[:] = data
        return True

    def fits(self, other: FixedLayout) -> bool:
        """Tell whether messages of another layout can be loaded."""
        return other.size == self.size and self._unpack(other.template) == self._expected

    def fill(self, message: Any) -> None:
        """Take over the values of a parsed message, whatever encoding it came in.

        Raises:
            ValueError: a field has another size, is missing or additional, or a string or enum differs.
        """
        known = type(message)()
        known.CopyFrom(message)
        known.DiscardUnknownFields()
        if not self.load(known.SerializeToString()):
            raise ValueError(self._difference(known))

    def _difference(self, message: Any) -> str:
        other = FixedLayout(message)
        name = message.DESCRIPTOR.name
        for field in self.views | other.views:
            expected, got = self.views.get(field), other.views.get(field)
            if expected is None or got is None or len(expected) != len(got):
                sizes = ["no field" if view is None else f"{len(view)} values" for view in (expected, got)]
                return f"{name}.{field}: expected {sizes[0]}; got {sizes[1]}"
        ours, theirs = dict(_words(type(message).FromString(self.template))), dict(_words(message))
        for word, expected in ours.items():
            if theirs[word] != expected:
                return f"{name}.{word}: expected {_word(expected)}; got {_word(theirs[word])}"
        return f"{name}: expected other bytes between its values"


def _words(message: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield dotted name and value of every field of other than fixed width; an enum's name, None for none."""
    for field in message.DESCRIPTOR.fields:
        name, value = prefix + field.name, getattr(message, field.name)
        if field.type == FieldDescriptor.TYPE_MESSAGE:
            yield from _words(value, f"{name}.")
        elif field.type not in DTYPES:
            if field.has_presence and not message.HasField(field.name):
                value = None
            elif field.type == FieldDescriptor.TYPE_ENUM and value in field.enum_type.values_by_number:
                value = field.enum_type.values_by_number[value].name
            yield name, value


def _word(value: Any) -> str:
    """Return a value for an error, not longer than a line."""
    return "nothing" if value is None else reprlib.repr(value).replace("'", '"')


def _constants(regions: dict[str, Region], size: int) -> struct.Struct:
    """Return a structure that unpacks the bytes between the values and skips the values."""
    parts, at = ["<"], 0
    for region in sorted(regions.values()):
        parts += [f"{region.offset - at}s", f"{region.end - region.offset}x"]
        at = region.end
    parts.append(f"{size - at}s")
    return struct.Struct("".join(parts))
