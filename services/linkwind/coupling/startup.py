"""The first steps of `pec`: full order with one exchange a step and nothing asked for twice.

With fewer than p+1 wrenches the degree of the prediction is what they allow, and after each answer all
steps since t_0 are integrated again with the polynomial through *all* wrenches received. The points of the
start-up are final after its last answer.

Answer W_j is off by O(h^{j+1}) where the wrench depends on the motion, because degree j−1 predicted the
state that it was given for; once, that costs the motion O(h^{j+2}). For p = 3 this is too much of W_1. So
there the start-up lasts two answers longer than the p that it takes to have p+1 wrenches, and W_1 is replaced
by what the polynomial through the other five says.

All that needs a wrench that the steps resolve. Where the degree is adaptive, the start-up ends with the
second answer if the first three wrenches alternate, because high degrees would only blow up what is there;
and unless each difference of the first six is at most half the one before, W_1 is kept and the steps are
integrated once more, with polynomials of the degree that `degree` finds.
"""

from __future__ import annotations

from itertools import pairwise
from math import nan

from linkwind.coupling.base import CommunicationPoint, Exchange, Plant, Settings, State
from linkwind.coupling.degree import DegreeControl, alternates
from linkwind.coupling.history import History
from linkwind.coupling.response import EXPLICIT, stiffness

START_STEPS = (0, 1, 2, 5)  # by p


def start(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings, history: History
) -> tuple[list[CommunicationPoint], DegreeControl]:
    """Take the steps of the start-up, at most ``steps``, and fill the history.

    Returns:
        The points from 0 on, all final, and the control of the degree from here on.
    """
    points: list[CommunicationPoint] = []
    accepted = trial = initial
    for step in range(min(START_STEPS[settings.order], steps) + 1):
        p = min(max(step - 1, 0), settings.order)
        if step > 0:
            nodes, wrenches = history.behind[p + 1]
            trial = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        history.add(step, exchange(step, 0, accepted, trial))
        unknown = (nan,) * (settings.order + 1)
        newest = history.wrenches[0]
        points.append(CommunicationPoint(step, trial, trial, newest, history.added_inertia, p, unknown, 1))
        points = _again(plant, points, history, step)
        accepted = points[-1].state
        if stiffness(plant, accepted, history, settings.weight) > EXPLICIT:
            break  # predictions of the start-up would grow; the response has no use for it
        if step == 2 and settings.adaptive and alternates(settings.weight, *history.wrenches[:3]):
            break
    return _settle(plant, points, settings, history)


def _settle(
    plant: Plant, points: list[CommunicationPoint], settings: Settings, history: History
) -> tuple[list[CommunicationPoint], DegreeControl]:
    """Replace W_1 if there is reason to, and integrate with the degree that the wrenches deserve."""
    if len(points) > START_STEPS[3]:
        w5, w4, w3, w2, w1, w0 = history.wrenches[:6]
        answered = w1.copy()
        w1[...] = w4 + 2.0 * (w2 - w3) + (w0 - w5) / 5.0  # then the fifth difference vanishes
        control = _control(settings, history)
        if not settings.adaptive or all(4.0 * b <= a for a, b in pairwise(control.errors)):
            return _again(plant, points, history, START_STEPS[3]), control
        w1[...] = answered
    control = _control(settings, history)
    degree = min(max(control.next, 1), points[-1].step)
    return _again(plant, points, history, degree), control


def _control(settings: Settings, history: History) -> DegreeControl:
    degree = DegreeControl(settings.weight, settings.order, adaptive=settings.adaptive)
    for wrench in history.wrenches[: history.count][::-1]:
        degree.add(wrench)
    return degree


def _again(
    plant: Plant, points: list[CommunicationPoint], history: History, degree: int
) -> list[CommunicationPoint]:
    """Integrate from t_0 to the last point, each step with the polynomial through its last degree+1 wrenches.

    The first steps have the one through W_0 … W_degree.
    """
    last = points[-1].step
    nodes = history.through[degree + 1][0]
    state = points[0].state
    done = []
    for point in points:
        if point.step > 0:
            newest = max(point.step, degree)
            wrenches = history.wrenches[last - newest : last - newest + degree + 1]
            state = plant.advance(state, nodes + (newest - point.step), wrenches, point.added_inertia)
        done.append(point._replace(state=state, wrench=history.wrenches[last - point.step].copy()))
    return done
