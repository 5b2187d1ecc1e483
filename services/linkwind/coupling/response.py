"""What a scheme does with the response G of an answer: how stiff it is, and a step that agrees with it."""

from __future__ import annotations

import numpy as np

from linkwind.coupling.answer import Array
from linkwind.coupling.base import Met, Plant, State
from linkwind.coupling.history import History

EXPLICIT = 0.25  # stiffness up to which a prediction needs no response
# Wrenches that the correction goes through, and the stiffness up to which it may. With the response in it,
# it is an implicit Adams method, stable on the real axis up to 3 (four wrenches), up to 6 (three) and without
# bound (E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, V.1); half of that leaves room for
# joints, which make bodies lighter. Through two it is the trapezoidal rule, which rings where it is very
# stiff; through one the implicit Euler method, which does not.
THROUGH = ((4, 1.5), (3, 3.0), (2, 10.0), (1, np.inf))


def stiffness(plant: Plant, state: State, history: History, weight: Array) -> float:
    """Return step × G / mass, the largest of a body's own three directions and turns; 0 without response."""
    if history.response is None:
        return 0.0
    inertia = plant.inertia(state, None, history.response)
    return float((np.abs(inertia.diagonal(axis1=1, axis2=2)) * weight).max())


def through(order: int, stiff: float) -> int:
    """Return the number of wrenches that the correction of a scheme of this order goes through."""
    return min(max(1, order) + 1, next(count for count, bound in THROUGH if stiff <= bound))


def correct(plant: Plant, history: History, accepted: State, trial: State, wrenches: int) -> Met:
    """Integrate from the accepted state through the newest answer and ``wrenches`` − 1 before it."""
    nodes, values = history.through[wrenches]
    if history.response is not None:
        return plant.meet(
            accepted, nodes, values, history.added_inertia, history.response, plant.twist(trial)
        )
    state = plant.advance(accepted, nodes, values, history.added_inertia)
    return Met(state, values[0], values[0], history.added_inertia)


def predict(plant: Plant, history: History, accepted: State, about: Array) -> State:
    """Integrate with the last wrench, which is meant for the twists ``about``, and its response."""
    assert history.response is not None
    nodes, values = history.behind[1]
    return plant.meet(accepted, nodes, values, history.added_inertia, history.response, about).state
