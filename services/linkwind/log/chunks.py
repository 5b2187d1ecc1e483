"""MCAP at the level of bytes: records, chunks and the messages in them.

Only a chunk whose checksum is right is read; its messages are walked here, an order of magnitude faster
than by the ``mcap`` package, which parses the rare records. Opcodes and fields: https://mcap.dev/spec.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Container
from io import BytesIO
from mmap import mmap
from typing import Any, NamedTuple

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Schema
from mcap.stream_reader import get_chunk_data_stream

MAGIC = b"\x89MCAP0\r\n"
OPCODES = frozenset(int(opcode) for opcode in Opcode)
MESSAGE = int(Opcode.MESSAGE)

Data = bytes | mmap
Message = tuple[int, int, int, bytes]  # channel, how many-th message of it, simulation time [ns], payload

_HEAD = struct.Struct("<BQ")  # opcode, length of the content
# The same and, if it is a message, channel number, sequence and log time; publish time and payload follow.
# No record of a chunk is shorter than this.
_RECORD = struct.Struct("<BQHIQ")
_HEAD_SIZE, _PAYLOAD = _HEAD.size, _RECORD.size + 8
_CHUNK = struct.Struct("<QQQIIQ")  # times, size, checksum, length of the compression's name (0), of the data


class Span(NamedTuple):
    """A record: its opcode and where its content lies."""

    opcode: int
    start: int
    end: int


class SchemaInfo(NamedTuple):
    """A message type: its name, how it is defined, and the definition."""

    name: str = ""
    encoding: str = ""
    data: bytes = b""


class ChannelInfo(NamedTuple):
    """A channel: its topic, message type, and how messages are encoded."""

    topic: str
    schema: SchemaInfo
    encoding: str


def record_at(data: Data, at: int) -> Span | None:
    """Return the record that starts at byte ``at``; None if there is none that fits into the data."""
    if at + _HEAD.size > len(data):
        return None
    opcode, length = _HEAD.unpack_from(data, at)
    start = at + _HEAD.size
    if opcode not in OPCODES or length > len(data) - start:
        return None
    return Span(opcode, start, start + length)


def parsed(kind: Any, content: bytes) -> Any:
    """Return a record parsed by ``mcap``, None if the content is damaged."""
    try:
        return kind.read(ReadDataStream(BytesIO(content)))
    except Exception:  # the parser raises whatever the damaged bytes lead it to
        return None


def chunk_records(data: Data, span: Span, *, verified: bool = False) -> bytes | None:
    """Return the uncompressed records of a chunk; None unless it has a checksum and that is right.

    Args:
        data: the file.
        span: the chunk.
        verified: the checksum of the whole file is known to be right.
    """
    head = data[span.start : span.start + _CHUNK.size]
    if len(head) < _CHUNK.size or span.end - span.start < _CHUNK.size:
        return None
    _, _, _, crc, compression, size = _CHUNK.unpack(head)
    if compression:
        return _decompressed(data[span.start : span.end])
    records = data[span.start + _CHUNK.size : span.end]
    whole = size == len(records) and (verified or crc == zlib.crc32(records) != 0)
    return records if whole else None


def latest(data: Data, span: Span) -> int:
    """Return the latest simulation time in a chunk [ns], as it says itself, without a checksum of that."""
    _, end, *_ = _CHUNK.unpack_from(data, span.start)
    return int(end)


def _decompressed(content: bytes) -> bytes | None:
    """Return the records of a chunk that another tool compressed; None unless its checksum is right."""
    try:
        chunk = Chunk.read(ReadDataStream(BytesIO(content)))
        stream, size = get_chunk_data_stream(chunk)
        records: bytes = stream.read(size)
    except Exception:  # mcap's, zstandard's and lz4's own, whatever the damaged bytes lead them to
        return None
    return records if zlib.crc32(records) == chunk.uncompressed_crc != 0 else None


def messages_of(
    records: bytes, channels: dict[int, ChannelInfo], wanted: Container[int] | None = None
) -> list[Message]:
    """Return the messages of a chunk in order, and add the channels that it introduces to ``channels``.

    Args:
        records: of the chunk.
        channels: known so far; is added to.
        wanted: the channels whose messages are returned; None for all.
    """
    record = _RECORD.unpack_from
    found: list[Message] = []
    schemas: dict[int, SchemaInfo] = {}
    at, end = 0, len(records)
    while at < end:
        opcode, length, channel, sequence, time_ns = record(records, at)
        behind = at + _HEAD_SIZE + length
        if opcode != MESSAGE:
            add_channel(opcode, records[at + _HEAD_SIZE : behind], schemas, channels)
        elif wanted is None or channel in wanted:
            found.append((channel, sequence, time_ns, records[at + _PAYLOAD : behind]))
        at = behind
    return found


def places_of(records: bytes) -> dict[int, list[tuple[int, int]]]:
    """Return time [ns] and place of the messages of a chunk by channel, as its index would."""
    found: dict[int, list[tuple[int, int]]] = {}
    at, end = 0, len(records)
    while at < end:
        opcode, length, channel, _, time_ns = _RECORD.unpack_from(records, at)
        if opcode == MESSAGE:
            found.setdefault(channel, []).append((time_ns, at))
        at += _HEAD.size + length
    return found


def add_channel(
    opcode: int, content: bytes, schemas: dict[int, SchemaInfo], channels: dict[int, ChannelInfo]
) -> None:
    """Take in a Schema or a Channel record; a channel follows its schema."""
    if opcode == Opcode.SCHEMA:
        schema = parsed(Schema, content)
        schemas[schema.id] = SchemaInfo(schema.name, schema.encoding, schema.data)
    elif opcode == Opcode.CHANNEL:
        channel = parsed(Channel, content)
        schema = schemas.get(channel.schema_id, SchemaInfo())
        channels.setdefault(channel.id, ChannelInfo(channel.topic, schema, channel.message_encoding))
