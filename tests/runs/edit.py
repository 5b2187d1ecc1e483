"""Changes a log with right checksums, through mcap's own reader and writer."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from linkwind.log import contents
from linkwind.schema import MESSAGES

Edit = Callable[[str, int, bytes], bytes | None]


def rewrite(
    source: Path,
    target: Path,
    edit: Edit = lambda topic, number, payload: payload,
    metadata: dict[str, dict[str, str]] | None = None,
) -> Path:
    """Copy a log; ``edit`` is given topic, number (from 1) and payload and returns another payload, or None.

    Args:
        source: log to copy.
        target: log to make.
        edit: what to do with each message.
        metadata: values to write over, by name of the record.
    """
    with source.open("rb") as old, target.open("wb") as new:
        reader, writer = make_reader(old), Writer(new, chunk_size=100_000, compression=CompressionType.NONE)
        writer.start(profile=contents.PROFILE)
        for record in reader.iter_metadata():
            values = record.metadata | (metadata or {}).get(record.name, {})
            values.pop("crc32")
            writer.add_metadata(record.name, contents.sealed(values))
        for attachment in reader.iter_attachments():
            writer.add_attachment(0, 0, attachment.name, attachment.media_type, attachment.data)
        channels: dict[int, int] = {}
        for schema, channel, message in reader.iter_messages(log_time_order=False):
            payload = edit(channel.topic, message.sequence, message.data)
            if payload is None:
                continue
            if channel.id not in channels:
                number = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.id] = writer.register_channel(channel.topic, "protobuf", number)
            writer.add_message(
                channels[channel.id], message.log_time, payload, message.log_time, message.sequence
            )
        writer.finish()
    return target


def changed(topic: str, payload: bytes, field: str, index: int | None) -> bytes:
    """Return a message with the lowest bit of one value flipped, a text made another."""
    message = MESSAGES[str(contents.message_name(topic))].FromString(payload)
    *path, leaf = field.split(".")
    owner = message
    for name in path:
        owner = getattr(owner, name)
    if index is None:
        setattr(owner, leaf, flipped(getattr(owner, leaf)))
    else:
        getattr(owner, leaf)[index] = flipped(getattr(owner, leaf)[index])
    return bytes(message.SerializeToString())


def flipped(value: Any) -> Any:
    """Return a value with its lowest bit flipped."""
    if isinstance(value, str):
        return value + "x"
    if isinstance(value, int):
        return value ^ 3 if value in (1, 2) else value ^ 1
    (bits,) = struct.unpack("<q", struct.pack("<d", value))
    return struct.unpack("<d", struct.pack("<q", bits ^ 1))[0]
