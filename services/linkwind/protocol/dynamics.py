"""The dynamics' side of the protocol."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linkwind.errors import ProtocolError, SimulationError
from linkwind.frames import FlowFrame, decode
from linkwind.messages import MotionMessage
from linkwind.protocol.handshake import HandShake
from linkwind.spatial import Array


class DynamicsSession(HandShake):
    """One run: the hand-shake, then lock step. It owns time, everybody else answers.

    Attributes:
        motion: the message to fill before :meth:`post`.
    """

    def __init__(
        self,
        run: str,
        scenario_json: str,
        step_ns: int,
        steps: int,
        bodies: Sequence[str],
        providers: dict[str, Sequence[str]],
    ) -> None:
        """Prepare a run; see :class:`HandShake`."""
        super().__init__(run, scenario_json, step_ns, steps, bodies, providers)
        n = len(bodies)
        self.motion = MotionMessage(run, n)
        self._waiting = 0
        self._numbers = np.zeros(42 * n)
        self._wrench = self._numbers[: 6 * n].reshape(n, 6)
        self._force, self._torque = self._wrench[:, :3], self._wrench[:, 3:]
        self._added = self._numbers[6 * n :].reshape(n, 6, 6)
        first, *others = self.participants.values()
        self._only = None if others or first.bodies != tuple(range(n)) else first

    @property
    def answered(self) -> bool:
        """Whether every provider has answered the last motion."""
        return self._waiting == 0

    @property
    def unanswered(self) -> list[str]:
        """Providers that have not answered the last motion."""
        return [p.name for p in self.participants.values() if not p.answered]

    def where(self) -> str:
        """Return the step and time of the last motion, for an error."""
        return f"step {self.motion.at[0]} (t = {self.motion.time_ns / 1e9:g} s)"

    def post(self, step: int, iteration: int, *, final: bool = False) -> bytes:
        """Stamp the motion message and return it encoded."""
        time_ns = step * self.step_ns
        self.motion.stamp(step, iteration, time_ns)
        if final:
            self.motion.final = True
        for p in self.participants.values():
            p.answered = False
        self._waiting = len(self.participants)
        return self.motion.payload()

    def accept(self, provider: str, payload: bytes) -> bool:
        """Take a wrench message into its arrays; False if it is a repeated or stale one.

        Raises:
            ProtocolError: unknown provider, another run, or a step that was not asked for.
        """
        known = self.participants.get(provider)
        if known is None or known.message is None:
            raise ProtocolError(f'wrench from "{provider}": it does not take part in run {self.run}')
        message = known.message
        message.load(payload, f'wrench from "{provider}"')
        at, asked = message.at, self.motion.at
        if at < asked or (at == asked and known.answered):
            if known.answered:
                message.load(known.payload, "its answer")  # the arrays keep what was accepted
            return False
        if at > asked:
            raise ProtocolError(
                f'wrench from "{provider}": expected step {asked[0]} iteration {asked[1]}; got step {at[0]} '
                f"iteration {at[1]}"
            )
        known.answered = True
        known.payload = payload
        self._waiting -= 1
        return True

    def frame(self, provider: str, payload: bytes) -> FlowFrame:
        """Take a frame.

        Raises:
            ProtocolError: unknown provider, not a frame of this run, or one before it was lost.
        """
        known = self.participants.get(provider)
        if known is None:
            raise ProtocolError(f'frame from "{provider}": it does not take part in run {self.run}')
        number, frame = decode(payload, self.run, provider)
        if number != known.frames + 1:
            raise ProtocolError(
                f'frame from "{provider}": {self.where()}: expected number {known.frames + 1}; got {number}. '
                "A frame was lost."
            )
        known.frames = number
        return frame

    def check_frames(self) -> None:
        """Raise ProtocolError unless all frames are here that the providers say they sent."""
        for p in self.participants.values():
            if p.frames != p.shown:
                raise ProtocolError(
                    f'frames from "{p.name}": expected {p.shown}, as its Bye says; got {p.frames}. '
                    "The last ones were lost."
                )

    def total(self) -> tuple[Array, Array | None]:
        """Add up the answers of all providers, in the scenario's order.

        Returns:
            wrench [N, N·m], shape (n, 6), force first, in W, and added inertia ``A``, shape (n, 6, 6), body
            frame, None if no provider returned one; both are written over by the next call.

        Raises:
            SimulationError: a number is not finite.
        """
        if self._only is not None:  # the usual case, on the path that everybody waits for
            answer = self._only.answer
            np.copyto(self._force, answer.force)
            np.copyto(self._torque, answer.torque)
            has_added = answer.added_inertia is not None
            if answer.added_inertia is not None:
                np.copyto(self._added, answer.added_inertia)
        else:
            has_added = self._add_up()
        self._check_finite()
        return self._wrench, self._added if has_added else None

    def _add_up(self) -> bool:
        """Add up all answers; return whether any of them has an added inertia."""
        self._numbers.fill(0.0)
        has_added = False
        for p in self.participants.values():
            rows, answer = list(p.bodies), p.answer
            self._force[rows] += answer.force
            self._torque[rows] += answer.torque
            if answer.added_inertia is not None:
                self._added[rows] += answer.added_inertia
                has_added = True
        return has_added

    def _check_finite(self) -> None:
        """Raise SimulationError, naming provider, body and step, unless every number is finite."""
        if np.isfinite(self._numbers).all():
            return
        for p in self.participants.values():
            part = p.answer
            arrays = {"force": part.force, "torque": part.torque, "added inertia": part.added_inertia}
            for name, array in arrays.items():
                if array is not None and not np.isfinite(array).all():
                    row = int(np.argwhere(~np.isfinite(array))[0][0])
                    raise SimulationError(
                        f'"{p.name}": {self.where()}: {name} on {self.bodies[p.bodies[row]]}: expected '
                        f"finite numbers; got {array[row].ravel().tolist()}"
                    )
