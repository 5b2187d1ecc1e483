"""The first steps of `pec`: full order with one exchange a step and nothing asked for twice.

With fewer than p+1 wrenches the degree of the prediction is what they allow, and after each answer all
steps since t_0 are integrated again with the polynomial through *all* wrenches received. The points of the
start-up are final after its last answer.

Answer W_j is off by O(h^{j+1}) where the wrench depends on the motion, because degree j−1 predicted the
state that it was given for; once, that costs the motion O(h^{j+2}). For p = 3 this is too much of W_1. So
there the start-up lasts two answers longer than the p that it takes to have p+1 wrenches, and W_1 is replaced
by what the polynomial through the other five says.

Where the first three wrenches alternate, high degrees would only blow up what is there already: then, if
the degree is adaptive, the start-up ends with the second answer.
"""

from __future__ import annotations

from math import nan

from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.degree import alternates
from linkwind.coupling.history import History

START_STEPS = (0, 1, 2, 5)  # by p


def start(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings, history: History
) -> list[CommunicationPoint]:
    """Take the steps of the start-up, at most ``steps``, and fill the history; return their points."""
    order = settings.order
    unknown = (nan,) * (order + 1)
    points: list[CommunicationPoint] = []
    accepted = trial = initial
    for step in range(min(START_STEPS[order], steps) + 1):
        p = min(max(step - 1, 0), order)
        if step > 0:
            nodes, wrenches = history.behind[p + 1]
            trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        newest = history.wrenches[0]
        points.append(CommunicationPoint(step, trial, trial, newest, history.added_inertia, p, unknown, 1))
        if step == START_STEPS[3]:
            _mend(history)
        points = _again(plant, points, history)
        accepted = points[-1].state
        if step == 2 and settings.adaptive and alternates(settings.weight, *history.wrenches[:3]):
            break
    return points


def _mend(history: History) -> None:
    """Replace W_1 by the value for which the fifth difference of W_0 … W_5 vanishes."""
    w5, w4, w3, w2, w1, w0 = history.wrenches[:6]
    w1[...] = w4 + 2.0 * (w2 - w3) + (w0 - w5) / 5.0


def _again(plant: Plant, points: list[CommunicationPoint], history: History) -> list[CommunicationPoint]:
    """Integrate from t_0 to the last point with the polynomial through all wrenches received."""
    last = points[-1].step
    nodes, wrenches = history.through[last + 1]
    state = points[0].state
    done = []
    for point in points:
        to_end = last - point.step
        if point.step > 0:
            state = plant.advance(state, nodes + to_end, wrenches, point.added_inertia)
        done.append(point._replace(state=state, wrench=wrenches[to_end].copy()))
    return done
