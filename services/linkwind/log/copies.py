"""Writing a log of messages that have their numbers already: from another file, or heard on the bus.

Numbers stay what they are, so that a reader knows which messages are missing. This is ``mcap``'s writer:
four times slower than the one of a run (``linkwind.log.writer``), which numbers by itself.
"""

from __future__ import annotations

from typing import IO

from mcap.writer import CompressionType, Writer

from linkwind.log import contents
from linkwind.log.chunks import SchemaInfo

CHUNK_SIZE = 256 * 1024  # bytes, as the log of a run has them


class CopyWriter:
    """A log in the making, with chunks as a run writes them; :meth:`finish` makes it whole."""

    def __init__(self, file: IO[bytes], library: str, chunk_size: int = CHUNK_SIZE) -> None:
        """Begin to write.

        Args:
            file: empty, open for writing.
            library: who writes, for people.
            chunk_size: messages are in the file when so many bytes of them have come.
        """
        self._writer = Writer(
            file, chunk_size=chunk_size, compression=CompressionType.NONE, enable_data_crcs=True
        )
        self._writer.start(profile=contents.PROFILE, library=library)
        self._schemas = {SchemaInfo(): 0}

    def record(self, name: str, record: dict[str, str]) -> None:
        """Write a metadata record."""
        self._writer.add_metadata(name, contents.sealed(record))

    def scenario(self, text: str) -> None:
        """Write the resolved scenario."""
        self._writer.add_attachment(0, 0, contents.SCENARIO, "application/json", text.encode())

    def channel(self, topic: str, schema: SchemaInfo, encoding: str = "protobuf") -> int:
        """Declare a channel and return its number."""
        if schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(*schema)
        return self._writer.register_channel(topic, encoding, self._schemas[schema])

    def message(self, channel: int, number: int, time_ns: int, payload: bytes) -> None:
        """Write the ``number``-th message of a channel, counted from 1, at its simulation time."""
        self._writer.add_message(channel, time_ns, payload, time_ns, number)

    def finish(self) -> None:
        """Write what belongs at the end."""
        self._writer.finish()  # type: ignore[no-untyped-call]
