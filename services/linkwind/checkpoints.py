"""All memory of a provider at one time, as an opaque blob: to bytes and back.

The schema is ``schemas/linkwind/v1/observe.proto``.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass

from google.protobuf.message import DecodeError

from linkwind.errors import ProtocolError
from linkwind.schema import MESSAGES


@dataclass(frozen=True)
class Checkpoint:
    """A provider's memory, after it has committed a communication point and before it evaluates the next.

    Attributes:
        step: index k of the communication point.
        time_ns: its simulation time t_k [ns].
        state: what the force model saved.
    """

    step: int
    time_ns: int
    state: bytes

    def encode(self, run: str, provider: str, number: int) -> bytes:
        """Return the message Checkpoint.

        Args:
            run: id of the run.
            provider: whose memory it is.
            number: of the provider's checkpoints, from 1.
        """
        message = MESSAGES["Checkpoint"](
            run=run, provider=provider, number=number, step=self.step, time_ns=self.time_ns,
            state=self.state, sha256=hashlib.sha256(self.state).digest(),
        )  # fmt: skip
        return bytes(message.SerializeToString())


def decode(payload: bytes, run: str, provider: str) -> tuple[int, Checkpoint]:
    """Return the number of a message Checkpoint, and the checkpoint.

    Args:
        payload: an encoded message.
        run: that it must be of.
        provider: that it must come from.

    Raises:
        ProtocolError: it is not such a message, of another run or provider, or damaged.
    """
    what = f'checkpoint from "{provider}": expected a Checkpoint of this run'
    try:
        message = MESSAGES["Checkpoint"].FromString(payload)
    except DecodeError as error:
        raise ProtocolError(f"{what}; got {error}") from error
    if (message.run, message.provider) != (run, provider):
        raise ProtocolError(f'{what}; got one of run {message.run} from "{message.provider}"')
    digest = hashlib.sha256(message.state).digest()
    if message.sha256 != digest:
        raise ProtocolError(f"{what}, SHA-256 {message.sha256.hex()[:12]}; got {digest.hex()[:12]}")
    return message.number, Checkpoint(message.step, message.time_ns, message.state)
