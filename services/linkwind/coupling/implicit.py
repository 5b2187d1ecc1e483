"""Implicit coupling: within a step, motion and wrench are iterated until they agree.

The wrench at the end of the step is guessed by extrapolation (degree p, or what `degree` chooses below it);
the bodies move under the polynomial of degree max(1, p) through the guess and the wrenches before; the
providers, set back to the start of the step, answer; the next guess follows by `acceleration`, or, where the
answer has a response, from that. The step is accepted with the guess whose answer differs from it by less
than the tolerance, so that bodies and fluid have seen the same motion. Mean wrenches are held over the step.
Order 2, 2, 3, 3 for p = 0 … 3: the first step has no wrench before it but the initial one.

It costs an exchange for each iteration, two at least, and needs providers that can go back. It is for where
one exchange is not enough: a provider that differences the motion itself and returns no response, bodies
lighter than their fluid.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from linkwind.coupling.acceleration import ACCELERATIONS, Acceleration
from linkwind.coupling.answer import Array
from linkwind.coupling.base import CommunicationPoint, Exchange, Met, Plant, Settings, State
from linkwind.coupling.degree import DegreeControl
from linkwind.coupling.history import History
from linkwind.coupling.response import EXPLICIT, correct, stiffness, through
from linkwind.errors import SimulationError


def run(
    plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
) -> Iterator[CommunicationPoint]:
    """Drive the plant by coupling iterations. See `linkwind.coupling.base.Scheme`.

    Raises:
        SimulationError: a step does not converge.
    """
    order = 0 if settings.held else settings.order
    history = History(len(settings.weight), depth=max(1, order) + 1)
    degree = DegreeControl(settings.weight, order, adaptive=settings.adaptive)
    iterations = Iterations(settings)

    history.add(0, exchange(0, 0, initial, initial))
    degree.add(history.wrenches[0])
    inertia = history.added_inertia
    if history.response is not None:
        inertia = plant.inertia(initial, inertia, history.response)
    wrench = history.wrenches[0].copy()
    yield CommunicationPoint(0, initial, initial, wrench, inertia, 0, degree.errors, 1)
    accepted = initial
    for step in range(1, steps + 1):
        d = min(degree.next, history.count - 1)
        met, count = iterations.step(plant, exchange, history, step, accepted, d)
        accepted = met.state
        degree.add(met.wrench)
        yield CommunicationPoint(
            step, accepted, accepted, met.held.copy(), met.added_inertia, d, degree.errors, count
        )


def extrapolated(history: History, d: int) -> Array:
    """Return the wrench that the polynomial of degree d through the last ones has one step later, (n, 6)."""
    guess: Array = np.zeros_like(history.wrenches[0])
    factor = -1.0
    for j in range(d + 1):
        factor *= -(d + 1 - j) / (j + 1)  # binomial, with the sign that alternates
        guess += factor * history.wrenches[j]
    return guess


class Iterations:
    """The iterations of one step after the other."""

    def __init__(self, settings: Settings) -> None:
        weight = settings.weight
        self._weight = weight
        self._scale = np.where(weight > 0.0, weight, 1.0).ravel()
        self._tolerance, self._most = settings.tolerance, settings.iterations
        self._acceleration: Acceleration = ACCELERATIONS[settings.acceleration]()
        self._through = 1 if settings.held else max(1, settings.order) + 1

    def step(
        self, plant: Plant, exchange: Exchange, history: History, step: int, accepted: State, d: int
    ) -> tuple[Met, int]:
        """Return what the step came to, its wrench the newest, and how many exchanges it took."""
        met = self._guess(plant, history, accepted, d)
        newest, apart = history.wrenches[0], 0.0
        self._acceleration.start()
        for count in range(1, self._most + 1):
            answer = exchange(step, count - 1, accepted, met.state)
            x = met.wrench.ravel() * self._scale
            r = answer.wrench.ravel() * self._scale - x
            apart, size = _norm(r), max(_norm(x), _norm(x + r))
            inertia = history.added_inertia
            history.replace(step, answer)
            if apart <= self._tolerance * size and history.added_inertia is inertia:
                newest[...] = met.wrench
                return met, count
            if history.response is None:
                newest[...] = (self._acceleration.next(x, r) / self._scale).reshape(newest.shape)
            met = self._correct(plant, history, accepted, met.state)
            newest[...] = met.wrench
        raise SimulationError(
            f"step {step}: coupling.iterations: expected motion and wrench to agree to {self._tolerance:g} "
            f"within {self._most} iterations; they are {apart:.3g} m/s² apart. Take a smaller coupling.step, "
            "or raise coupling.iterations."
        )

    def _guess(self, plant: Plant, history: History, accepted: State, d: int) -> Met:
        """Make room for the wrench of the step, and return the motion that its first guess leads to."""
        stiff = stiffness(plant, accepted, history, self._weight)
        if stiff > EXPLICIT:
            nodes, wrenches = history.behind[1]
            added, response = history.added_inertia, history.response
            assert response is not None
            met = plant.meet(accepted, nodes, wrenches, added, response, plant.twist(accepted))
            history.shift()
            history.wrenches[0][...] = met.wrench
            return met
        guess = extrapolated(history, d)
        history.shift()
        newest = history.wrenches[0]
        newest[...] = guess
        nodes, wrenches = history.through[min(self._through, history.count)]
        state = plant.advance(accepted, nodes, wrenches, history.added_inertia)
        return Met(state, guess, guess, history.added_inertia)

    def _correct(self, plant: Plant, history: History, accepted: State, trial: State) -> Met:
        count = self._through
        if count > 1:
            count = min(count, through(count - 1, stiffness(plant, trial, history, self._weight)))
        met = correct(plant, history, accepted, trial, min(count, history.count))
        return met._replace(wrench=met.wrench.copy(), held=met.held.copy())


def _norm(vector: Array) -> float:
    return math.sqrt(np.add.reduce(vector * vector))
