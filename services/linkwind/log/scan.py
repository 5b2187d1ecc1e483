"""A first pass over an MCAP file that may be cut or damaged: what it holds, and what is lost.

Nothing is taken over without a checksum that holds: chunks and attachments have one in MCAP, linkwind's
metadata have their own, the summary at the end has one.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from typing import NamedTuple

from mcap.opcode import Opcode
from mcap.records import Attachment, DataEnd, Footer, Header, Metadata, Statistics

from linkwind.log.chunks import (
    MAGIC,
    ChannelInfo,
    Data,
    SchemaInfo,
    Span,
    add_channel,
    chunk_records,
    parsed,
    record_at,
)
from linkwind.log.contents import unsealed

CHUNK_BYTE = bytes([Opcode.CHUNK])


class Gap(NamedTuple):
    """Bytes of a file that cannot be read, and why."""

    offset: int
    size: int
    reason: str


@dataclass
class Contents:
    """What a file holds.

    Attributes:
        profile: of the header.
        chunks: the chunks whose checksum is right, in order.
        metadata: records by name.
        attachments: contents by name.
        channels: by number, as far as the summary tells.
        counts: messages written, by number of channel; None without a summary.
        gaps: what cannot be read.
        verified: the checksum over all but the summary is right.
    """

    profile: str = ""
    chunks: list[Span] = field(default_factory=list)
    metadata: dict[str, dict[str, str]] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    channels: dict[int, ChannelInfo] = field(default_factory=dict)
    counts: dict[int, int] | None = None
    gaps: list[Gap] = field(default_factory=list)
    verified: bool = False


def scan(data: Data) -> Contents:
    """Return what ``data``, which starts with MCAP's magic bytes, holds."""
    contents = Contents()
    _read_summary(data, contents)
    at = len(MAGIC)
    while True:
        span = record_at(data, at)
        if span is None:
            at = _resynchronise(data, at, contents)
            if at == len(data):
                return contents
        elif span.opcode == Opcode.DATA_END:
            _check_end(data, at, span, contents)
            return contents
        else:
            at = _take(data, at, span, contents)


def _take(data: Data, at: int, span: Span, contents: Contents) -> int:
    """Take in one record; return where the next one starts."""
    if span.opcode == Opcode.CHUNK:
        readable = contents.verified or chunk_records(data, span) is not None
        if readable:
            contents.chunks.append(span)
        elif record_at(data, span.end) is None:  # then its length is wrong as well
            return _resynchronise(data, at, contents)
    elif span.opcode == Opcode.MESSAGE_INDEX:
        return span.end
    else:
        readable = take_rare(span.opcode, data[span.start : span.end], contents)
    if not readable:
        name = Opcode(span.opcode).name.lower().replace("_", " ")
        contents.gaps.append(Gap(at, span.end - at, f"a {name} is damaged"))
    return span.end


def take_rare(opcode: int, content: bytes, contents: Contents) -> bool:
    """Take in a header, a metadata record or an attachment; tell whether it could be read."""
    if opcode == Opcode.HEADER:
        header = parsed(Header, content)
        contents.profile = "" if header is None else header.profile
        return header is not None
    if opcode == Opcode.METADATA:
        metadata = parsed(Metadata, content)
        record = None if metadata is None else unsealed(metadata.metadata)
        if record is not None:
            contents.metadata[metadata.name] = record
        return record is not None
    if opcode == Opcode.ATTACHMENT and content[-4:] == struct.pack("<I", zlib.crc32(content[:-4])):
        attachment = parsed(Attachment, content)
        contents.attachments[attachment.name] = attachment.data
        return True
    return False  # linkwind writes no such record here


def _resynchronise(data: Data, at: int, contents: Contents) -> int:
    """Note a gap from ``at`` to the next chunk with a right checksum, or to the end; return its end."""
    found = next_chunk(data, at)
    if found is not None:
        contents.gaps.append(Gap(at, found - at, "records are damaged"))
        return found
    contents.gaps.append(Gap(at, len(data) - at, "the file is cut: its writer was stopped, or the disk full"))
    return len(data)


def next_chunk(data: Data, at: int) -> int | None:
    """Return where the first chunk with a right checksum behind byte ``at`` starts; None without any."""
    found = at
    while (found := data.find(CHUNK_BYTE, found + 1)) >= 0:
        span = record_at(data, found)
        if span is not None and chunk_records(data, span) is not None:
            return found
    return None


def _check_end(data: Data, at: int, span: Span, contents: Contents) -> None:
    end = parsed(DataEnd, data[span.start : span.end])
    if contents.counts is None:
        contents.gaps.append(Gap(at, len(data) - at, "the summary is damaged or cut"))
    elif not (contents.verified or contents.gaps or (end is not None and end.data_section_crc == 0)):
        contents.gaps.append(Gap(at, 0, "the checksum of the whole is wrong"))


def _read_summary(data: Data, contents: Contents) -> None:
    """Take in channels and counts from the summary at the end, if it is there and its checksum holds."""
    footer_at = len(data) - len(MAGIC) - 29
    span = record_at(data, footer_at) if footer_at > 0 and data[-len(MAGIC) :] == MAGIC else None
    footer = parsed(Footer, data[span.start : span.end]) if span and span.opcode == Opcode.FOOTER else None
    if footer is None or not 0 < footer.summary_start <= footer_at:
        return
    checked = memoryview(data)[footer.summary_start : len(data) - len(MAGIC) - 4]
    if zlib.crc32(checked) != footer.summary_crc:
        return
    contents.verified = _verified(data, footer.summary_start)
    schemas: dict[int, SchemaInfo] = {}
    at = footer.summary_start
    while at < footer_at and (record := record_at(data, at)) is not None:
        content = data[record.start : record.end]
        if record.opcode == Opcode.STATISTICS:
            contents.counts = parsed(Statistics, content).channel_message_counts
        else:
            add_channel(record.opcode, content, schemas, contents.channels)
        at = record.end


def _verified(data: Data, summary_start: int) -> bool:
    """Tell whether the checksum over everything before the summary is right."""
    at = summary_start - 13
    span = record_at(data, at) if at > 0 else None
    if span is None or span.opcode != Opcode.DATA_END or span.end != summary_start:
        return False
    end = parsed(DataEnd, data[span.start : span.end])
    return end is not None and end.data_section_crc == zlib.crc32(memoryview(data)[:at]) != 0
