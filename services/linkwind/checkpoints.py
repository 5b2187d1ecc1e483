"""All memory of a provider at one time: an opaque blob of any size, split into messages and joined again.

A message Checkpoint is one piece of it, on the bus, there and back, and in the log. The schema is
``schemas/linkwind/v1/observe.proto``.
"""

from __future__ import annotations

import errno
import hashlib
import shutil
import tempfile
import weakref
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import IO, Any

from google.protobuf.message import DecodeError

from linkwind.errors import ParticipantError, ProtocolError
from linkwind.schema import MESSAGES

PIECE = 2**20  # bytes of state in a message, at most; a larger state need not be in memory
COMMON = ("number", "step", "time_ns", "size", "sha256")  # the same in every piece of a checkpoint


class State:
    """What a force model saved: bytes that are read piece by piece, in memory or in a file without a name.

    Attributes:
        size: how many.
        sha256: of them all.
    """

    def __init__(self, file: IO[bytes], size: int, sha256: bytes) -> None:
        """Take over a file, which is closed when nobody has the state any more."""
        self.size, self.sha256, self._file = size, sha256, file
        weakref.finalize(self, file.close)

    @classmethod
    def of(cls, blob: bytes) -> State:
        """Return bytes as a state; they are not copied."""
        return cls(BytesIO(blob), len(blob), hashlib.sha256(blob).digest())

    def read(self, offset: int, most: int) -> bytes:
        """Return so many bytes from a place on, fewer at the end."""
        self._file.seek(offset)
        return self._file.read(most)

    def whole(self) -> bytes:
        """Return all bytes; those in memory are not copied."""
        return self._file.getvalue() if isinstance(self._file, BytesIO) else self.read(0, self.size)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, State) and (self.size, self.sha256) == (other.size, other.sha256)

    def __hash__(self) -> int:
        return hash(self.sha256)


@dataclass(frozen=True)
class Checkpoint:
    """A provider's memory, after it has committed a communication point and before it evaluates the next.

    Attributes:
        number: of the provider's checkpoints, from 1.
        step: index k of the communication point.
        time_ns: its simulation time t_k [ns].
        state: what the force model saved.
    """

    number: int
    step: int
    time_ns: int
    state: State

    def piece(self, run: str, provider: str, offset: int, most: int) -> Any:
        """Return a message Checkpoint.

        Args:
            run: id of the run.
            provider: whose memory it is.
            offset: where in the state the piece begins.
            most: bytes of state in it, at most.
        """
        return MESSAGES["Checkpoint"](
            run=run,
            provider=provider,
            number=self.number,
            step=self.step,
            time_ns=self.time_ns,
            size=self.state.size,
            sha256=self.state.sha256,
            offset=offset,
            state=self.state.read(offset, most),
        )

    def pieces(self, run: str, provider: str) -> Iterator[bytes]:
        """Yield the messages, each made when it is asked for; of an empty state there is one."""
        for offset in range(0, max(1, self.state.size), PIECE):
            yield bytes(self.piece(run, provider, offset, PIECE).SerializeToString())


class Sequence:
    """The order of the pieces of one checkpoint.

    Attributes:
        next: byte of the state that the next piece begins with.
    """

    def __init__(self, what: str) -> None:
        """Wait for the first piece; ``what`` is whose checkpoint it is, for errors."""
        self.next = 0
        self._what = what
        self._common: dict[str, Any] = {}

    def take(self, piece: Any) -> bool:
        """Take a message Checkpoint; tell whether it was the last piece.

        Raises:
            ProtocolError: it is not the next piece of this checkpoint.
        """
        common = {name: getattr(piece, name) for name in COMMON}
        what = f"{self._what}: number {piece.number}"
        for name, expected in self._common.items():
            if common[name] != expected:
                raise ProtocolError(
                    f"{what}: expected a piece of {name} {_shown(expected)}, as the one before; got "
                    f"{_shown(common[name])}. The rest of that checkpoint was lost."
                )
        if piece.offset != self.next:
            raise ProtocolError(
                f"{what}: expected the piece that begins with byte {self.next}; got that of byte "
                f"{piece.offset}. A piece was lost, came twice, or in another order."
            )
        behind = piece.offset + len(piece.state)
        if behind > piece.size or (behind == piece.offset and piece.size):
            raise ProtocolError(
                f"{what}: expected a piece with 1 to {piece.size - piece.offset} of its {piece.size} bytes; "
                f"got {len(piece.state)}."
            )
        self._common, self.next = common, behind
        return bool(behind == piece.size)


def _shown(value: int | bytes) -> str:
    return value.hex()[:12] if isinstance(value, bytes) else str(value)


class Joining:
    """The pieces of one checkpoint, put together as they come."""

    def __init__(self, what: str, *, in_memory: bool = False) -> None:
        """Wait for the first piece.

        Args:
            what: whose checkpoint it is, for errors.
            in_memory: the whole will be wanted at once; else what is larger than a piece goes to a file.
        """
        self._what, self._in_memory = what, in_memory
        self._sequence = Sequence(what)
        self._sha256 = hashlib.sha256()
        self._file: IO[bytes] = BytesIO() if in_memory else tempfile.SpooledTemporaryFile(PIECE)  # noqa: SIM115
        self._abandoned = weakref.finalize(self, self._file.close)

    @property
    def next(self) -> int:
        """Byte of the state that the next piece begins with."""
        return self._sequence.next

    def add(self, piece: Any) -> Checkpoint | None:
        """Take a message Checkpoint; return the whole if it was the last piece.

        Raises:
            ProtocolError: it is not the next piece of this checkpoint, or the whole is damaged.
            ParticipantError: there is no room for the whole.
        """
        last = self._sequence.take(piece)
        self._keep(piece)
        self._sha256.update(piece.state)
        if not last:
            return None
        if self._sha256.digest() != piece.sha256:
            raise ProtocolError(
                f"{self._what}: number {piece.number}: expected SHA-256 {_shown(piece.sha256)}, as it says; "
                f"got {_shown(self._sha256.digest())}. It was damaged on the way."
            )
        self._abandoned.detach()
        state = State(self._file, piece.size, piece.sha256)
        return Checkpoint(piece.number, piece.step, piece.time_ns, state)

    def _keep(self, piece: Any) -> None:
        try:
            if not (self._in_memory or piece.offset or piece.size <= PIECE):
                free = shutil.disk_usage(tempfile.gettempdir()).free
                if piece.size > free:
                    raise OSError(errno.ENOSPC, f"room for {free}")
            self._file.write(piece.state)
        except OSError as error:
            raise ParticipantError(
                f"{self._what}: number {piece.number}: expected room for {piece.size} bytes among temporary "
                f"files; got {error.strerror}. Free space, or name a folder that has more by TMPDIR."
            ) from error


def decode(payload: bytes, run: str, provider: str) -> Any:
    """Return a message Checkpoint, a piece of one.

    Args:
        payload: an encoded message.
        run: that it must be of.
        provider: that it must come from.

    Raises:
        ProtocolError: it is not such a message, or of another run or provider.
    """
    what = f"{named(provider)}: expected a Checkpoint of this run"
    try:
        piece = MESSAGES["Checkpoint"].FromString(payload)
    except DecodeError as error:
        raise ProtocolError(f"{what}; got {error}") from error
    if (piece.run, piece.provider) != (run, provider):
        raise ProtocolError(f'{what}; got one of run {piece.run} from "{piece.provider}"')
    return piece


def named(provider: str) -> str:
    """Return what errors call a checkpoint of a provider."""
    return f'checkpoint from "{provider}"'
