"""What listeners are told of a run at its beginning and its end: to bytes and back.

The schema is ``schemas/linkwind/v1/observe.proto``.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from typing import Any, NamedTuple

from google.protobuf.message import DecodeError

from linkwind.errors import ProtocolError
from linkwind.schema import MESSAGES

Records = Mapping[str, Mapping[str, str]]

# Attachment of every log message on the bus: its number on its topic, from 1, and its simulation time [ns].
PLACE = struct.Struct("<QQ")


class Described(NamedTuple):
    """A run: its id, its resolved scenario, and the metadata of its log by name."""

    run: str
    scenario_json: str
    records: Records


class Ended(NamedTuple):
    """How a run ended, as metadata of its log by name; and how many messages each topic had."""

    records: Records
    counts: Mapping[str, int]


def description(run: str, scenario_json: str, records: Records) -> bytes:
    """Return the message Description."""
    message = MESSAGES["Description"](run=run, scenario_json=scenario_json, records=_listed(records))
    return bytes(message.SerializeToString())


def ending(records: Records, counts: Mapping[str, int]) -> bytes:
    """Return the message Ending."""
    listed = [{"topic": topic, "messages": count} for topic, count in sorted(counts.items())]
    return bytes(MESSAGES["Ending"](records=_listed(records), counts=listed).SerializeToString())


def described(payload: bytes) -> Described:
    """Return what a Description says.

    Raises:
        ProtocolError: it is none.
    """
    message = _parsed("Description", payload)
    return Described(message.run, message.scenario_json, _records(message))


def ended(payload: bytes) -> Ended:
    """Return what an Ending says.

    Raises:
        ProtocolError: it is none.
    """
    message = _parsed("Ending", payload)
    return Ended(_records(message), {count.topic: count.messages for count in message.counts})


def _parsed(name: str, payload: bytes) -> Any:
    try:
        return MESSAGES[name].FromString(payload)
    except DecodeError as error:
        raise ProtocolError(f"expected the message {name}; got {error}") from error


def _listed(records: Records) -> list[dict[str, Any]]:
    return [
        {"name": name, "entries": [{"key": key, "value": value} for key, value in sorted(record.items())]}
        for name, record in sorted(records.items())
    ]


def _records(message: Any) -> Records:
    return {record.name: {entry.key: entry.value for entry in record.entries} for record in message.records}
