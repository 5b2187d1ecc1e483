"""Frames as the log holds them: a flow as ``foxglove.Grid``, others as they were sent, without their sender.

With these others goes a picture for Foxglove, which does not know them.
"""

from __future__ import annotations

from linkwind.errors import LogError, ProtocolError
from linkwind.frames import FlowFrame, Frame, VolumeFrame, WakeFrame, logged
from linkwind.log import contents, grid, volumes, wakes
from linkwind.log.chunks import SchemaInfo

PICTURES = {contents.VOLUME: volumes.picture, contents.WAKE: wakes.picture}


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
        if topic.startswith(contents.VOLUME):
            return logged(VolumeFrame, payload)
        return logged(WakeFrame, payload)
    except ProtocolError as error:
        raise LogError(str(error)) from error


def picture(topic: str, payload: bytes) -> tuple[str, bytes] | None:
    """Return topic and message of the picture that goes with a logged message; None for one without."""
    for kind, drawn in PICTURES.items():
        if topic.startswith(kind):
            return contents.SCENE_OF[kind] + topic.removeprefix(kind), drawn(payload)
    return None
