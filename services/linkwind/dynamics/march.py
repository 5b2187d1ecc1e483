"""Regular steps of a run that is made again, as far as they are the recorded ones: in one call of the core.

A verification takes most of its steps so. What the core does not find to be the recorded step, to the bit, it
leaves to the coupling scheme, which finds out what it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from linkwind.coupling import DegreeControl, History
from linkwind.dynamics.plant import MechanismPlant, State
from linkwind.dynamics.recorder import Recorder
from linkwind.log.state import step_layout
from linkwind.native.march import Forces, March, Messages, Place, Provider, Recording
from linkwind.protocol import DynamicsSession, ProviderSession

STEPS, SIZE = 256, 2**20  # most steps of a call, and most bytes of what is recorded of them


class Record(Protocol):
    """The messages of the recorded run, in order."""

    def ahead(self, step: int, count: int) -> Recording:
        """Return the messages of at most ``count`` steps from ``step`` on, while there are all of them."""
        ...

    def passed(self, step: int, count: int) -> None:
        """Take it that the run made again has the messages of ``count`` steps from ``step`` on."""
        ...


class RecordedMarch:
    """Takes steps of a run of which there is a record."""

    def __init__(self, record: Record, providers: Sequence[ProviderSession]) -> None:
        """Prepare.

        Args:
            record: of the run.
            providers: the other ends of a bus in this process, in the scenario's order.
        """
        self._record, self._providers = record, providers

    def go(
        self,
        session: DynamicsSession,
        plant: MechanismPlant,
        recorder: Recorder,
        most: int,
        accepted: State,
        history: History,
        degree: DegreeControl,
    ) -> State:
        """Take at most ``most`` steps; return the accepted state after them, and have all else up to date."""
        models = [provider.model for provider in self._providers]
        if not (history.full and degree.settled and all(hasattr(model, "forces") for model in models)):
            return accepted
        march, size = _march(session, plant, recorder, degree, [model.forces for model in models])
        step = accepted.step + 1
        recording = self._record.ahead(step, min(most, STEPS, max(1, SIZE // size)))
        values, errors = accepted.values.copy(), np.array(degree.errors)
        work = accepted.external_work, accepted.dissipated_work
        place = Place(
            step, values, work, history.wrenches, history.added_inertia,
            degree.weight, degree.differences, errors, degree.next, degree.adaptive,
        )  # fmt: skip
        done = march.go(place, recording)
        degree.next, degree.errors = done.degree, tuple(errors.tolist())
        self._record.passed(step, done.steps)
        for provider in self._providers:
            provider.passed(done.steps)
        recorder.joint_gap_max = max(recorder.joint_gap_max, done.joint_gap)
        recorder.force_max = max(recorder.force_max, done.force)
        return State(accepted.step + done.steps, values, *done.work)


def _march(
    session: DynamicsSession,
    plant: MechanismPlant,
    recorder: Recorder,
    degree: DegreeControl,
    forces: Sequence[Forces],
) -> tuple[March, int]:
    """Return what takes steps in the memory of the run's own messages, and the bytes of those of a step."""
    motion, step = session.motion, step_layout(len(degree.errors) - 1)
    messages = Messages(motion.layout, motion.accepted, motion.trial, recorder.state.layout, step)
    providers = []
    for known, model in zip(session.participants.values(), forces, strict=True):
        assert known.message is not None
        bodies = np.array(known.bodies, dtype=np.int32)
        providers.append(Provider(model, bodies, known.message.wrench, known.message.layout))
    layouts = [messages.motion, messages.state, step, *(provider.layout for provider in providers)]
    march = March(plant.multibody, recorder.accepted, providers, messages, session.step_ns)
    return march, sum(layout.size for layout in layouts)
