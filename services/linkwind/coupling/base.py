"""What a coupling scheme is given and what it yields.

Steps count from 0 and communication point k lies at t_k = k·h; schemes see no time, only abscissae in units
of the step. Wrenches are (n, 6), force first [N, N·m], in W at the centres of mass. Added inertia
[kg, kg·m, kg·m²] is (n, 6, 6), in the body frames, symmetric positive semi-definite. Twists are (n, 6),
linear first [m/s, rad/s], in W at the centres of mass.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from linkwind.coupling.answer import Answer, Array
from linkwind.coupling.degree import DegreeControl
from linkwind.coupling.history import History

State = Any  # the plant's own; a scheme stores it and hands it back, never looks inside, never changes it


class Met(NamedTuple):
    """A step whose wrench agrees with the twist that it leads to.

    Attributes:
        state: at the end of the step.
        wrench: the newest wrench at the twist of that state, shape (n, 6).
        held: what the step was integrated with at its newest node, shape (n, 6).
        added_inertia: that it was integrated with, shape (n, 6, 6), part of the response
            turned into inertia; None for none.
    """

    state: State
    wrench: Array
    held: Array
    added_inertia: Array | None


class Plant(Protocol):
    """The bodies."""

    def advance(self, state: State, nodes: Array, wrenches: Array, added_inertia: Array | None) -> State:
        """Return the state one step later; pure.

        Args:
            state: at the start of the step.
            nodes: abscissae of the wrenches in steps from the start of this one (1 = its end), shape (m,).
            wrenches: values at the nodes, shape (m, n, 6); the wrench is the polynomial through them.
            added_inertia: held over the step, shape (n, 6, 6); None for none.

        The arrays are C-contiguous, and in the steady state of a run always the same few objects, so that a
        plant may remember their addresses. Their content is valid during the call only.

        Raises:
            SimulationError: numerical trouble; the result of a return is finite.
        """
        ...

    def meet(
        self,
        state: State,
        nodes: Array,
        wrenches: Array,
        added_inertia: Array | None,
        response: Array,
        about: Array,
    ) -> Met:
        """Advance, as ``advance`` does, under a wrench that is affine in the twist at the end of the step.

        ``response`` is ``G``, shape (6n, 6n), and ``about`` the twist that the newest wrench,
        ``wrenches[0]``, is meant for, shape (n, 6).

        Raises:
            SimulationError: numerical trouble, or no such wrench is found.
        """
        ...

    def twist(self, state: State) -> Array:
        """Return the twists of the bodies, shape (n, 6)."""
        ...

    def inertia(self, state: State, added_inertia: Array | None, response: Array) -> Array:
        """Return ``added_inertia`` and what each body's own response amounts to over a step, (n, 6, 6)."""
        ...


class Exchange(Protocol):
    """The fluid."""

    def __call__(self, step: int, iteration: int, accepted: State, trial: State) -> Answer:
        """Ask for the wrench at communication point ``step`` and return the answer.

        Args:
            step: k+1; 0 asks for the wrench on the initial state (both states are that one).
            iteration: counts from 0 within a step; above 0 the provider goes back to t_k and does it again.
            accepted: the state at t_k as known now.
            trial: a prediction of the state at t_{k+1}, on which the wrench is evaluated.
        """
        ...


class CommunicationPoint(NamedTuple):
    """A communication point whose state is final.

    Attributes:
        step: k.
        state: accepted at t_k.
        trial: the state on which the wrench at t_k was evaluated.
        wrench: at t_k, shape (n, 6): the last answer for it, or what `startup` put in its place, or what the
            step to it was integrated with (`Met.held`). A copy.
        added_inertia: that belongs to it, shape (n, 6, 6); None for none.
        order: degree of the extrapolation that led to the trial.
        errors: extrapolation error by degree 0 … p, smoothed (E of `degree`), NaN in the start-up; empty
            for a scheme that does not extrapolate.
        iterations: exchanges made for this point.
    """

    step: int
    state: State
    trial: State
    wrench: Array
    added_inertia: Array | None
    order: int
    errors: tuple[float, ...]
    iterations: int


class March(Protocol):
    """What can take regular steps of `pec` in the place of the scheme, many at once."""

    def __call__(
        self, step: int, accepted: State, history: History, degree: DegreeControl
    ) -> tuple[int, State]:
        """Take no, one or many steps from ``step`` on, but not the last one.

        Args:
            step: the next one.
            accepted: the state before it.
            history: is brought up to date.
            degree: likewise.

        Returns:
            The first step that was not taken, and the accepted state before it.
        """
        ...


@dataclass(frozen=True)
class Settings:
    """Settings of a coupling scheme; each scheme reads its own.

    Attributes:
        weight: 1/mass of the bodies for the three forces and a mean 1/inertia for the three torques, shape
            (n, 6): weighs wrenches so that an error of either kind counts by what it does to the motion.
        order: p, highest degree of extrapolation, 0–3.
        adaptive: let the degree fall below p where the wrench is not smooth (see `degree`).
        held: the wrench is a mean over the step (kind "mean" of any provider), so it has no value at a point
            and must not be interpolated: it is held over the step that it was averaged over.
        acceleration: of the coupling iterations (implicit), a name in `acceleration`.
        tolerance: by which guess and answer may differ, relative, weighted.
        iterations: most exchanges in a step.
        march: takes steps, of which no points are yielded; `pec` only. None for nothing.
    """

    weight: Array
    order: int = 3
    adaptive: bool = True
    held: bool = False
    acceleration: str = "iqn_ils"
    tolerance: float = 1e-8
    iterations: int = 50
    march: March | None = None

    def __post_init__(self) -> None:
        weight = np.array(self.weight, dtype=np.float64)
        if weight.ndim != 2 or weight.shape[1] != 6:
            raise ValueError(f"weight: expected shape (n, 6); got {weight.shape}")
        if not (np.isfinite(weight).all() and (weight >= 0.0).all()):
            raise ValueError("weight: expected finite numbers >= 0")
        if not 0 <= self.order <= 3:
            raise ValueError(f"order: expected 0, 1, 2 or 3; got {self.order}")
        object.__setattr__(self, "weight", weight)


class Scheme(Protocol):
    """A coupling scheme: a generator function."""

    def __call__(
        self, plant: Plant, exchange: Exchange, initial: State, steps: int, settings: Settings
    ) -> Iterator[CommunicationPoint]:
        """Drive ``steps`` steps from ``initial`` and yield the points 0 … steps in order, each when final."""
        ...
