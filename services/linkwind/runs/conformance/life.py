"""One life of a provider that is tested: its process, and a dynamics that does what the test wants."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import NamedTuple

import numpy as np

from linkwind.bus.base import DynamicsLink
from linkwind.checkpoints import Checkpoint
from linkwind.dynamics.plant import MechanismPlant
from linkwind.dynamics.recovery import Patience, Recovery
from linkwind.errors import LostError
from linkwind.mechanism import Mechanism, build
from linkwind.protocol import Course, DynamicsSession
from linkwind.runs.here import zenoh_link
from linkwind.scenario import Scenario
from linkwind.spatial import Motion

GOODBYE = 5.0  # s that it may take to say Bye; and to be missed when it was killed
LONGEST = 300  # characters of what it has printed, in a result


class Answer(NamedTuple):
    """A wrench message: its bytes, and the numbers in it without the stamp."""

    payload: bytes
    numbers: bytes


@dataclass(frozen=True)
class Provider:
    """What is tested.

    Attributes:
        name: of the provider, as in the scenario.
        command: starts it; ``{endpoint}`` and ``{name}`` in it are replaced.
        scenario: that it is given.
        mechanism: of the scenario.
        motions: of a flight without forces, by step.
        output: what it prints.
        begins: where in that each process begins [bytes].
    """

    name: str
    command: Sequence[str]
    scenario: Scenario
    mechanism: Mechanism
    motions: Sequence[Motion]
    output: Path
    begins: list[int] = field(default_factory=list)

    @classmethod
    def of(cls, scenario: Scenario, name: str, command: Sequence[str], output: Path, steps: int) -> Provider:
        """Prepare for so many steps."""
        mechanism = build(scenario)
        return cls(name, command, scenario, mechanism, _flight(scenario, mechanism, steps), output)

    def start(self, endpoint: str) -> subprocess.Popen[bytes]:
        """Start it."""
        words = [word.replace("{endpoint}", endpoint).replace("{name}", self.name) for word in self.command]
        with self.output.open("ab") as output:
            self.begins.append(output.tell())
            return subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=output, stderr=subprocess.STDOUT)

    def last_words(self) -> str:
        """Return the last line that the last process has printed, to end a sentence; empty for none."""
        printed = self.output.read_bytes()[self.begins[-1] :].decode(errors="replace")
        lines = [line.strip() for line in printed.splitlines() if line.strip()]
        return f"; the last that it printed: {lines[-1][:LONGEST]}" if lines else ""


def _flight(scenario: Scenario, mechanism: Mechanism, steps: int) -> list[Motion]:
    plant = MechanismPlant(mechanism, scenario, lambda: "a flight without forces")
    n, state, motions = plant.multibody.n, plant.initial, []
    for _ in range(steps + 1):
        motions.append(Motion.at_rest(n))
        plant.multibody.motion(state.values, motions[-1])
        state = plant.advance(state, np.zeros(1), np.zeros((1, n, 6)), None)
    return motions


class Life:
    """A run with one provider, step by step.

    Attributes:
        session: the protocol's state.
        link: the dynamics' end of the bus.
        checkpoints: that have come.
        posted: last motion message.
    """

    def __init__(self, provider: Provider, run: str, course: Course, steps: int) -> None:
        """Prepare; nothing is started yet."""
        scenario, bodies = provider.scenario, provider.mechanism.bodies
        on = next(each.bodies for each in scenario.providers if each.name == provider.name)
        self.session = DynamicsSession(
            run, scenario.to_json(), scenario.coupling.step_ns, steps, bodies, {provider.name: on}
        )
        self.session.course = course
        self._provider = provider
        self._start_timeout = scenario.bus.start_timeout
        self.checkpoints: list[Checkpoint] = []
        self.posted = b""

    def __enter__(self) -> Life:
        from linkwind.bus.zenoh import loopback_endpoint

        self._endpoint = loopback_endpoint()
        self.link: DynamicsLink = zenoh_link(self.session, self._provider.scenario, [self._endpoint], [])
        try:
            self._process = self._provider.start(self._endpoint)
        except BaseException:
            self.link.close()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        self.link.close()

    def await_ready(self) -> None:
        """Wait for Ready.

        Raises:
            LostError: it does not come.
        """
        if not self.link.wait(lambda: not self.session.not_ready, self._start_timeout, self._poll):
            words = self._provider.last_words()
            raise LostError(f"no Ready within {self._start_timeout:g} s (bus.start_timeout){words}")

    def _poll(self) -> None:
        status = self._process.poll()
        if status is not None and self.session.not_ready:
            raise LostError(f"its process ended with status {status}{self._provider.last_words()}")

    @property
    def rollback(self) -> bool:
        """Whether it says that it can go back."""
        return self.session.participants[self._provider.name].rollback

    def post(self, step: int, iteration: int = 0, *, off: float = 0.0) -> None:
        """Send the motion of a step, its trial twist off by a part of itself."""
        motion, motions = self.session.motion, self._provider.motions
        for end, source in ((motion.accepted, motions[max(0, step - 1)]), (motion.trial, motions[step])):
            for name in ("position", "orientation", "linear", "angular"):
                np.copyto(getattr(end, name), getattr(source, name))
        motion.trial.linear[:] += off * (1.0 + motion.trial.linear)
        self.posted = self.session.post(step, iteration)
        self.link.post(self.posted)

    def receive(self) -> Answer:
        """Return the next wrench message, whatever it answers, and take it if it is the one that is due."""
        name, payload = self.link.receive()
        self.session.accept(name, payload)
        wrench = self.session.participants[name].answer
        arrays = wrench.force, wrench.torque, wrench.added_inertia, wrench.response
        return Answer(payload, b"".join(array.tobytes() for array in arrays if array is not None))

    def ask(self, step: int, iteration: int = 0, *, off: float = 0.0) -> Answer:
        """Send the motion of a step and return its answer."""
        self.post(step, iteration, off=off)
        answer = self.receive()
        while not self.session.answered:
            answer = self.receive()
        self.session.total()  # refuses what is not finite
        self._take_shown()
        return answer

    def _take_shown(self) -> None:
        for name, sent in self.link.frames():
            self.session.frame(name, sent)
        self.checkpoints += [checkpoint for _, checkpoint in self.session.checkpoints()]

    def goodbye(self, last: int) -> None:
        """Send the last motion, wait for Bye.

        Raises:
            LinkwindError: it does not come, or not all of its frames and checkpoints.
        """
        motion = self.session.motion
        for name in ("position", "orientation", "linear", "angular"):
            for end in (motion.accepted, motion.trial):
                np.copyto(getattr(end, name), getattr(self._provider.motions[last], name))
        self.link.post(self.session.post(last, 0, final=True))
        if not self.link.wait(lambda: not self.session.not_gone, GOODBYE, lambda: None):
            raise LostError(f"no Bye within {GOODBYE:g} s of the final motion")
        self._take_shown()
        self.session.check_frames()

    def kill(self) -> None:
        """Kill the process, start another one, and wait until that has caught up.

        Raises:
            LinkwindError: it does not.
        """
        self._process.kill()
        self._process.wait()
        patience = Patience(self._start_timeout, self._start_timeout)
        recovery = Recovery(self.session, self.link, patience, lambda: None)
        try:
            self.link.wait(lambda: False, GOODBYE, lambda: None)
        except LostError as loss:
            self._process = self._provider.start(self._endpoint)
            recovery.bring_back(loss)
            self.link.repeat(self.posted)
            return
        raise LostError("its liveliness token is still there after its process was killed")
