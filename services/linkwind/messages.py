"""The messages of the lock-step loop: arrays to bytes and back, each in one place.

A message object owns one buffer for good. Its arrays are views into that buffer, so that encoding is a
copy of the buffer and decoding a copy into it; the schema is ``schemas/linkwind/v1/lockstep.proto``.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence

from google.protobuf.message import DecodeError

from linkwind.errors import ProtocolError
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion, Wrench
from linkwind.wire import FixedLayout

KINDS = {"point": 1, "mean": 2}


def _zeros(count: int) -> list[float]:
    return [0.0] * count


_STAMP = struct.Struct(
    "<QBIBQ"
)  # step, iteration and time_ns, which follow each other, with the tags between


class _Message:
    """A message of fixed layout with the scalars that every exchange carries.

    Attributes:
        at: which exchange it belongs to: index of the communication point, coupling iteration.
        time_ns: simulation time of the communication point [ns].
        layout: the message itself.
    """

    __slots__ = ("_name", "_stamp_at", "_tags", "at", "layout", "time_ns")

    def __init__(self, name: str, **fields: object) -> None:
        self._name = name
        self.layout = FixedLayout(MESSAGES[name](**fields))
        self._stamp_at = self.layout.regions["step"].offset
        _, first, _, second, _ = _STAMP.unpack_from(self.layout.buffer, self._stamp_at)
        self._tags = first, second
        self._read_stamp()

    def _read_stamp(self) -> None:
        step, _, iteration, _, self.time_ns = _STAMP.unpack_from(self.layout.buffer, self._stamp_at)
        self.at: tuple[int, int] = step, iteration

    def payload(self) -> bytes:
        """Return the encoded message."""
        return self.layout.payload()

    def load(self, payload: bytes, what: str) -> None:
        """Decode ``payload`` into the arrays.

        Args:
            payload: an encoded message.
            what: where it came from, for the error.

        Raises:
            ProtocolError: it is not such a message, or is of another run, sender or size.
        """
        if self.layout.load(payload):
            self._read_stamp()
            return
        try:
            self.layout.fill(MESSAGES[self._name].FromString(payload))
        except DecodeError as error:
            raise ProtocolError(f"{what}: expected a {self._name} of this run; got {error}") from error
        except ValueError as error:
            raise ProtocolError(
                f"{what}: {error}. Every message is of the run of Welcome, and of the form that Ready says."
            ) from error
        self._read_stamp()

    def fits(self, other: _Message) -> bool:
        """Tell whether another message has the same layout."""
        return self.layout.fits(other.layout)

    def stamp(self, step: int, iteration: int, time_ns: int) -> None:
        """Set which exchange this message belongs to."""
        first, second = self._tags
        _STAMP.pack_into(self.layout.buffer, self._stamp_at, step, first, iteration, second, time_ns)
        self.at, self.time_ns = (step, iteration), time_ns


class MotionMessage(_Message):
    """Accepted state at t_k and trial state at t_(k+1) of ``n`` bodies.

    Attributes:
        accepted: state to commit, see :class:`linkwind.spatial.Motion`.
        trial: state to evaluate.
    """

    __slots__ = ("accepted", "trial")

    def __init__(self, run: str, n: int) -> None:
        def motion() -> object:
            return MESSAGES["Motion"](
                position=_zeros(3 * n), orientation=_zeros(4 * n), linear=_zeros(3 * n), angular=_zeros(3 * n)
            )

        super().__init__(
            "MotionStep",
            run=run,
            step=0,
            iteration=0,
            time_ns=0,
            final=0,
            accepted=motion(),
            trial=motion(),
        )
        self.accepted = Motion.of(self.layout.views, "accepted")
        self.trial = Motion.of(self.layout.views, "trial")

    @property
    def final(self) -> bool:
        """Whether the run is over: ``accepted`` is the last state, nothing is to be evaluated."""
        return bool(self.layout.views["final"][0])

    @final.setter
    def final(self, value: bool) -> None:
        self.layout.views["final"][0] = int(value)


class WrenchMessage(_Message):
    """Answer of one provider for its ``n`` bodies.

    Attributes:
        wrench: forces, see :class:`linkwind.spatial.Wrench`.
    """

    __slots__ = ("wrench",)

    def __init__(
        self,
        run: str,
        provider: str,
        n: int,
        *,
        kind: str = "point",
        added_inertia: bool = False,
        response_size: int = 0,
        diagnostics: Sequence[str] = (),
    ) -> None:
        super().__init__(
            "WrenchStep",
            run=run,
            provider=provider,
            step=0,
            iteration=0,
            time_ns=0,
            kind=KINDS[kind],
            force=_zeros(3 * n),
            torque=_zeros(3 * n),
            added_inertia=_zeros(36 * n) if added_inertia else (),
            response=_zeros(response_size),
            diagnostics=_zeros(len(diagnostics)),
        )
        views = self.layout.views
        coupled = response_size == 36 * n * n
        self.wrench = Wrench(
            views["force"].reshape(n, 3),
            views["torque"].reshape(n, 3),
            views["added_inertia"].reshape(n, 6, 6) if added_inertia else None,
            views["response"].reshape((6 * n, 6 * n) if coupled else (n, 6, 6)) if response_size else None,
            views["diagnostics"] if diagnostics else None,
        )
