"""Frames as the log holds them: a flow as ``foxglove.Grid``, wakes as ``WakeFrame`` without its sender."""

from __future__ import annotations

from linkwind.errors import LogError, ProtocolError
from linkwind.frames import FlowFrame, Frame, logged_wake
from linkwind.log import contents, grid
from linkwind.log.chunks import SchemaInfo


def topic_of(frame: Frame, provider: str) -> str:
    """Return the topic of a provider's frames of this kind."""
    return f"/{frame.KIND}/{provider}"


def encode(frame: Frame) -> bytes:
    """Return the message that is logged."""
    return grid.encode(frame) if isinstance(frame, FlowFrame) else frame.encode()


def decode(topic: str, schema: SchemaInfo, payload: bytes, step_ns: int) -> Frame:
    """Return the frame that a logged message is.

    Args:
        topic: that it is of.
        schema: of the topic, as the file carries it.
        payload: the message.
        step_ns: communication step size of the run [ns].

    Raises:
        LogError: it is none.
    """
    if topic.startswith(contents.FLOW):
        return grid.decode(payload, schema.name, schema.data, step_ns)
    try:
        return logged_wake(payload)
    except ProtocolError as error:
        raise LogError(str(error)) from error
