"""The dynamics' side of the protocol."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from linkwind import checkpoints, frames
from linkwind.checkpoints import Checkpoint, Joining
from linkwind.errors import ProtocolError, SimulationError
from linkwind.frames import Frame, Sent
from linkwind.messages import MotionMessage
from linkwind.protocol.handshake import HandShake, Participant
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
        self._posted = b""
        self._waiting = 0
        self._checkpoints: list[tuple[str, Checkpoint]] = []
        self._numbers = np.zeros(42 * n)
        self._wrench = self._numbers[: 6 * n].reshape(n, 6)
        self._force, self._torque = self._wrench[:, :3], self._wrench[:, 3:]
        self._added = self._numbers[6 * n :].reshape(n, 6, 6)
        self._response = np.zeros((6 * n, 6 * n))
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
        self._ask()
        self._posted = self.motion.payload()
        return self._posted

    def _ask(self) -> None:
        for p in self.participants.values():
            p.answered = False
        self._waiting = len(self.participants)

    def repeat(self, payload: bytes) -> None:
        """Take a motion message of another time, to be sent again as it is.

        Raises:
            ProtocolError: it is not one of this run.
        """
        self.motion.load(payload, "motion to send again")
        self._ask()
        self._posted = payload

    def end(self) -> bytes:
        """Return the message that ends the run with the accepted state of the last motion."""
        motion = self.motion
        if motion.final:
            return motion.payload()
        for name in ("position", "orientation", "linear", "angular"):
            np.copyto(getattr(motion.trial, name), getattr(motion.accepted, name))
        return self.post(max(0, motion.at[0] - 1), 0, final=True)

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
        reported = known.answer.diagnostics
        if reported is not None:
            np.fmax(known.largest, reported, out=known.largest)
        if known.past is not None:
            known.past.add(at[0], self._posted, payload)
        self._waiting -= 1
        return True

    def frame(self, provider: str, sent: Sent) -> Frame | None:
        """Take a frame; None if a provider that came back has sent it again.

        Raises:
            ProtocolError: unknown provider, not a frame of this run, or one before it was lost.
        """
        known = self._sender(provider, "frame")
        number, frame = frames.decode(sent, self.run, provider)
        if known.losses and number <= known.frames:
            return None
        self._check_number("frame", provider, known.frames + 1, number)
        known.frames = number
        return frame

    def piece(self, provider: str, payload: bytes) -> None:
        """Take a piece of a checkpoint.

        Raises:
            ProtocolError: unknown provider, not the next piece, or a checkpoint was lost before it.
            ParticipantError: there is no room for the checkpoint.
        """
        known = self._sender(provider, "checkpoint")
        if not known.ready:
            return  # the rest of what one sent that is lost
        if known.joining is None:
            known.joining = Joining(checkpoints.named(provider))
        checkpoint = known.joining.add(checkpoints.decode(payload, self.run, provider))
        if checkpoint is None:
            return
        known.joining = None
        if known.losses and checkpoint.number <= known.checkpoints:
            return  # it has come back, and sends it again
        self._check_number("checkpoint", provider, known.checkpoints + 1, checkpoint.number)
        known.checkpoints = checkpoint.number
        if known.past is not None:
            known.past.save(checkpoint, known.frames)
        self._checkpoints.append((provider, checkpoint))

    def checkpoints(self) -> list[tuple[str, Checkpoint]]:
        """Take the checkpoints of which every piece has come, each with its provider."""
        taken, self._checkpoints = self._checkpoints, []
        return taken

    def _sender(self, provider: str, what: str) -> Participant:
        known = self.participants.get(provider)
        if known is None:
            raise ProtocolError(f'{what} from "{provider}": it does not take part in run {self.run}')
        return known

    def _check_number(self, what: str, provider: str, expected: int, got: int) -> None:
        if got != expected:
            raise ProtocolError(
                f'{what} from "{provider}": {self.where()}: expected number {expected}; got {got}. '
                f"A {what} was lost."
            )

    def check_frames(self) -> None:
        """Raise ProtocolError unless all frames and checkpoints are here that the providers say they sent."""
        for p in self.participants.values():
            for what, sent, got in (
                ("frames", p.shown, p.frames),
                ("checkpoints", p.saved, p.checkpoints),
            ):
                if got != sent:
                    raise ProtocolError(
                        f'{what} from "{p.name}": expected {sent}, as its Bye says; got {got}. '
                        "The last ones were lost."
                    )

    def total(self) -> tuple[Array, Array | None, Array | None]:
        """Add up the answers of all providers, in the scenario's order.

        Returns:
            wrench [N, N·m], shape (n, 6), force first, in W; added inertia ``A``, shape (n, 6, 6), body
            frame; response ``G``, shape (6n, 6n), in W. None for A, or G, if no provider returned one; all
            are written over by the next call.

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
        has_response = self._add_up_responses()
        self._check_finite(has_response)
        return self._wrench, self._added if has_added else None, self._response if has_response else None

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

    def _add_up_responses(self) -> bool:
        """Add up all responses, each at the rows and columns of its bodies; return whether there is any."""
        if self._only is not None:
            response = self._only.answer.response
            if response is None:
                return False
            if response.ndim == 2:
                np.copyto(self._response, response)
                return True
        responses = [(p.bodies, p.answer.response) for p in self.participants.values()]
        given = [(bodies, response) for bodies, response in responses if response is not None]
        if given:
            self._response.fill(0.0)
        for bodies, response in given:
            rows = (6 * np.repeat(bodies, 6).reshape(-1, 6) + np.arange(6)).ravel()
            if response.ndim == 2:
                self._response[np.ix_(rows, rows)] += response
            else:
                for body, block in zip(bodies, response, strict=True):
                    self._response[6 * body : 6 * body + 6, 6 * body : 6 * body + 6] += block
        return bool(given)

    def _check_finite(self, has_response: bool) -> None:
        """Raise SimulationError, naming provider, body and step, unless every number is finite."""
        if np.isfinite(self._numbers).all() and (not has_response or np.isfinite(self._response).all()):
            return
        for p in self.participants.values():
            part = p.answer
            arrays = {"force": part.force, "torque": part.torque, "added inertia": part.added_inertia}
            if part.response is not None:
                arrays["response"] = part.response.reshape(len(part), -1)
            for name, array in arrays.items():
                if array is not None and not np.isfinite(array).all():
                    row = int(np.argwhere(~np.isfinite(array))[0][0])
                    raise SimulationError(
                        f'"{p.name}": {self.where()}: {name} on {self.bodies[p.bodies[row]]}: expected '
                        f"finite numbers; got {array[row].ravel().tolist()}"
                    )
