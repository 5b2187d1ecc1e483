"""A provider's side of the protocol."""

from __future__ import annotations

import hashlib
import logging
import uuid
from collections.abc import Callable, Iterator
from enum import Enum, auto
from typing import Any

from linkwind.checkpoints import Checkpoint, Joining
from linkwind.errors import ProtocolError, RefusedError
from linkwind.frames import Frame, Sent
from linkwind.messages import KINDS, MotionMessage, WrenchMessage
from linkwind.protocol.control import PROGRAM, Control, fault, parse
from linkwind.protocol.memory import Memory, Model
from linkwind.protocol.past import digest
from linkwind.schema import SHA256

_log = logging.getLogger("linkwind")


class ProviderState(Enum):
    """Where a provider is in its life."""

    NEW = auto()
    WELCOME = auto()
    RUNNING = auto()
    DONE = auto()


class ProviderSession:
    """A provider's side of the protocol: hello → welcome → ready → (motion → wrench)* → bye.

    One that comes back in the middle of a run answers what it has answered already between welcome and ready.
    """

    def __init__(self, name: str, build: Callable[[str, str], Model]) -> None:
        """Prepare to take part.

        Args:
            name: of the provider, as in the scenario.
            build: called with the resolved scenario (JSON) and the name, returns the force model.
        """
        self.name = name
        self.instance = uuid.uuid4().hex
        self.state = ProviderState.NEW
        self.run = ""
        self.at = (-1, 0)
        self._build = build
        self._memory: Memory | None = None
        self._begin: Checkpoint | None = None
        self._frames: list[Sent] = []
        self._shown = 0
        self._taken = 0
        self._answer = b""
        self._answers_sha256 = b""

    def hello(self) -> bytes:
        """Return the message that asks to take part."""
        body = {
            "name": self.name,
            "schema_sha256": SHA256,
            "version": PROGRAM,
            "instance": self.instance,
        }
        return bytes(Control(hello=body).SerializeToString())

    def welcome(self, reply: bytes) -> None:
        """Take the answer to hello.

        Raises:
            RefusedError: the dynamics refuses, with its reason.
        """
        welcome = self._granted(reply, "welcome").welcome
        self.run = welcome.run
        self._step_ns = welcome.step_ns
        self._bodies = list(welcome.provider_bodies)
        self._welcome = welcome
        self._motion = MotionMessage(self.run, len(welcome.bodies))
        self._joining: Joining | None = None
        if welcome.HasField("resume"):
            self._joining = Joining(f'"{self.name}": checkpoint to go on from', in_memory=True)
            self._join(welcome.resume)
            welcome.resume.ClearField("state")
        self.state = ProviderState.WELCOME

    def fetch(self) -> bytes | None:
        """Return the message that asks for the next piece of what to go on from; None if all are here."""
        if self._joining is None:
            return None
        body = {"name": self.name, "instance": self.instance, "offset": self._joining.next}
        return bytes(Control(fetch=body).SerializeToString())

    def fetched(self, reply: bytes) -> None:
        """Take the answer to fetch.

        Raises:
            RefusedError: the dynamics does not have that piece.
            ProtocolError: it is another piece, or the whole is damaged.
        """
        self._join(self._granted(reply, "checkpoint").checkpoint)

    def _join(self, piece: Any) -> None:
        assert self._joining is not None
        self._begin = self._joining.add(piece)
        if self._begin is not None:
            self._joining = None

    def build(self) -> None:
        """Build the force model from the scenario of the welcome, with the memory that comes with it.

        Raises:
            InputError: the scenario does not make a model.
            ProtocolError: the memory is not one of that model.
        """
        self._memory = Memory(self._welcome, self.name, self._build, self._begin)
        self._begin = None
        self._use(self._memory.model)
        self.at = (self._memory.start, 0)
        can = self._model.capabilities
        self._wrench = WrenchMessage(
            self.run,
            self.name,
            len(self._bodies),
            kind=can.kind,
            added_inertia=can.added_inertia,
            response_size=can.response_size,
            diagnostics=can.diagnostics,
        )

    def catch_up(self) -> None:
        """Answer what another process of this provider has answered before it was lost, to have its memory.

        Raises:
            ProtocolError: the motions are not those that follow its checkpoint.
            SimulationError: the model failed.
        """
        if not self._welcome.HasField("catch_up"):
            return
        past = self._welcome.catch_up
        self._shown, self._taken = int(past.frames), int(past.frames_taken)
        answers = (self.answer(motion) or b"" for motion in past.motions)
        self._answers_sha256 = digest(hashlib.sha256(answer).digest() for answer in answers)

    def _use(self, model: Model) -> None:
        self._model = model
        self._frame: Callable[[], Frame | None] = getattr(model, "frame", lambda: None)

    @property
    def model(self) -> Any:
        """The force model that counts now."""
        return self._model

    def passed(self, steps: int) -> None:
        """Take so many steps as committed and answered: somebody else has done that with the model."""
        self.at = (self.at[0] + steps, 0)

    def ready(self) -> bytes:
        """Return the message that says that motion can come."""
        can = self._model.capabilities
        body = {
            "name": self.name,
            "instance": self.instance,
            "kind": KINDS[can.kind],
            "rollback": can.rollback,
            "added_inertia": can.added_inertia,
            "response_size": can.response_size,
            "own_step_ns": can.own_step_ns,
            "diagnostics": can.diagnostics,
            "answers_sha256": self._answers_sha256,
        }
        return bytes(Control(ready=body).SerializeToString())

    def started(self, reply: bytes) -> None:
        """Take the answer to ready."""
        self._granted(reply, "start")
        self.state = ProviderState.RUNNING

    def _granted(self, reply: bytes, what: str) -> Any:
        """Return a control message of the dynamics that is ``what`` was asked for, and no refusal."""
        message = parse(reply, what, "refuse")
        if message.WhichOneof("body") == "refuse":
            raise RefusedError(f'the dynamics refused "{self.name}": {message.refuse.reason}')
        return message

    def answer(self, payload: bytes) -> bytes | None:
        """Take a motion message, return the wrench; None when there is nothing (more) to say.

        A repeated (step, iteration) is answered from memory, a stale one dropped.

        Raises:
            ProtocolError: a gap, a message of another run, or an iteration without rollback.
            SimulationError: the model failed.
        """
        motion = self._motion
        motion.load(payload, f'"{self.name}": motion')
        at, time_ns = motion.at, motion.time_ns
        if motion.final:
            self._commit(at[0], time_ns)
            self._show()
            self.state = ProviderState.DONE
            return None
        if at <= self.at:
            if at == self.at:
                return self._answer
            _log.warning(
                '"%s": dropped a stale motion message (step %d after %d)', self.name, at[0], self.at[0]
            )
            return None
        self._advance(*at, time_ns)
        self._model.evaluate(time_ns / 1e9, motion.trial, self._wrench.wrench)
        self._wrench.stamp(*at, time_ns)
        self.at = at
        self._answer = self._wrench.payload()
        self._show()
        return self._answer

    def _show(self) -> None:
        """Encode the frame that the model has for us now, if it has one."""
        frame = self._frame()
        if frame is None:
            return
        if frame.time_ns != frame.step * self._step_ns:
            raise ProtocolError(
                f'"{self.name}": frame of step {frame.step}: expected time {frame.step * self._step_ns} ns; '
                f"got {frame.time_ns}"
            )
        self._shown += 1
        if self._shown > self._taken:
            self._frames.append(Sent(frame.KIND, frame.encode(self.run, self.name, self._shown)))

    def frames(self) -> list[Sent]:
        """Take what the last :meth:`answer` has to show besides: to be sent before the answer itself."""
        taken, self._frames = self._frames, []
        return taken

    def _advance(self, step: int, iteration: int, time_ns: int) -> None:
        """Commit the accepted state when the step is new; another iteration evaluates from there again."""
        last_step, last_iteration = self.at
        if step == last_step + 1 and iteration == 0:
            if step:
                self._commit(last_step, time_ns - self._step_ns)
        elif step == last_step and iteration == last_iteration + 1:
            if not self._model.capabilities.rollback:
                raise ProtocolError(f'"{self.name}": iteration {iteration} asked, but it cannot roll back')
        else:
            raise ProtocolError(
                f'"{self.name}": expected step {last_step + 1} iteration 0; got step {step} '
                f"iteration {iteration}. A motion message was lost."
            )

    def _commit(self, step: int, time_ns: int) -> None:
        """Take the accepted state, unless it is the one that the memory was saved at."""
        assert self._memory is not None
        if step != self._memory.start:
            self._model.commit(time_ns / 1e9, self._motion.accepted)
        self._memory.committed(step, time_ns)
        if self._memory.model is not self._model:
            self._use(self._memory.model)

    def pieces(self) -> Iterator[bytes]:
        """Take the checkpoints of the last :meth:`answer`, to be sent piece by piece before that itself."""
        return iter(()) if self._memory is None else self._memory.pieces()

    def bye(self) -> bytes:
        """Return the answer to the final motion."""
        saved = 0 if self._memory is None else self._memory.saved
        body = {"name": self.name, "frames": self._shown, "checkpoints": saved}
        return bytes(Control(bye=body).SerializeToString())

    def close(self) -> None:
        """End what the force model holds, such as a process of its own."""
        if self._memory is not None:
            self._memory.close()

    def fault(self, error: BaseException) -> bytes:
        """Return the message that tells the others that this provider cannot go on."""
        step, iteration = self._motion.at if self.run else (0, 0)
        return fault(self.name, step, iteration, error)
