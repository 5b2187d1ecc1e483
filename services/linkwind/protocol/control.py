"""Control messages: what both sides make of hand-shake, end and faults."""

from __future__ import annotations

from typing import Any

from linkwind import __version__
from linkwind.errors import FaultError, LinkwindError, ProtocolError
from linkwind.schema import MESSAGES

Control = MESSAGES["Control"]
PROGRAM = f"linkwind {__version__}"  # Hello.version of linkwind's own providers


def fault(participant: str, step: int, iteration: int, error: BaseException) -> bytes:
    """Return the Fault message that tells the others why ``participant`` cannot go on."""
    text = str(error) if isinstance(error, LinkwindError) else f"{type(error).__name__}: {error}"
    body = {
        "participant": participant,
        "step": step,
        "iteration": iteration,
        "code": type(error).__name__,
        "text": text,
    }
    return bytes(Control(fault=body).SerializeToString())


def refuse(reason: str) -> bytes:
    """Return the answer to somebody who may not take part."""
    return bytes(Control(refuse={"reason": reason}).SerializeToString())


def fault_error(payload: bytes) -> FaultError:
    """Return a received Fault message as an exception."""
    message = parse(payload, "fault")
    f = message.fault
    return FaultError(f'"{f.participant}" stopped at step {f.step}: {f.code}: {f.text}')


def parse(payload: bytes, *expected: str) -> Any:
    """Decode a control message and check that it is one of ``expected``."""
    try:
        message = Control.FromString(payload)
    except Exception as error:
        raise ProtocolError(f"control: expected a Control message; got {len(payload)} other bytes") from error
    got = message.WhichOneof("body")
    if got not in expected:
        raise ProtocolError(f"control: expected one of {', '.join(expected)}; got {got or 'nothing'}")
    return message
