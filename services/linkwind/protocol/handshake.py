"""Who takes part in a run: the dynamics' answers to control requests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from linkwind.checkpoints import PIECE, Checkpoint, Joining
from linkwind.errors import LinkwindError, LostError, MismatchError, RefusedError
from linkwind.messages import KINDS, WrenchMessage
from linkwind.protocol.control import PROGRAM, Control, fault_error, parse, refuse
from linkwind.protocol.past import Past
from linkwind.schema import SHA256
from linkwind.spatial import Array, Wrench


@dataclass
class Participant:
    """What the dynamics knows of one provider."""

    name: str
    bodies: tuple[int, ...]
    instance: str = ""
    program: str = ""  # and its version, as it says
    ready: bool = False
    bye: bool = False
    answered: bool = False
    payload: bytes = b""
    message: WrenchMessage | None = None
    diagnostics: tuple[str, ...] = ()
    largest: Array = field(default_factory=lambda: np.empty(0))  # of these numbers so far, NaN for none
    kind: str = "point"
    rollback: bool = False
    frames: int = 0  # taken so far
    shown: int = 0  # sent, as Bye says
    checkpoints: int = 0  # taken so far
    joining: Joining | None = None  # the next one, while its pieces come
    saved: int = 0  # sent, as Bye says
    losses: int = 0
    replaceable: bool = False  # whether who has started it ends it when it counts as lost, and starts another
    here: bool = False  # whether a process of it came on the bus, and its loss has not been told
    past: Past | None = None  # what it needs to come back; None if it never can

    @property
    def answer(self) -> Wrench:
        """Its last answer."""
        assert self.message is not None
        return self.message.wrench


@dataclass(frozen=True)
class Course:
    """What providers are told of a run besides its scenario.

    Attributes:
        checkpoint_every: steps from one checkpoint to the next; 0 for none.
        start: the step that the providers begin after, with ``states``; -1 for the beginning.
        states: the checkpoint of that step of each provider.
        changes: scenarios (JSON) that count from the motion of step + 1 on, by step.
        recovery: whether a provider that was lost may come back; then there have to be checkpoints.
        piece: of a checkpoint in one message to a provider, at most [bytes].
    """

    checkpoint_every: int = 0
    start: int = -1
    states: Mapping[str, Checkpoint] = field(default_factory=dict)
    changes: Mapping[int, str] = field(default_factory=dict)
    recovery: bool = False
    piece: int = PIECE


class HandShake:
    """Welcomes and refuses providers, until each is ready; hears their faults and goodbyes.

    Attributes:
        run: id of the run.
        bodies: names, in the order of the messages.
        step_ns: communication step size [ns].
        participants: the providers of the scenario, by name, in its order.
        course: what providers are told besides the scenario; set before anybody asks.
        failure: an error that ends the run, once there is one.
        commands: events that wait for a command; set before anybody asks.
        ordered: those that were commanded, until somebody takes them.
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
        self.course = Course()
        self.failure: LinkwindError | None = None
        self.commands: tuple[str, ...] = ()
        self.ordered: list[str] = []
        self._scenario_json = scenario_json
        self._steps = steps
        index = {name: i for i, name in enumerate(bodies)}
        self.participants = {
            name: Participant(name, tuple(index[b] for b in on)) for name, on in providers.items()
        }

    def control(self, request: bytes, asker: str | None = None) -> bytes:
        """Answer a control request of a provider; never raises, a wrong request is refused.

        Args:
            request: the message.
            asker: the provider whose key it came by, which nobody else may use on a secure bus; None where
                the transport knows who asks.
        """
        try:
            message = parse(request, "hello", "fetch", "ready", "bye", "fault", "order")
            self._check_asker(message, asker)
            reply = getattr(self, "_on_" + message.WhichOneof("body"))(message)
        except LinkwindError as error:
            reply = Control(refuse={"reason": str(error)})
        return bytes(reply.SerializeToString())

    def refusal(self) -> bytes:
        """Return the answer to somebody whose certificate gives no right to ask."""
        names = ", ".join(self.participants) or "nobody"
        return refuse(f"run {self.run}: expected the certificate of {names}; got another's")

    @staticmethod
    def _check_asker(message: Any, asker: str | None) -> None:
        body = getattr(message, message.WhichOneof("body"))
        if message.HasField("order"):
            return  # whoever may use that key
        name = body.participant if message.WhichOneof("body") == "fault" else body.name
        if asker not in (None, name):
            raise RefusedError(f'control: expected a message of "{asker}", by its key; got one of "{name}"')

    def _on_hello(self, message: Any) -> Any:
        hello = message.hello
        known = self.participants.get(hello.name)
        if known is None:
            names = ", ".join(self.participants) or "none"
            raise RefusedError(f'participant "{hello.name}": expected one of {names}')
        if known.ready and known.instance != hello.instance:
            raise RefusedError(f'a participant named "{hello.name}" already takes part in run {self.run}')
        if hello.schema_sha256 != SHA256:
            reason = (
                f'participant "{hello.name}": expected schema {SHA256[:12]} ({PROGRAM}); got '
                f"{hello.schema_sha256[:12]} ({hello.version or 'no program named'}). Install the same "
                "version on both sides."
            )
            self.failure = RefusedError(reason)
            raise self.failure
        if known.message is None:
            self._begin(known)
        known.instance, known.program = hello.instance, hello.version
        body = {
            "run": self.run,
            "scenario_json": self._scenario_json,
            "step_ns": self.step_ns,
            "steps": self._steps,
            "bodies": self.bodies,
            "provider_bodies": [self.bodies[i] for i in known.bodies],
        }
        return Control(welcome=body | self._course(known))

    def _begin(self, known: Participant) -> None:
        """Let a provider begin where the run does."""
        course = self.course
        begin = course.states[known.name] if course.start >= 0 else None
        known.checkpoints = 0 if begin is None else begin.number - 1
        if course.recovery:
            known.past = Past(course.checkpoint_every, begin)

    def _course(self, known: Participant) -> dict[str, Any]:
        course, past = self.course, known.past
        changes = [{"step": step, "scenario_json": text} for step, text in sorted(course.changes.items())]
        body: dict[str, Any] = {"checkpoint_every": course.checkpoint_every, "changes": changes}
        begin = self._begins_from(known)
        if begin is not None:
            body["resume"] = begin.piece(self.run, known.name, 0, course.piece)
        if known.losses and past is not None:
            body["catch_up"] = {
                "motions": [answered.motion for answered in past.answers],
                "frames": past.frames,
                "frames_taken": known.frames,
                "checkpoints_taken": known.checkpoints,
            }
        return body

    def _begins_from(self, known: Participant) -> Checkpoint | None:
        if known.past is not None:
            return known.past.checkpoint
        return self.course.states[known.name] if self.course.start >= 0 else None

    def _on_fetch(self, message: Any) -> Any:
        fetch = message.fetch
        known = self._after_hello("Fetch", fetch)
        begin = self._begins_from(known)
        if begin is None or fetch.offset >= begin.state.size:
            size = 0 if begin is None else begin.state.size
            raise RefusedError(f'"{fetch.name}": Fetch: expected an offset below {size}; got {fetch.offset}')
        return Control(checkpoint=begin.piece(self.run, known.name, fetch.offset, self.course.piece))

    def _after_hello(self, what: str, body: Any) -> Participant:
        known = self.participants.get(body.name)
        if known is None or not known.instance or known.instance != body.instance:
            raise RefusedError(f'"{body.name}": {what} without Hello')
        return known

    def seen(self, name: str, present: bool) -> None:
        """Take note that a process of a provider is on the bus, or is gone without having taken part."""
        if name in self.participants:
            self.participants[name].here = present

    def lose(self, name: str) -> None:
        """Let another process take the place of a provider that is gone.

        Nothing of it is accepted before that has said Ready; see also :attr:`Course.recovery`.

        Raises:
            LostError: none can.
        """
        known = self.participants[name]
        if known.payload and (known.past is None or known.past.torn):
            why = "sent no checkpoint when one was due" if known.rollback else "cannot save its memory"
            raise LostError(f'"{name}" cannot come back (bus.recovery): it {why}')
        known.ready, known.here, known.instance, known.joining = False, False, "", None
        known.losses += 1

    def _on_ready(self, message: Any) -> Any:
        ready = message.ready
        known = self._after_hello("Ready", ready)
        n = len(known.bodies)
        if ready.response_size not in (0, 36 * n, 36 * n * n):
            self.failure = RefusedError(
                f'"{ready.name}": response_size: expected 0, {36 * n} or {36 * n * n} numbers for {n} '
                f"bodies; got {ready.response_size}"
            )
            raise self.failure
        kind = {number: kind for kind, number in KINDS.items()}.get(ready.kind, "point")
        message = WrenchMessage(
            self.run,
            known.name,
            n,
            kind=kind,
            added_inertia=ready.added_inertia,
            response_size=ready.response_size,
            diagnostics=tuple(ready.diagnostics),
        )
        if known.payload:
            self._check_again(known, ready, message)
        else:
            known.kind, known.rollback, known.message = kind, ready.rollback, message
            known.diagnostics = tuple(ready.diagnostics)
            known.largest = np.full(len(known.diagnostics), np.nan)
        if not known.rollback:
            known.past = None
        known.ready = True
        return Control(start={})

    def _check_again(self, known: Participant, ready: Any, message: WrenchMessage) -> None:
        """Hold a provider that came back against the one that was lost.

        Raises:
            MismatchError: it is another one.
        """
        past, trouble = known.past, ""
        assert past is not None
        assert known.message is not None
        if not known.message.fits(message) or known.diagnostics != tuple(ready.diagnostics):
            trouble = "answers of the same form as before; got others"
        elif ready.answers_sha256 != past.sha256:
            steps = f"steps {past.answers[0].step} to {past.answers[-1].step}" if past.answers else "no step"
            trouble = f"the answers to {steps} that it gave before it was lost; got others"
        if trouble:
            self.failure = MismatchError(
                f'"{known.name}" came back, but is not what was lost: expected {trouble}. Is it the same '
                "program, with the same files, on the same kind of machine?"
            )
            raise self.failure

    def _on_bye(self, message: Any) -> Any:
        if message.bye.name in self.participants:
            self.participants[message.bye.name].bye = True
            self.participants[message.bye.name].shown = message.bye.frames
            self.participants[message.bye.name].saved = message.bye.checkpoints
            self.participants[message.bye.name].answered = True
        return Control(start={})

    def _on_order(self, message: Any) -> Any:
        event = message.order.event
        if event not in self.commands:
            names = ", ".join(self.commands) or "none"
            raise RefusedError(f'event "{event}": expected one that waits for a command: {names}')
        self.ordered.append(event)
        return Control(start={})

    def _on_fault(self, message: Any) -> Any:
        self.failure = fault_error(message.SerializeToString())
        return Control(start={})

    @property
    def providers(self) -> dict[str, list[str]]:
        """Name of each provider and the bodies that it acts on."""
        return {p.name: [self.bodies[i] for i in p.bodies] for p in self.participants.values()}

    @property
    def not_ready(self) -> list[str]:
        """Providers that have not said Ready."""
        return [p.name for p in self.participants.values() if not p.ready]

    @property
    def cannot_go_back(self) -> list[str]:
        """Providers that cannot evaluate a step again."""
        return [p.name for p in self.participants.values() if not p.rollback]

    @property
    def taking_part(self) -> list[str]:
        """Providers that have said Hello to this dynamics, and not Bye; not those of one that is dead."""
        return [p.name for p in self.participants.values() if p.instance and not p.bye]

    @property
    def not_gone(self) -> list[str]:
        """Providers that have not said Bye."""
        return [p.name for p in self.participants.values() if not p.bye]

    @property
    def mean(self) -> bool:
        """Whether some provider answers with the mean over the step, which must not be interpolated."""
        return any(p.kind == "mean" for p in self.participants.values())
