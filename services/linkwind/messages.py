"""The messages of the lock-step loop: arrays to bytes and back, each in one place.

A message object owns one buffer for good. Its arrays are views into that buffer, so that encoding is a
copy of the buffer and decoding a copy into it; the schema is ``schemas/linkwind/v1/lockstep.proto``.
"""

from __future__ import annotations

from collections.abc import Sequence

from google.protobuf.message import DecodeError

from linkwind.errors import ProtocolError
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion, Wrench
from linkwind.wire import FixedLayout

KINDS = {"point": 1, "mean": 2}


def _zeros(count: int) -> list[float]:
    return [0.0] * count


class _Message:
    """A message of fixed layout with the scalars that every exchange carries."""

    __slots__ = ("_iteration", "_layout", "_name", "_step", "_time_ns")

    def __init__(self, name: str, **fields: object) -> None:
        self._name = name
        self._layout = FixedLayout(MESSAGES[name](**fields))
        views = self._layout.views
        self._step, self._iteration, self._time_ns = views["step"], views["iteration"], views["time_ns"]

    def payload(self) -> bytes:
        """Return the encoded message."""
        return self._layout.payload()

    def load(self, payload: bytes, what: str) -> None:
        """Decode ``payload`` into the arrays.

        Args:
            payload: an encoded message.
            what: where it came from, for the error.

        Raises:
            ProtocolError: it is not such a message, or is of another run, sender or size.
        """
        if self._layout.load(payload):
            return
        try:
            message = MESSAGES[self._name].FromString(payload)
            self._layout.fill(message)
        except (DecodeError, ValueError) as error:
            raise ProtocolError(f"{what}: expected a {self._name} of this run; got {error}") from error

    def stamp(self, step: int, iteration: int, time_ns: int) -> None:
        """Set which exchange this message belongs to."""
        self._step[0] = step
        self._iteration[0] = iteration
        self._time_ns[0] = time_ns

    @property
    def at(self) -> tuple[int, int]:
        """Which exchange this message belongs to: index of the communication point, coupling iteration."""
        return self._step.item(), self._iteration.item()

    @property
    def time_ns(self) -> int:
        """Simulation time of the communication point [ns]."""
        return int(self._time_ns.item())


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
        self.accepted = Motion.of(self._layout.views, "accepted")
        self.trial = Motion.of(self._layout.views, "trial")

    @property
    def final(self) -> bool:
        """Whether the run is over: ``accepted`` is the last state, nothing is to be evaluated."""
        return bool(self._layout.views["final"][0])

    @final.setter
    def final(self, value: bool) -> None:
        self._layout.views["final"][0] = int(value)


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
        views = self._layout.views
        coupled = response_size == 36 * n * n
        self.wrench = Wrench(
            views["force"].reshape(n, 3),
            views["torque"].reshape(n, 3),
            views["added_inertia"].reshape(n, 6, 6) if added_inertia else None,
            views["response"].reshape((6 * n, 6 * n) if coupled else (n, 6, 6)) if response_size else None,
            views["diagnostics"] if diagnostics else None,
        )
