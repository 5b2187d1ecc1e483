"""How the next guess of a coupling iteration follows from the residuals so far.

A guess x leads to an answer x + r; the fixed point has r = 0. Vectors are weighted wrenches, shape (m,). To
add one: a class like these two, one entry in ``ACCELERATIONS``.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from linkwind.coupling.answer import Array

FIRST = 0.5  # relaxation of the very first iteration
KEPT = 5  # steps whose columns IQN-ILS reuses
FILTER = 1e-10  # share of a column that must be new to it


class Acceleration(Protocol):
    """One per run; it may learn from step to step."""

    def start(self) -> None:
        """Begin the iterations of a step."""

    def next(self, guess: Array, residual: Array) -> Array:
        """Return the next guess, after the answer ``guess + residual``."""


class Aitken:
    """Relaxation by one factor, from the last two residuals.

    U. Küttler, W. A. Wall, Comput. Mech. 43, 61 (2008), doi:10.1007/s00466-008-0255-5.
    """

    def __init__(self) -> None:
        self._factor = FIRST
        self._last: Array | None = None

    def start(self) -> None:
        """Begin a step with the last factor of the step before, within (0, 0.5]."""
        self._last = None
        self._factor = min(max(abs(self._factor), 1e-3), FIRST)

    def next(self, guess: Array, residual: Array) -> Array:
        """Return ``guess + factor · residual``."""
        if self._last is not None:
            change = residual - self._last
            size = _dot(change, change)
            if size > 0.0:
                self._factor *= -_dot(self._last, change) / size
        self._last = residual.copy()
        return guess + self._factor * residual


class QuasiNewton:
    """IQN-ILS: the inverse Jacobian from the differences seen so far, by least squares.

    J. Degroote, K.-J. Bathe, J. Vierendeels 2009, doi:10.1016/j.compstruc.2008.11.013; columns of earlier
    steps are reused. The least squares are solved by Gram–Schmidt with plain sums, newest column first.
    """

    def __init__(self) -> None:
        self._steps: list[list[tuple[Array, Array]]] = []  # newest first: changes of residual and answer
        self._last: tuple[Array, Array] | None = None

    def start(self) -> None:
        """Begin a step; its columns come on top of those of the last steps."""
        self._last = None
        self._steps = [[], *(step for step in self._steps if step)][: KEPT + 1]

    def next(self, guess: Array, residual: Array) -> Array:
        """Return the guess at which the known changes make the residual smallest."""
        answer = guess + residual
        if self._last is not None:
            self._steps[0].insert(0, (residual - self._last[0], answer - self._last[1]))
        self._last = residual.copy(), answer.copy()
        columns = [column for step in self._steps for column in step]
        if not columns:
            return guess + FIRST * residual
        found = answer.copy()
        left = residual.copy()
        basis: list[tuple[Array, Array]] = []
        for change, moved in columns[: len(residual)]:
            v, w = change.copy(), moved.copy()
            for q, image in basis:
                share = _dot(q, v)
                v -= share * q
                w -= share * image
            length = np.sqrt(_dot(v, v))
            if not length > FILTER * np.sqrt(_dot(change, change)):
                continue
            q, image = v / length, w / length
            basis.append((q, image))
            share = _dot(q, left)
            left -= share * q
            found -= share * image
        return found


def _dot(a: Array, b: Array) -> float:
    return float(np.add.reduce(a * b))


ACCELERATIONS: dict[str, type[Acceleration]] = {"aitken": Aitken, "iqn_ils": QuasiNewton}
