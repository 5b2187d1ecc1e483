"""Predict, exchange, correct: one exchange a step, up to fourth order.

With the last wrenches W_k, W_{k−1}, … and a degree p, a step is

1. predict: integrate from the accepted state with the polynomial of degree p through W_k … W_{k−p};
2. exchange: the providers answer W_{k+1} on that trial state;
3. correct: integrate from the accepted state again, with the polynomial of degree max(1, p) through
   W_{k+1}, W_k, …

which is an Adams–Bashforth–Moulton pair in PEC mode, except that only the wrench is treated so: the
motion is integrated by whatever the plant uses. On smooth wrenches the order is 2, 2, 3, 4 for p = 0 … 3.
How the run gets to have p+1 wrenches: `startup`. How p adapts: `degree`.

Stability with a wrench −c v on a mass m: c·h/m below 1.00, 0.50, 0.28, 0.15 with the degree fixed at 0 … 3,
below 1.00 with an adaptive one.

Added inertia: the prediction takes that of the last answer, the correction the new one.

Mean wrenches (``settings.held``) are held: the last one predicts, the one that belongs to the step corrects.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.degree import DegreeControl
from linkwind.coupling.history import History
from linkwind.coupling.startup import START_STEPS, start


def run(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
) -> Iterator[CommunicationPoint]:
    """Drive the plant by prediction and correction. See `linkwind.coupling.base.Scheme`."""
    lowest = 1
    if settings.held:
        settings, lowest = replace(settings, order=0), 0
    history = History(len(settings.weight), depth=START_STEPS[settings.order] + 1 + lowest)

    points = start(plant, exchange, initial, steps, settings, history)
    yield from points
    accepted = points[-1].state
    degree = DegreeControl(settings.weight, settings.order, adaptive=settings.adaptive)
    for wrench in history.wrenches[: history.count][::-1]:
        degree.add(wrench)

    newest = history.wrenches[0]
    for step in range(len(points), steps + 1):
        p = degree.next
        nodes, wrenches = history.behind[p + 1]
        trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        degree.add(newest)
        nodes, wrenches = history.through[max(p, lowest) + 1]
        accepted = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        yield CommunicationPoint(
            step, accepted, trial, newest.copy(), history.added_inertia, p, degree.errors, 1
        )
