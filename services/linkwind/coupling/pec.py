"""Predict, exchange, correct: one exchange a step, up to fourth order.

With the last wrenches W_k, W_{k−1}, … and the order p, a step is

1. predict: integrate from the accepted state with the polynomial of degree d through W_k … W_{k−d}, where
   d = p, or what `degree` chooses below it;
2. exchange: the providers answer W_{k+1} on that trial state;
3. correct: integrate from the accepted state again, with the polynomial of degree max(1, p) through
   W_{k+1}, W_k, …

which is an Adams–Bashforth–Moulton pair in PEC mode, except that only the wrench is treated so: the
motion is integrated by whatever the plant uses. On smooth wrenches the order is 2, 2, 3, 4 for p = 0 … 3.
The degree of the correction does not adapt: it does not make a step unstable, and where it changes from step
to step, errors no longer cancel over an oscillation (3 to 10 times larger at 4 to 8 steps a period). How the
run gets to have p+1 wrenches: `startup`.

Stability with a wrench −c v on a mass m: c·h/m below 1.00, 0.50, 0.28, 0.15 with the degree fixed at 0 … 3,
below 1.00 with an adaptive one.

Added inertia: the prediction takes that of the last answer, the correction the new one.

Response: where an answer says how the wrench depends on the twist at the end of the step, the correction
finds the wrench that belongs to the twist it leads to, in the same exchange; the stiffer, the lower its
order, and a prediction that would grow is made with the last response instead (`response`).

Mean wrenches (``settings.held``) have a module of their own, `mean`.
"""

from __future__ import annotations

from collections.abc import Iterator

from linkwind.coupling import mean
from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.history import History
from linkwind.coupling.response import EXPLICIT, correct, predict, stiffness, through
from linkwind.coupling.startup import START_STEPS, start


def run(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
) -> Iterator[CommunicationPoint]:
    """Drive the plant by prediction and correction. See `linkwind.coupling.base.Scheme`."""
    if settings.held:
        yield from mean.run(plant, exchange, initial, steps, settings)
        return
    weight, order = settings.weight, settings.order
    history = History(len(weight), depth=max(START_STEPS[order] + 1, max(1, order) + 1))

    points, degree = start(plant, exchange, initial, steps, settings, history)
    yield from points
    accepted, newest = points[-1].state, history.wrenches[0]
    step = len(points)
    while step <= steps:
        if settings.march is not None:
            step, accepted = settings.march(step, accepted, history, degree)
        d = degree.next
        if stiffness(plant, accepted, history, weight) > EXPLICIT:
            d, trial = 0, predict(plant, history, accepted, plant.twist(accepted))
        else:
            nodes, wrenches = history.behind[d + 1]
            trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        count = min(through(order, stiffness(plant, trial, history, weight)), history.count)
        accepted, newest[...], _, _ = correct(plant, history, accepted, trial, count)
        degree.add(newest)
        yield CommunicationPoint(
            step, accepted, trial, newest.copy(), history.added_inertia, d, degree.errors, 1
        )
        step += 1
