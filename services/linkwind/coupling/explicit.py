"""Explicit coupling: the wrench received at the start of a step is held over the step.

The scheme of Rahmati & Karimi 2021 (doi:10.3390/app11031136): with forward Euler, or semi-implicit Euler,
inside the plant it *is* theirs. First order whatever the integrator, and the wrench lags by a step, which
feeds energy into whatever the wrench acts on like a spring. The baseline.
"""

from __future__ import annotations

from collections.abc import Iterator

from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.history import History


def run(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
) -> Iterator[CommunicationPoint]:
    """Drive the plant with held wrenches, one exchange a step. See `linkwind.coupling.base.Scheme`."""
    history = History(len(settings.weight), depth=1)
    nodes, wrenches = history.behind[1]
    accepted = trial = initial
    for step in range(steps + 1):
        if step > 0:
            trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        accepted = trial
        yield CommunicationPoint(step, accepted, trial, wrenches[0].copy(), history.added_inertia, 0, (), 1)
