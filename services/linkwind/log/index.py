"""Where everything is in a log of any size, also one that is being written.

A whole file tells it in its summary; of another one the heads of the records are read, a few bytes each.
"""

from __future__ import annotations

import mmap
import os
import struct
import weakref
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import AttachmentIndex, Footer, MetadataIndex
from numpy.typing import NDArray

from linkwind.log.chunks import (
    MAGIC,
    OPCODES,
    ChannelInfo,
    SchemaInfo,
    Span,
    add_channel,
    chunk_records,
    messages_of,
    parsed,
    places_of,
    record_at,
)
from linkwind.log.scan import Contents, Gap, next_chunk, take_rare

FOOTER = 9 + 20 + len(MAGIC)  # bytes at the end of a whole file: the footer's record and the magic
SUMMED = 9 + 16  # of them, those that the summary's checksum covers

_HEAD = struct.Struct("<BQ")  # opcode, length of the content
_TIMES = struct.Struct("<QQ")  # first and last time of a chunk [ns], at the start of its content
_CHUNK_INDEX = struct.Struct("<QQQQI")  # the times, place and length of the chunk; how many bytes of places
_PLACE = struct.Struct("<HQ")  # a channel, and where its index of the chunk is
UNWRITTEN = -1  # place of an index that is not in the file
PEEK = _HEAD.size + _TIMES.size

Times = NDArray[np.int64]


class ChunkAt(NamedTuple):
    """A chunk: first and last time [ns], its content, and where each channel's index is, or UNWRITTEN."""

    start_ns: int
    end_ns: int
    span: Span
    indexes: dict[int, int]


