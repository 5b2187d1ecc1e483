"""`pec` with wrenches that are means over their step: held, never interpolated.

1. predict: integrate with the mean wrench of the step before;
2. exchange: the providers answer the mean wrench W of this step on that trial state;
3. correct: integrate from the accepted state again with W.

Without a response the correction lags what the provider did by the difference of trial and accepted state:
stable while the added mass that is hidden in W stays below the mass.

With a response G the wrench is W − G (V − V*) for an end twist V other than the trial's V*, and the
correction finds the V that agrees with it. That is linearly implicit, and stable down to massless bodies.
What is left to the prediction is where the bodies are when W is asked for; where the bodies are light, so
that it would run away, the last step's G counts in it too, about the twist that the accelerations of the last
step lead to.
"""

from __future__ import annotations

from collections.abc import Iterator

from linkwind.coupling.answer import Array
from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.history import History
from linkwind.coupling.response import EXPLICIT, correct, predict, stiffness


def run(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
) -> Iterator[CommunicationPoint]:
    """Drive the plant with held mean wrenches. See `linkwind.coupling.base.Scheme`."""
    history = History(len(settings.weight), depth=1)
    newest = history.wrenches[0]
    before = accepted = trial = initial
    for step in range(steps + 1):
        if step > 0:
            trial = _predict(plant, history, before, accepted, settings.weight)
            before = accepted
        history.add(step, exchange(step, 0, accepted, trial))
        held, inertia = newest, history.added_inertia
        if step > 0:
            accepted, newest[...], held, inertia = correct(plant, history, accepted, trial, 1)
        elif history.response is not None:
            inertia = plant.inertia(initial, inertia, history.response)
        yield CommunicationPoint(step, accepted, trial, held.copy(), inertia, 0, (), 1)


def _predict(plant: Plant, history: History, before: State, accepted: State, weight: Array) -> State:
    nodes, wrenches = history.behind[1]
    if stiffness(plant, accepted, history, weight) <= EXPLICIT:
        return plant.advance(accepted, nodes, wrenches, history.added_inertia)
    return predict(plant, history, accepted, 2.0 * plant.twist(accepted) - plant.twist(before))
