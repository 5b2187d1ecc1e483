"""What a log gives: messages, what is missing, what it is about."""

from __future__ import annotations

from typing import Any, NamedTuple


class RawMessage(NamedTuple):
    """A message as it was logged: topic, simulation time [ns], protobuf bytes."""

    topic: str
    time_ns: int
    payload: bytes


class DecodedMessage(NamedTuple):
    """A message parsed: topic, simulation time [ns], protobuf message of ``linkwind.v1``."""

    topic: str
    time_ns: int
    message: Any


class Damage(NamedTuple):
    """What is missing from a log.

    Attributes:
        bytes_lost: length of what cannot be read.
        messages_lost: messages known to be missing; there were more where ``cut`` is set.
        cut: the file ends without its summary, so that what came after its end is unknown.
        text: where and why, for people.
    """

    bytes_lost: int
    messages_lost: int
    cut: bool
    text: str


class LogInfo(NamedTuple):
    """What ``linkwind log info`` tells.

    Attributes:
        messages: in the log.
        topics: messages of each topic.
        steps: communication steps.
        complete: whether the run came to its end and every message of it is there.
        scenario: its name.
        versions: of the programs that made the log, and the processor.
        missed: messages that a listener has missed, of each topic.
    """

    messages: int
    topics: dict[str, int]
    steps: int
    complete: bool
    scenario: str
    versions: dict[str, str]
    missed: dict[str, int]