class Index:
    """The chunks of a file, and its other records.

    Attributes:
        chunks: in the order of the file.
        times: first and last time of each chunk [ns], shape (chunks, 2).
        channels: by number.
        contents: metadata, attachments, and what is damaged.
        ended: whether the writer has finished the file.
        close: closes the file, as happens anyway when nobody has the index any more.
    """

    def __init__(self, path: Path) -> None:
        """Find out what there is now; the file starts with MCAP's magic bytes."""
        self._file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
        self.close = weakref.finalize(self, os.close, self._file)
        self._at = len(MAGIC)  # where the records begin that have not been looked at
        self._good: set[int] = set()  # chunks whose checksum was found right, by place
        self.chunks: list[ChunkAt] = []
        self.channels: dict[int, ChannelInfo] = {}
        self.contents = Contents()
        self.ended = self._read_summary()
        self._walk()

    def grow(self) -> bool:
        """Take in what was written since the last look; tell whether there was anything."""
        before = self._at
        if not self.ended:
            self._walk()
        return self._at != before

    def has_name(self, path: Path) -> bool:
        """Tell whether the file still has its name, or no other has it."""
        try:
            return path.stat().st_ino == os.fstat(self._file).st_ino
        except FileNotFoundError:
            return True

    def records(self, chunk: ChunkAt) -> bytes:
        """Return the records of a chunk; none, and a gap in the contents, if its checksum is wrong."""
        place, size = chunk.span.start, chunk.span.end - chunk.span.start
        content = self._read(place, size)
        span = Span(chunk.span.opcode, 0, len(content))
        records = chunk_records(content, span, verified=place in self._good)
        if records is None:
            self._lost(place, size, "a chunk is damaged")
            return b""
        self._good.add(place)
        return records

    def entries(self, chunk: ChunkAt, channel: int) -> Times:
        """Return times [ns] and places of a channel's messages in a chunk, shape (k, 2), in order of time."""
        if chunk.indexes[channel] == UNWRITTEN:
            entries = np.array(places_of(self.records(chunk)).get(channel, []), np.int64).reshape(-1, 2)
        else:
            opcode, content = self._record(chunk.indexes[channel])
            if opcode != Opcode.MESSAGE_INDEX or (len(content) - 6) % 16:
                return np.empty((0, 2), np.int64)
            entries = np.frombuffer(content, "<u8", offset=6).reshape(-1, 2).astype(np.int64)
        return entries[np.argsort(entries[:, 0], kind="stable")]

    def _read(self, at: int, size: int) -> bytes:
        return os.pread(self._file, size, at)

    def _record(self, at: int) -> tuple[int, bytes]:
        """Return opcode and content of the record that starts at a byte."""
        head = self._read(at, _HEAD.size)
        if len(head) < _HEAD.size:
            return 0, b""
        opcode, length = _HEAD.unpack(head)
        return opcode, self._read(at + _HEAD.size, min(length, self._size))

    @property
    def _size(self) -> int:
        return os.fstat(self._file).st_size

    def _read_summary(self) -> bool:
        """Take in the summary of a whole file; tell whether it is there, right, and has chunks."""
        end = self._size - FOOTER
        tail = self._read(max(0, end), FOOTER)
        span = record_at(tail, 0) if tail.endswith(MAGIC) else None
        if span is None or span.opcode != Opcode.FOOTER:
            return False
        footer = parsed(Footer, tail[span.start : span.end])
        if footer is None or not 0 < footer.summary_start <= end:
            return False
        summary = self._read(footer.summary_start, end - footer.summary_start)
        if zlib.crc32(summary + tail[:SUMMED]) != footer.summary_crc:
            return False
        take_rare(*self._record(len(MAGIC)), self.contents)
        schemas: dict[int, SchemaInfo] = {}
        at = 0
        while (record := record_at(summary, at)) is not None:
            self._take_summary(record.opcode, summary[record.start : record.end], schemas)
            at = record.end
        self.times = self._times()
        return bool(self.chunks)

    def _take_summary(self, opcode: int, content: bytes, schemas: dict[int, SchemaInfo]) -> None:
        if opcode == Opcode.CHUNK_INDEX:
            start_ns, end_ns, at, length, size = _CHUNK_INDEX.unpack_from(content)
            places = content[_CHUNK_INDEX.size : _CHUNK_INDEX.size + size]
            span = Span(int(Opcode.CHUNK), at + _HEAD.size, at + length)
            self.chunks.append(ChunkAt(start_ns, end_ns, span, dict(_PLACE.iter_unpack(places))))
        elif opcode in (Opcode.METADATA_INDEX, Opcode.ATTACHMENT_INDEX):
            kind = MetadataIndex if opcode == Opcode.METADATA_INDEX else AttachmentIndex
            take_rare(*self._record(parsed(kind, content).offset), self.contents)
        else:
            add_channel(opcode, content, schemas, self.channels)

    def _walk(self) -> None:
        """Take in the records from where the last walk ended, as far as they are whole."""
        size = self._size
        while not self.ended:
            peek = self._read(self._at, PEEK)
            if len(peek) < _HEAD.size:
                break
            opcode, length = _HEAD.unpack_from(peek)
            start = self._at + _HEAD.size
            if opcode in OPCODES and start + length <= size:
                self._take(opcode, Span(opcode, start, start + length), peek)
                self._at = start + length
            elif not self._skip_damage():
                break
        if self.chunks and not self.ended:
            self._complete(self.chunks[-1])
        self.times = self._times()

    def _complete(self, last: ChunkAt) -> None:
        """Note channels of the last chunk whose index has not been written, or was cut off."""
        for channel in places_of(self.records(last)):
            last.indexes.setdefault(channel, UNWRITTEN)
            self._name(channel, last)

    def _name(self, channel: int, chunk: ChunkAt) -> None:
        """Take in the channels that a chunk introduces, if a channel of it is not known."""
        if channel not in self.channels:
            messages_of(self.records(chunk), self.channels, ())

    def _take(self, opcode: int, span: Span, peek: bytes) -> None:
        if opcode == Opcode.CHUNK:
            start_ns, end_ns = _TIMES.unpack_from(peek, _HEAD.size)
            self.chunks.append(ChunkAt(start_ns, end_ns, span, {}))
        elif opcode == Opcode.MESSAGE_INDEX and self.chunks:
            channel = int.from_bytes(peek[_HEAD.size : _HEAD.size + 2], "little")
            self.chunks[-1].indexes[channel] = self._at
            self._name(channel, self.chunks[-1])
        elif opcode == Opcode.DATA_END:
            self.ended = True
        elif not take_rare(opcode, self._read(span.start, span.end - span.start), self.contents):
            name = Opcode(opcode).name.lower().replace("_", " ")
            self._lost(self._at, span.end - self._at, f"a {name} is damaged")

    def _skip_damage(self) -> bool:
        """Go on at the next chunk that is whole, if there is one behind what cannot be read."""
        with mmap.mmap(self._file, 0, access=mmap.ACCESS_READ) as data:
            found = next_chunk(data, self._at)
        if found is None:
            return False
        self._lost(self._at, found - self._at, "records are damaged")
        self._at = found
        return True

    def _lost(self, at: int, size: int, reason: str) -> None:
        gap = Gap(at, size, reason)
        if gap not in self.contents.gaps:
            self.contents.gaps.append(gap)

    def _times(self) -> Times:
        return np.array([(c.start_ns, c.end_ns) for c in self.chunks], np.int64).reshape(-1, 2)
