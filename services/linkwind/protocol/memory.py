"""What a provider remembers: restored where a run goes on, saved on the way, kept through a change."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator
from typing import Any, Protocol

from linkwind.checkpoints import Checkpoint, State
from linkwind.errors import ProtocolError, SimulationError
from linkwind.spatial import Motion, Wrench

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


class Memory:
    """A provider's model and its memory over one run.

    Attributes:
        start: step that was committed when the run was cut; -1 for a run from the beginning.
        model: that counts now.
        saved: checkpoints so far.
    """

    def __init__(
        self, welcome: Any, name: str, build: Callable[[str, str], Model], begin: Checkpoint | None
    ) -> None:
        """Build the model that the message Welcome asks for; it goes on from a checkpoint, if there is one.

        Raises:
            InputError: the scenario does not make a model.
            ProtocolError: the checkpoint is not one of that model.
        """
        self.start = -1 if begin is None else begin.step
        self._name, self._run, self._build = name, welcome.run, build
        self._every = welcome.checkpoint_every
        self._changes = {int(change.step): change.scenario_json for change in welcome.changes}
        before = [step for step in self._changes if step < self.start]
        scenario = self._changes[max(before)] if before else welcome.scenario_json
        self.model = build(scenario, name)
        if begin is not None:
            try:
                self.model.restore(begin.state.whole())
            except BaseException:
                self.close()
                raise
        self._checkpoints: list[Checkpoint] = []
        self._taken = int(welcome.catch_up.checkpoints_taken)
        self.saved = 0 if begin is None else begin.number - 1

    def committed(self, step: int, time_ns: int) -> None:
        """Do what is due after the commit of ``step``: save the memory, then change the scenario."""
        if self._every and step and step % self._every == 0 and self.model.capabilities.rollback:
            self._save(step, time_ns)
        if step in self._changes:
            self._change(step, self._changes[step])

    def _save(self, step: int, time_ns: int) -> None:
        try:
            state = self.model.save()
        except SimulationError as error:
            _log.warning('"%s": no checkpoints: %s', self._name, error)
            self._every = 0
            return
        self.saved += 1
        if self.saved > self._taken:
            self._checkpoints.append(Checkpoint(self.saved, step, time_ns, State.of(state)))

    def _change(self, step: int, scenario_json: str) -> None:
        """Go on with a model of another scenario that has the memory of this one."""
        before = self.model.capabilities
        if not before.rollback:
            raise ProtocolError(
                f'"{self._name}": step {step}: expected a model that can save its memory, to change the '
                "scenario on the way; got one that cannot."
            )
        state = self.model.save()
        changed = self._build(scenario_json, self._name)
        self.close()
        self.model = changed
        if changed.capabilities != before:
            raise ProtocolError(
                f'"{self._name}": step {step}: expected a model with the same kind of answer, {before}; got '
                f"{changed.capabilities}. Run the changed scenario from the beginning."
            )
        changed.restore(state)

    def pieces(self) -> Iterator[bytes]:
        """Take the checkpoints that were saved, piece by piece."""
        while self._checkpoints:
            yield from self._checkpoints.pop(0).pieces(self._run, self._name)

    def close(self) -> None:
        """End what the model holds, such as a process of its own."""
        getattr(self.model, "close", lambda: None)()
