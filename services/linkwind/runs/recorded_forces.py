"""Recorded forces in the place of a force model: what a provider answered in a log, whatever the motion."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

import numpy as np

from linkwind.aero.base import Capabilities
from linkwind.errors import InputError, LogError, SimulationError
from linkwind.log.contents import WRENCH
from linkwind.log.reader import Log
from linkwind.log.scenarios import last_recorded, recorded
from linkwind.messages import KINDS, WrenchMessage
from linkwind.protocol import ProviderSession
from linkwind.scenario import Scenario, from_json
from linkwind.schema import MESSAGES
from linkwind.spatial import Motion, Wrench


class RecordedForces:
    """A force model (:class:`linkwind.aero.base.ForceModel`) that answers as a provider did in a log.

    Each coupling iteration gets the answer that was recorded for it; further ones the last of the step, to
    which the recorded run came.
    """

    def __init__(self, log: Log, name: str) -> None:
        """Take the answers of the provider ``name``.

        Raises:
            LogError: there are none.
        """
        self._log, self._name = log, name
        self._bodies = len(log.provider_bodies[name])
        first = next(log.raw(WRENCH + name), None)
        if first is None:
            raise LogError(
                f"{log.path}: {WRENCH}{name}: expected at least one wrench; got none. The run ended before "
                "its first."
            )
        found = MESSAGES["WrenchStep"].FromString(first.payload)
        numbers = len(found.diagnostics)
        names = log.diagnostics.get(name, ())
        self.capabilities = Capabilities(
            kind="mean" if found.kind == KINDS["mean"] else "point",
            rollback=True,
            added_inertia=len(found.added_inertia) > 0,
            response_size=len(found.response),
            diagnostics=names if len(names) == numbers else tuple(str(i) for i in range(numbers)),
        )
        self._go_to(0)

    def _message(self) -> WrenchMessage:
        can = self.capabilities
        return WrenchMessage(
            self._log.run,
            self._name,
            self._bodies,
            kind=can.kind,
            added_inertia=can.added_inertia,
            response_size=can.response_size,
            diagnostics=can.diagnostics,
        )

    def _answers(self) -> Iterator[WrenchMessage]:
        """Yield what was answered, up to the first answer that the file has lost."""
        what = f"{self._log.path}: {WRENCH}{self._name}"
        for count, (_, number, _, payload) in enumerate(self._log.messages(WRENCH + self._name), 1):
            if number != count:
                return
            message = self._message()
            message.load(payload, what)
            yield message

    def _go_to(self, step: int) -> None:
        """Get ready to answer from ``step`` on."""
        self._steps = groupby(self._answers(), key=lambda message: message.at[0])
        self._step, self._wanted, self._iteration = -1, step, 0
        self._of_step: list[WrenchMessage] = []

    def commit(self, t: float, motion: Motion) -> None:
        """Go on to the next step."""
        self._wanted += 1
        self._iteration = 0

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Fill in what was recorded for this step and iteration.

        Raises:
            SimulationError: the log has no answer for the step.
        """
        while self._step < self._wanted:
            self._step, found = next(self._steps, (self._wanted + 1, iter(())))
            self._of_step = list(found)
        if self._step > self._wanted:
            raise SimulationError(
                f'"{self._name}": step {self._wanted} (t = {t:g} s): expected a recorded answer; got none: '
                f"{self._log.path} ends, or is damaged, there."
            )
        recorded = self._of_step[min(self._iteration, len(self._of_step) - 1)].wrench
        self._iteration += 1
        np.copyto(wrench.force, recorded.force)
        np.copyto(wrench.torque, recorded.torque)
        for target, source in (
            (wrench.added_inertia, recorded.added_inertia),
            (wrench.response, recorded.response),
            (wrench.diagnostics, recorded.diagnostics),
        ):
            if target is not None and source is not None:
                np.copyto(target, source)

    def save(self) -> bytes:
        """Return which step comes next."""
        return str(self._wanted).encode()

    def restore(self, blob: bytes) -> None:
        """Go to the step that was saved."""
        self._go_to(int(blob))


def recorded_session(log: Log, name: str) -> ProviderSession:
    """Return the protocol state of a provider whose answers are those of ``log``.

    The dynamics must have the bodies and the step size of the log, and not go further.
    """

    def build(scenario_json: str, provider: str) -> RecordedForces:
        check_fits(log, from_json(scenario_json))
        return RecordedForces(log, provider)

    return ProviderSession(name, build)


def check_fits(log: Log, scenario: Scenario) -> None:
    """Find out whether what was recorded can stand in for a side of ``scenario``.

    Raises:
        InputError: bodies, providers or step sizes differ, or the record is too short.
    """
    step_ns, steps = recorded(log).coupling.step_ns, last_recorded(log).steps
    bodies = {p.name: tuple(p.bodies) for p in scenario.providers}
    for what, wanted, there in (
        ("bodies", ", ".join(body.name for body in scenario.bodies), ", ".join(log.bodies)),
        ("providers", _listed(bodies), _listed(log.provider_bodies)),
        ("coupling.step", f"{scenario.coupling.step_ns} ns", f"{step_ns} ns"),
    ):
        if wanted != there:
            raise InputError(
                f"{scenario.source}: {what}: expected {there}, as recorded; got {wanted}. Change something "
                "else, or run the scenario anew."
            )
    if scenario.steps > steps:
        raise InputError(
            f"{scenario.source}: time.end: expected an end at step {steps}, where the recorded run ended, or "
            f"before; got step {scenario.steps}."
        )


def _listed(providers: dict[str, tuple[str, ...]]) -> str:
    return "; ".join(f"{name} on {', '.join(bodies)}" for name, bodies in sorted(providers.items()))
