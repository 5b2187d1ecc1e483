"""Predict, exchange, correct: one exchange a step, up to fourth order.

With the last wrenches W_k, W_{k−1}, … and a degree p, a step is

1. predict: integrate from the accepted state with the polynomial of degree p through W_k … W_{k−p};
2. exchange: the providers answer W_{k+1} on that trial state;
3. correct: integrate from the accepted state again, with the polynomial of degree max(1, p) through
   W_{k+1}, W_k, …

which is an Adams–Bashforth–Moulton pair in PEC mode, except that only the wrench is treated so: the
motion is integrated by whatever the plant uses. On smooth wrenches the order is 2, 2, 3, 4 for p = 0 … 3.

Start-up: with fewer than p+1 wrenches the degree is what they allow, and after each of the first answers
all steps since t_0 are integrated again with the polynomial through *all* wrenches received. No exchange
is added; the first points are final, and yielded, after the last of them. Answer W_j is then off by
O(h^{j+1}) where the wrench depends on the motion, because degree j−1 predicted the trial state; one such
error costs the motion O(h^{j+2}). For p = 3 that is too much of W_1. So there the start-up lasts two
answers longer, and W_1 is replaced by the value that the polynomial through the other five gives it.

Stability with a wrench −c v on a mass m: c·h/m below 1.00, 0.50, 0.28, 0.15 with the degree fixed at 0 … 3,
below 1.00 with an adaptive one (see `degree`).

Mean wrenches (``settings.held``) are held: the last one predicts, the one that belongs to the step corrects.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.degree import DegreeControl
from linkwind.coupling.history import History

START_STEPS = (0, 1, 2, 5)  # by p


def run(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
) -> Iterator[CommunicationPoint]:
    """Drive the plant by prediction and correction. See `linkwind.coupling.base.Scheme`."""
    order = 0 if settings.held else settings.order
    lowest = 0 if settings.held else 1
    start = min(START_STEPS[order], steps)
    history = History(len(settings.weight), depth=max(2, start + 1, order + 1))

    points = _start(plant, exchange, initial, start, order, history)
    yield from points
    accepted = points[-1].state
    degree = DegreeControl(settings.weight, order, adaptive=settings.adaptive)
    for wrench in history.wrenches[: history.count][::-1]:
        degree.add(wrench)

    newest = history.wrenches[0]
    for step in range(start + 1, steps + 1):
        p = degree.next
        nodes, wrenches = history.behind[p + 1]
        trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        degree.add(newest)
        nodes, wrenches = history.through[max(p, lowest) + 1]
        accepted = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        yield CommunicationPoint(
            step, accepted, trial, newest.copy(), history.added_inertia, p, degree.errors.copy(), 1
        )


def _start(
    plant: Plant, exchange: Exchange, initial: State, steps: int, order: int, history: History
) -> list[CommunicationPoint]:
    """Take the first ``steps`` steps, all of them again after each answer."""
    unknown = np.full(order + 1, np.nan)
    points: list[CommunicationPoint] = []
    accepted = trial = initial
    for step in range(steps + 1):
        degree = min(max(step - 1, 0), order)
        if step > 0:
            nodes, wrenches = history.behind[degree + 1]
            trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        points.append(
            CommunicationPoint(
                step, trial, trial, history.wrenches[0], history.added_inertia, degree, unknown, 1
            )
        )
        if step == START_STEPS[3]:
            _mend(history)
        points = _again(plant, points, history)
        accepted = points[-1].state
    return points


def _mend(history: History) -> None:
    """Replace W_1 by the value for which the fifth difference of W_0 … W_5 vanishes."""
    w5, w4, w3, w2, w1, w0 = history.wrenches
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
