"""The degree of the extrapolation, chosen by what each degree would have missed.

The extrapolation of degree d through the last wrenches misses a new one by its backward difference of
order d+1::

    e_d = ‖ weight · ∇^{d+1} W_{k+1} ‖²          d = 0 … p
    E_d ← β E_d + (1 − β) e_d                     β = 0.8; E_d = e_d at first
    degree of the next prediction = the smallest d with the least E_d

Why this one: on a smooth wrench each difference is smaller than the one before by about h times the rate of
change, so the full degree wins as soon as the step resolves the wrench, and the order of the scheme is
kept. On a step too coarse for the wrench, or where the wrench follows the velocity so strongly that the
scheme of degree p is unstable, the wrench alternates from step to step: each difference is then about twice
the one before, and the degree falls until what grew has decayed. The memory β keeps it down meanwhile; its
value matters little. The start-up is of full degree, and no degree is judged before it could be measured.

Measured on m dv/dt = −c v: with the degree fixed at 0 … 3 stable for c·h/m up to 1.00, 0.50, 0.28, 0.15; with
it adaptive up to 1.00 for every p.
"""

from __future__ import annotations

import numpy as np

from linkwind.coupling.base import Array

MEMORY = 0.8  # β


class DegreeControl:
    """Chooses the degree of the extrapolation.

    Attributes:
        next: degree of the next prediction.
        errors: E_d, shape (p+1,), weighted wrench squared; NaN where not measured yet.
    """

    def __init__(self, weight: Array, order: int, *, adaptive: bool) -> None:
        self.next = 0
        self.errors = np.full(order + 1, np.nan)
        self._weight = weight
        self._order = order
        self._adaptive = adaptive
        self._answers = 0
        # Row j holds the backward difference of order j, by weight. Plain differences and sums, no matrix
        # product: those differ in the last bit from one processor to another, and here a bit may decide.
        self._table = np.zeros((order + 2, weight.size))
        self._newest = self._table[0].reshape(weight.shape)
        self._front, self._back = self._table[:-1], self._table[1:]
        self._squares = np.zeros((order + 1, weight.size))
        self._missed = np.zeros(order + 1)

    def add(self, wrench: Array) -> None:
        """Take the new wrench, shape (n, 6), and choose the next degree."""
        self._back[...] = self._front
        np.multiply(wrench, self._weight, self._newest)
        np.subtract.accumulate(self._table, 0, None, self._table)  # ∇^j new = ∇^{j−1} new − ∇^{j−1} old
        np.multiply(self._back, self._back, self._squares)
        np.add.reduce(self._squares, 1, out=self._missed)
        if self._answers > self._order + 1:
            self._missed *= 1.0 - MEMORY
            self.errors *= MEMORY
            self.errors += self._missed
        else:
            self._first()
        if self._adaptive and self._answers > self._order:
            self.next = int(self.errors.argmin())
        else:
            self.next = min(self._answers, self._order)
        self._answers += 1

    def _first(self) -> None:
        """Smooth the errors while each of the first p+2 wrenches measures one degree more."""
        known, missed = self.errors[: self._answers], self._missed[: self._answers]
        known[...] = np.where(np.isnan(known), missed, MEMORY * known + (1.0 - MEMORY) * missed)
