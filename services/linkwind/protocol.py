"""The lock-step protocol (v1) as two state machines that know no network.

Each side takes bytes and gives bytes; ``bus/`` moves them. The protocol itself is written down in
``schemas/README.md``, so that a stranger can implement a participant from it.
"""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Protocol

import numpy as np

from linkwind import __version__
from linkwind.errors import (
    FaultError,
    LinkwindError,
    ParticipantError,
    ProtocolError,
    RefusedError,
    SimulationError,
)
from linkwind.messages import KINDS, MotionMessage, WrenchMessage
from linkwind.schema import MESSAGES, SHA256
from linkwind.spatial import Array, Motion, Wrench

Control = MESSAGES["Control"]
_log = logging.getLogger("linkwind")


class Capabilities(Protocol):
    """What a force model can do and returns."""

    @property
    def kind(self) -> str: ...
    @property
    def rollback(self) -> bool: ...
    @property
    def added_inertia(self) -> bool: ...
    @property
    def response_size(self) -> int: ...
    @property
    def own_step_ns(self) -> int: ...
    @property
    def diagnostics(self) -> tuple[str, ...]: ...


class Model(Protocol):
    """A force model as the protocol sees it (``linkwind.aero.base.ForceModel`` is one)."""

    @property
    def capabilities(self) -> Capabilities: ...
    def commit(self, t: float, motion: Motion) -> None: ...
    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None: ...
    def save(self) -> bytes: ...
    def restore(self, blob: bytes) -> None: ...


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


def fault_error(payload: bytes) -> FaultError:
    """Return a received Fault message as an exception."""
    message = _control(payload, "fault")
    f = message.fault
    return FaultError(f'"{f.participant}" stopped at step {f.step}: {f.code}: {f.text}')


def _control(payload: bytes, *expected: str) -> Any:
    """Decode a control message and check that it is one of ``expected``."""
    try:
        message = Control.FromString(payload)
    except Exception as error:
        raise ProtocolError(f"control: expected a Control message; got {len(payload)} other bytes") from error
    got = message.WhichOneof("body")
    if got not in expected:
        raise ProtocolError(f"control: expected one of {', '.join(expected)}; got {got or 'nothing'}")
    return message


class ProviderState(Enum):
    """Where a provider is in its life."""

    NEW = auto()
    WELCOME = auto()
    RUNNING = auto()
    DONE = auto()


class ProviderSession:
    """A provider's side of the protocol: hello → welcome → ready → (motion → wrench)* → bye."""

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
        self._answer = b""

    def hello(self) -> bytes:
        """Return the message that asks to take part."""
        body = {
            "name": self.name,
            "schema_sha256": SHA256,
            "version": __version__,
            "instance": self.instance,
        }
        return bytes(Control(hello=body).SerializeToString())

    def welcome(self, reply: bytes) -> None:
        """Take the answer to hello.

        Raises:
            RefusedError: the dynamics refuses, with its reason.
        """
        message = _control(reply, "welcome", "refuse")
        if message.WhichOneof("body") == "refuse":
            raise RefusedError(f'the dynamics refused "{self.name}": {message.refuse.reason}')
        welcome = message.welcome
        self.run = welcome.run
        self._step_ns = welcome.step_ns
        self._bodies = list(welcome.provider_bodies)
        self._scenario_json = welcome.scenario_json
        self._motion = MotionMessage(self.run, len(welcome.bodies))
        self.state = ProviderState.WELCOME

    def build(self) -> None:
        """Build the force model from the scenario of the welcome.

        Raises:
            InputError: the scenario does not make a model.
        """
        self._model = self._build(self._scenario_json, self.name)
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
        self._checkpoint = self._model.save() if can.rollback else None

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
        }
        return bytes(Control(ready=body).SerializeToString())

    def started(self, reply: bytes) -> None:
        """Take the answer to ready."""
        message = _control(reply, "start", "refuse")
        if message.WhichOneof("body") == "refuse":
            raise RefusedError(f'the dynamics refused "{self.name}": {message.refuse.reason}')
        self.state = ProviderState.RUNNING

    def answer(self, payload: bytes) -> bytes | None:
        """Take a motion message, return the wrench; None when there is nothing (more) to say.

        A repeated (step, iteration) is answered from memory, a stale one dropped.

        Raises:
            ProtocolError: a gap, a message of another run, or an iteration without rollback.
            SimulationError: the model failed.
        """
        motion = self._motion
        motion.load(payload, f'"{self.name}": motion')
        at = motion.at
        if motion.final:
            self._model.commit(motion.time_ns / 1e9, motion.accepted)
            self.state = ProviderState.DONE
            return None
        if at <= self.at:
            if at == self.at:
                return self._answer
            _log.warning(
                '"%s": dropped a stale motion message (step %d after %d)', self.name, at[0], self.at[0]
            )
            return None
        self._advance(*at)
        self._model.evaluate(motion.time_ns / 1e9, motion.trial, self._wrench.wrench)
        self._wrench.stamp(at[0], at[1], motion.time_ns)
        self.at = at
        self._answer = self._wrench.payload()
        return self._answer

    def _advance(self, step: int, iteration: int) -> None:
        """Commit the accepted state when the step is new, go back to it for another iteration."""
        motion = self._motion
        last_step, last_iteration = self.at
        if step == last_step + 1 and iteration == 0:
            if step:
                self._model.commit((motion.time_ns - self._step_ns) / 1e9, motion.accepted)
                if self._checkpoint is not None:
                    self._checkpoint = self._model.save()
        elif step == last_step and iteration == last_iteration + 1:
            if self._checkpoint is None:
                raise ProtocolError(f'"{self.name}": iteration {iteration} asked, but it cannot roll back')
            self._model.restore(self._checkpoint)
        else:
            raise ProtocolError(
                f'"{self.name}": expected step {last_step + 1} iteration 0; got step {step} '
                f"iteration {iteration}. A motion message was lost."
            )

    def bye(self) -> bytes:
        """Return the answer to the final motion."""
        return bytes(Control(bye={"name": self.name}).SerializeToString())

    def fault(self, error: BaseException) -> bytes:
        """Return the message that tells the others that this provider cannot go on."""
        step, iteration = self._motion.at if self.run else (0, 0)
        return fault(self.name, step, iteration, error)


