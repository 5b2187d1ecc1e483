"""The degree of the extrapolation, chosen by what each degree would have missed.

The extrapolation of degree d through the last wrenches misses a new one by its backward difference of
order d+1::

    e_d = ‖ weight · ∇^{d+1} W_{k+1} ‖²          d = 0 … p
    E_d ← β E_d + (1 − β) e_d                     β = 0.5; E_d = e_d at first
    degree of the next prediction = the smallest d with the least E_d

Why this one: on a smooth wrench each difference is smaller than the one before by about h times the rate of
change, so the full degree wins as soon as the step resolves the wrench, and the order of the scheme is
kept. On a step too coarse for the wrench, or where the wrench follows the velocity so strongly that the
scheme of degree p is unstable, the wrench alternates from step to step: each difference is then about twice
the one before, and the degree falls until what grew has decayed. The memory β keeps it down meanwhile; with
less of it the degree flickers on smooth wrenches, with more it is slow to come back after a jump, and for
stability any value from 0 to 0.9 will do. A degree that could not be measured yet is tried once the one
below it is the best.

Measured on m dv/dt = −c v: with the degree fixed at 0 … 3 stable for c·h/m up to 1.00, 0.50, 0.28, 0.15; with
it adaptive up to 1.0 for p = 1, more for p = 2 and 3, and about as accurate there as degree 0.
"""

from __future__ import annotations

from math import isnan, nan

import numpy as np

from linkwind.coupling.answer import Array

MEMORY = 0.5  # β


class DegreeControl:
    """Chooses the degree of the extrapolation.

    Attributes:
        next: degree of the next prediction.
        errors: E_d by degree, p+1 weighted wrenches squared; NaN where not measured yet.
        differences: row j holds the backward difference of order j, by weight, shape (p+2, 6n).
        weight: of the wrenches, shape (n, 6).
        adaptive: whether the degree may be lower than p.
    """

    def __init__(self, weight: Array, order: int, *, adaptive: bool) -> None:
        self.next = 0
        self.errors = (nan,) * (order + 1)
        self.weight = weight
        self.adaptive = adaptive
        self._order = order
        self._answers = 0
        # Differences, and sums from the first number to the last, no matrix product: that differs in the last
        # bit from one processor to another, and here a bit may decide.
        self.differences = np.zeros((order + 2, weight.size))
        self._newest = self.differences[0].reshape(weight.shape)
        self._front, self._back = self.differences[:-1], self.differences[1:]
        self._sums = np.zeros((order + 1, weight.size))

    @property
    def settled(self) -> bool:
        """Whether every degree has been measured often enough for all steps from here on to be alike."""
        return self._answers > self._order + 1

    def add(self, wrench: Array) -> None:
        """Take the new wrench, shape (n, 6), and choose the next degree."""
        self._back[...] = self._front
        np.multiply(wrench, self.weight, self._newest)
        table = self.differences
        np.subtract.accumulate(table, 0, None, table)  # ∇^j new = ∇^{j−1} new − ∇^{j−1} old
        np.square(self._back, self._sums)
        np.add.accumulate(self._sums, 1, None, self._sums)
        missed = self._sums[:, -1].tolist()
        if self.settled:
            self.errors = tuple(
                [MEMORY * old + (1.0 - MEMORY) * e for old, e in zip(self.errors, missed, strict=True)]
            )
            if self.adaptive:
                self.next = self.errors.index(min(self.errors))
        else:
            self._first(missed)
        self._answers += 1

    def _first(self, missed: list[float]) -> None:
        """Take one of the first p+2 wrenches: each measures one degree more, and p is the first guess."""
        measured = min(self._answers, self._order + 1)
        known = [
            e if isnan(old) else MEMORY * old + (1.0 - MEMORY) * e
            for old, e in zip(self.errors[:measured], missed[:measured], strict=True)
        ]
        self.errors = (*known, *self.errors[measured:])
        self.next = min(measured, self._order)
        if self.adaptive and known:
            best = known.index(min(known))
            if best < measured - 1 or measured > self._order:
                self.next = best


def alternates(weight: Array, newest: Array, middle: Array, oldest: Array) -> bool:
    """Tell whether three wrenches in a row, each (n, 6), go up and down: ‖∇²W‖ > 2 ‖∇W‖.

    A sequence that alternates and grows has a ratio of at most 2 later on; one that is about to, whose first
    step was predicted with a held wrench, begins above it.
    """
    change = weight * (newest - middle)
    bend = change - weight * (middle - oldest)
    return bool(np.sum(bend * bend) > 4.0 * np.sum(change * change))
