"""Does a provider that somebody else has written keep to the protocol (``schemas/README.md``)?

It lives a few short lives, each against a dynamics that does one thing that happens in runs: repeats a
message, iterates, loses one, goes on from a checkpoint, or meets a provider that was killed.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from linkwind.checkpoints import Checkpoint
from linkwind.errors import FaultError, InputError, LinkwindError, LostError, StoppedError
from linkwind.protocol import Course, fault
from linkwind.runs.conformance.life import Answer, Life, Provider
from linkwind.scenario import Scenario

STEPS, EVERY = 10, 3  # of a life; from one checkpoint to the next
PIECES = 3  # or one more, in which it gets its checkpoint back
LEAVES = 5.0  # s for a provider to leave a run that is over

CHECKS = {
    "hand-shake": "says Hello, builds its model from Welcome, says Ready",
    "answers": "answers every motion, with finite numbers of its bodies",
    "repeated motion": "sends the same answer again",
    "older motion": "drops it",
    "empty message": "skips it",
    "iterations": "goes back to the start of the step: the same trial state, the same wrench",
    "checkpoints": f"sends its memory after every {EVERY}rd step",
    "goodbye": "commits the last state, says Bye, with the number of frames and checkpoints",
    "goes on": "from its own checkpoint, in several pieces, to the same wrenches",
    "comes back": "killed and started again, it catches up and answers the same",
    "lost message": "says Fault",
    "end of the run": f"leaves within {LEAVES:g} s of a Fault",
}
Progress = Callable[[str], None]


@dataclass(frozen=True)
class Result:
    """What came of a check.

    Attributes:
        check: one of ``CHECKS``.
        ok: None where it does not apply, or was not reached.
        saw: what was wrong, or why it does not apply.
    """

    check: str
    ok: bool | None
    saw: str = ""


class WrongError(Exception):
    """The provider did something else than the protocol says; its life goes on."""


class OverError(Exception):
    """The life of a provider has ended early."""


@dataclass
class Findings:
    """Results so far, and what later lives are compared with.

    Attributes:
        answers: of the first life, by step.
        checkpoints: of the first life.
        rollback: whether the provider says that it can go back.
    """

    progress: Progress
    results: dict[str, Result] = field(default_factory=dict)
    answers: dict[int, Answer] = field(default_factory=dict)
    checkpoints: list[Checkpoint] = field(default_factory=list)
    rollback: bool = False

    @contextmanager
    def check(self, name: str) -> Iterator[None]:
        """Take the outcome of the block; a block that is right says nothing.

        Raises:
            OverError: the life of the provider cannot go on.
        """
        self.progress(name)
        try:
            yield
        except WrongError as wrong:
            self.results[name] = Result(name, False, str(wrong))
        except LinkwindError as error:
            self.results[name] = Result(name, False, str(error))
            raise OverError from error
        else:
            self.results.setdefault(name, Result(name, True))

    def leave_out(self, name: str, why: str) -> None:
        """Say why a check does not apply."""
        self.results[name] = Result(name, None, why)


def conformance(
    scenario: Scenario,
    name: str,
    command: Sequence[str],
    output: Path,
    progress: Progress = lambda check: None,
) -> list[Result]:
    """Test a provider.

    Args:
        scenario: that it is given; it acts on the bodies of its provider ``name``.
        name: of the provider.
        command: starts its process; ``{endpoint}`` and ``{name}`` in it are replaced.
        output: file for what it prints, new.
        progress: is told which check is on.

    Returns:
        One result for each of ``CHECKS``.

    Raises:
        InputError: there is no such provider, its program cannot be started, or is not told the endpoint.
    """
    names = [provider.name for provider in scenario.providers]
    if name not in names:
        raise InputError(f"{scenario.source}: expected one of its providers, {', '.join(names)}; got {name}")
    if not any("{endpoint}" in word for word in command):
        line = shlex.join(command)
        raise InputError(
            f"the command: expected {{endpoint}} in it, for where the dynamics listens; got: {line}. "
            f"Add it where the program takes it: linkwind conformance SCENARIO -- {line} {{endpoint}}"
        )
    provider, findings = Provider.of(scenario, name, command, output, STEPS), Findings(progress)
    for number, life in enumerate((_whole, _resumed, _killed, _gap, _ended)):
        try:
            life(provider, f"conformance-{number}", findings)
        except OSError as error:
            raise InputError(f"{command[0]}: cannot be started: {error.strerror}. Check it.") from error
        except OverError:
            if number == 0:
                break
    return [findings.results.get(check, Result(check, None, "not reached")) for check in CHECKS]


def _whole(provider: Provider, run: str, findings: Findings) -> None:
    """A run from beginning to end, in which messages are repeated and come late."""
    with Life(provider, run, Course(EVERY), STEPS) as life:
        with findings.check("hand-shake"):
            life.await_ready()
        findings.rollback = life.rollback
        sent: list[bytes] = []
        for step in range(5):
            with findings.check("answers"):
                findings.answers[step] = life.ask(step)
                sent.append(life.posted)
        with findings.check("repeated motion"):
            life.link.post(sent[-1])
            if life.receive().payload != findings.answers[4].payload:
                raise WrongError("expected the bytes of its answer; got others")
        with findings.check("older motion"):
            life.link.post(sent[2])
            life.post(5)
            findings.answers[5] = life.receive()
            if not life.session.answered:
                findings.answers[5] = life.receive()
                raise WrongError("expected no answer; got one")
        with findings.check("empty message"):
            life.link.post(b"")
            findings.answers[6] = life.ask(6)
        findings.answers[7] = life.ask(7)
        _iterate(life, findings)
        with findings.check("answers"):
            findings.answers.update({step: life.ask(step) for step in range(8, STEPS + 1)})
        with findings.check("goodbye"):
            life.goodbye(STEPS)
            findings.checkpoints = life.checkpoints
        _look_at_checkpoints(findings)


def _iterate(life: Life, findings: Findings) -> None:
    if not life.rollback:
        findings.leave_out("iterations", "it says that it cannot go back")
        return
    with findings.check("iterations"):
        life.ask(7, 1, off=0.1)
        if life.ask(7, 2).numbers != findings.answers[7].numbers:
            raise WrongError("expected the wrench of iteration 0, for the same trial state; got another")


def _look_at_checkpoints(findings: Findings) -> None:
    if not findings.rollback:
        findings.leave_out("checkpoints", "it says that it cannot go back")
        return
    with findings.check("checkpoints"):
        due, steps = list(range(EVERY, STEPS, EVERY)), [each.step for each in findings.checkpoints]
        if not steps:
            findings.leave_out("checkpoints", "it sends none, so it cannot go on or come back")
        elif steps != due:
            raise WrongError(f"expected checkpoints of steps {due}; got {steps}")


def _resumed(provider: Provider, run: str, findings: Findings) -> None:
    """A run that goes on from a checkpoint of the first one."""
    if not findings.checkpoints:
        findings.leave_out("goes on", "it has sent no checkpoint")
        return
    checkpoint = findings.checkpoints[-2]
    piece = max(1, checkpoint.state.size // PIECES)
    course = Course(EVERY, checkpoint.step, {provider.name: checkpoint}, piece=piece)
    with findings.check("goes on"), Life(provider, run, course, STEPS) as life:
        life.await_ready()
        _answer_as_before(life, range(checkpoint.step + 1, STEPS + 1), findings)
        life.goodbye(STEPS)


def _answer_as_before(life: Life, steps: range, findings: Findings) -> None:
    for step in steps:
        if life.ask(step).numbers != findings.answers[step].numbers:
            raise WrongError(f"step {step}: expected the wrench of the run from the beginning; got another")


def _killed(provider: Provider, run: str, findings: Findings) -> None:
    """A run in which the provider is killed, once before its first checkpoint and once behind."""
    if not findings.checkpoints:
        findings.leave_out("comes back", "it has sent no checkpoint")
        return
    with findings.check("comes back"), Life(provider, run, Course(EVERY, recovery=True), STEPS) as life:
        life.await_ready()
        for steps in (range(2), range(2, 6), range(6, STEPS + 1)):
            _answer_as_before(life, steps, findings)
            if steps.stop <= STEPS:
                life.kill()
        life.goodbye(STEPS)


def _gap(provider: Provider, run: str, findings: Findings) -> None:
    """A run that loses a motion."""
    with findings.check("lost message"), Life(provider, run, Course(), STEPS) as life:
        life.await_ready()
        life.ask(0)
        life.ask(1)
        life.post(3)
        try:
            life.receive()
        except FaultError:
            return
        raise WrongError("expected Fault, for the motion of step 2 was lost; got an answer to step 3")


def _ended(provider: Provider, run: str, findings: Findings) -> None:
    """A run that the dynamics ends."""
    with findings.check("end of the run"), Life(provider, run, Course(), STEPS) as life:
        life.await_ready()
        life.ask(0)
        life.link.fault(fault("dynamics", 0, 0, StoppedError("stopped by the test")))
        try:
            life.link.wait(lambda: False, LEAVES, lambda: None)
        except LostError:
            return
        raise WrongError(f"expected it to leave within {LEAVES:g} s; got its liveliness token still there")