@dataclass
class _Participant:
    """What the dynamics knows of one provider."""

    name: str
    bodies: tuple[int, ...]
    instance: str = ""
    ready: bool = False
    bye: bool = False
    answered: bool = False
    payload: bytes = b""
    message: WrenchMessage | None = None
    diagnostics: tuple[str, ...] = ()
    kind: str = "point"

    @property
    def answer(self) -> Wrench:
        """Its last answer."""
        assert self.message is not None
        return self.message.wrench


class DynamicsSession:
    """The dynamics' side of the protocol: it owns time, everybody else answers.

    Attributes:
        motion: the message to fill before :meth:`post`.
        failure: an error that ends the hand-shake, once there is one.
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
        """Prepare a run.

        Args:
            run: its id, part of every key.
            scenario_json: the resolved scenario.
            step_ns: communication step size [ns].
            steps: number of steps.
            bodies: names, in the order of the messages.
            providers: name of each provider and the bodies that it acts on.
        """
        self.run = run
        self.bodies = tuple(bodies)
        self.step_ns = step_ns
        self.failure: LinkwindError | None = None
        self.motion = MotionMessage(run, len(bodies))
        self._scenario_json = scenario_json
        self._steps = steps
        self._waiting = 0
        n = len(bodies)
        self._numbers = np.zeros(42 * n)
        self._wrench = self._numbers[: 6 * n].reshape(n, 6)
        self._force, self._torque = self._wrench[:, :3], self._wrench[:, 3:]
        self._added = self._numbers[6 * n :].reshape(n, 6, 6)
        self._has_added = False
        self._alone: Wrench | None = None  # the one answer that is the total, where there is only one
        index = {name: i for i, name in enumerate(bodies)}
        self._participants = {
            name: _Participant(name, tuple(index[b] for b in on)) for name, on in providers.items()
        }

    # --- hand-shake -------------------------------------------------------------------------------

    def control(self, request: bytes) -> bytes:
        """Answer a control request of a provider; never raises, a wrong request is refused."""
        try:
            message = _control(request, "hello", "ready", "bye", "fault")
            reply = getattr(self, "_on_" + message.WhichOneof("body"))(message)
        except ParticipantError as error:
            reply = Control(refuse={"reason": str(error)})
        return bytes(reply.SerializeToString())

    def _on_hello(self, message: Any) -> Any:
        hello = message.hello
        known = self._participants.get(hello.name)
        if known is None:
            names = ", ".join(self._participants) or "none"
            raise RefusedError(f'participant "{hello.name}": expected one of {names}')
        if known.instance and known.instance != hello.instance:
            raise RefusedError(f'a participant named "{hello.name}" already takes part in run {self.run}')
        if hello.schema_sha256 != SHA256:
            reason = (
                f'participant "{hello.name}": expected schema {SHA256[:12]} (linkwind {__version__}); got '
                f"{hello.schema_sha256[:12]} (linkwind {hello.version}). Install the same version on both "
                "sides."
            )
            self.failure = RefusedError(reason)
            raise self.failure
        known.instance = hello.instance
        body = {
            "run": self.run,
            "scenario_json": self._scenario_json,
            "step_ns": self.step_ns,
            "steps": self._steps,
            "bodies": self.bodies,
            "provider_bodies": [self.bodies[i] for i in known.bodies],
        }
        return Control(welcome=body)

    def _on_ready(self, message: Any) -> Any:
        ready = message.ready
        known = self._participants.get(ready.name)
        if known is None or not known.instance or known.instance != ready.instance:
            raise RefusedError(f'"{ready.name}": Ready without Hello')
        if ready.response_size:
            self.failure = RefusedError(
                f'"{ready.name}" returns a response matrix G, which no coupling scheme of this version uses'
            )
            raise self.failure
        known.kind = {number: kind for kind, number in KINDS.items()}.get(ready.kind, "point")
        known.diagnostics = tuple(ready.diagnostics)
        known.message = WrenchMessage(
            self.run,
            known.name,
            len(known.bodies),
            kind=known.kind,
            added_inertia=ready.added_inertia,
            diagnostics=known.diagnostics,
        )
        known.ready = True
        self._has_added |= ready.added_inertia
        if len(self._participants) == 1 and known.bodies == tuple(range(len(self.bodies))):
            self._alone = known.answer
        return Control(start={})

    def _on_bye(self, message: Any) -> Any:
        if message.bye.name in self._participants:
            self._participants[message.bye.name].bye = True
            self._participants[message.bye.name].answered = True
        return Control(start={})

    def _on_fault(self, message: Any) -> Any:
        self.failure = fault_error(message.SerializeToString())
        return Control(start={})

    @property
    def providers(self) -> dict[str, list[str]]:
        """Name of each provider and the bodies that it acts on."""
        return {p.name: [self.bodies[i] for i in p.bodies] for p in self._participants.values()}

    @property
    def not_ready(self) -> list[str]:
        """Providers that have not said Ready."""
        return [p.name for p in self._participants.values() if not p.ready]

    @property
    def not_gone(self) -> list[str]:
        """Providers that have not said Bye."""
        return [p.name for p in self._participants.values() if not p.bye]

    @property
    def mean(self) -> bool:
        """Whether some provider answers with the mean over the step, which must not be interpolated."""
        return any(p.kind == "mean" for p in self._participants.values())

    # --- lock step --------------------------------------------------------------------------------

    @property
    def answered(self) -> bool:
        """Whether every provider has answered the last motion."""
        return self._waiting == 0

    @property
    def unanswered(self) -> list[str]:
        """Providers that have not answered the last motion."""
        return [p.name for p in self._participants.values() if not p.answered]

    def where(self) -> str:
        """Return the step and time of the last motion, for an error."""
        return f"step {self.motion.at[0]} (t = {self.motion.time_ns / 1e9:g} s)"

    def post(self, step: int, iteration: int, *, final: bool = False) -> bytes:
        """Stamp the motion message and return it encoded."""
        time_ns = step * self.step_ns
        self.motion.stamp(step, iteration, time_ns)
        if final:
            self.motion.final = True
        for p in self._participants.values():
            p.answered = False
        self._waiting = len(self._participants)
        return self.motion.payload()

    def accept(self, provider: str, payload: bytes) -> bool:
        """Take a wrench message into its arrays; False if it is a repeated or stale one.

        Raises:
            ProtocolError: unknown provider, another run, or a step that was not asked for.
        """
        known = self._participants.get(provider)
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

    def total(self) -> tuple[Array, Array | None]:
        """Add up the answers of all providers, in the scenario's order.

        Returns:
            wrench [N, N·m], shape (n, 6), force first, in W, and added inertia ``A``, shape (n, 6, 6), body
            frame, None if no provider returned one; both are written over by the next call.

        Raises:
            SimulationError: a number is not finite.
        """
        if self._alone is not None:  # the usual case, on the path that everybody waits for
            np.copyto(self._force, self._alone.force)
            np.copyto(self._torque, self._alone.torque)
            if self._alone.added_inertia is not None:
                np.copyto(self._added, self._alone.added_inertia)
        else:
            self._numbers.fill(0.0)
            for p in self._participants.values():
                rows, part = list(p.bodies), p.answer
                self._force[rows] += part.force
                self._torque[rows] += part.torque
                if part.added_inertia is not None:
                    self._added[rows] += part.added_inertia
        self._check_finite()
        return self._wrench, self._added if self._has_added else None

    def _check_finite(self) -> None:
        """Raise SimulationError, naming provider, body and step, unless every number is finite."""
        if np.isfinite(self._numbers).all():
            return
        for p in self._participants.values():
            part = p.answer
            arrays = {"force": part.force, "torque": part.torque, "added inertia": part.added_inertia}
            for name, array in arrays.items():
                if array is not None and not np.isfinite(array).all():
                    row = int(np.argwhere(~np.isfinite(array))[0][0])
                    raise SimulationError(
                        f'"{p.name}": {self.where()}: {name} on {self.bodies[p.bodies[row]]}: expected '
                        f"finite numbers; got {array[row].ravel().tolist()}"
                    )
