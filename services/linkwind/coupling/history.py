"""The answers received so far, newest first, and the polynomials through them."""

from __future__ import annotations

import numpy as np

from linkwind.coupling.answer import Answer, Array
from linkwind.errors import SimulationError

SYMMETRY = 1e-9  # largest relative asymmetry, and negative eigenvalue, of an added inertia


class History:
    """The last answers of the providers.

    The wrenches are moved down by one when an answer is added: the newest m of them are then always the
    same contiguous block of memory, and the polynomials through them always the same pairs of arrays.

    Attributes:
        wrenches: newest first, shape (depth, n, 6); only the first ``count`` are meaningful.
        count: answers kept.
        added_inertia: of the newest answer, shape (n, 6, 6), a copy; None for none.
        response: of the newest answer, shape (6n, 6n), a copy; None for none.
        behind: by number of wrenches m, nodes (0, −1, …) and wrenches: before the answer for the end of a
            step has come, the polynomial that extrapolates into the step.
        through: by m, nodes (1, 0, …) and wrenches: the polynomial through that answer.
    """

    def __init__(self, bodies: int, depth: int) -> None:
        self.wrenches = np.zeros((depth, bodies, 6))
        self.count = 0
        self.added_inertia: Array | None = None
        self.response: Array | None = None
        self._added_bytes = b""
        self._newest, self._newer, self._older = self.wrenches[0], self.wrenches[:-1], self.wrenches[1:]
        blocks = [(np.arange(m, dtype=np.float64), self.wrenches[:m]) for m in range(depth + 1)]
        self.behind = [(0.0 - count, block) for count, block in blocks]
        self.through = [(1.0 - count, block) for count, block in blocks]

    @property
    def full(self) -> bool:
        """Whether there are as many answers as it keeps."""
        return self.count == len(self.wrenches)

    def add(self, step: int, answer: Answer) -> None:
        """Keep a copy of the answer for communication point ``step``."""
        self.shift()
        self.replace(step, answer)

    def shift(self) -> None:
        """Move all wrenches down by one; the newest keeps its value until it is written."""
        self._older[...] = self._newer
        if not self.full:
            self.count += 1

    def replace(self, step: int, answer: Answer) -> None:
        """Keep a copy of the answer in place of the newest one."""
        self._newest[...] = answer.wrench
        if answer.response is None or self.response is None:
            self.response = None if answer.response is None else answer.response.copy()
        else:
            self.response[...] = answer.response
        if answer.added_inertia is not None:
            content = answer.added_inertia.tobytes()
            if content != self._added_bytes:  # it seldom changes, and to compare is cheaper than to check
                check_added_inertia(step, answer.added_inertia)
                self._added_bytes = content
                self.added_inertia = np.array(answer.added_inertia, dtype=np.float64, order="C")
        elif self.added_inertia is not None:
            self._added_bytes, self.added_inertia = b"", None


def check_added_inertia(step: int, added: Array) -> None:
    """Raise unless every 6×6 block is finite, symmetric and positive semi-definite.

    Raises:
        SimulationError: names the step and the index of the body.
    """
    for body, matrix in enumerate(added):
        size = np.abs(matrix).max()
        if not np.isfinite(size):
            found = "a value that is not finite"
        elif (asymmetry := np.abs(matrix - matrix.T).max()) > SYMMETRY * size:
            found = f"entries that differ from their mirror image by {asymmetry:.3g}"
        elif (lowest := np.linalg.eigvalsh(matrix)[0]) < -SYMMETRY * size:
            found = f"an eigenvalue of {lowest:.3g}"
        else:
            continue
        raise SimulationError(
            f"step {step}: added inertia of body {body}: expected a finite, symmetric, positive "
            f"semi-definite 6×6 matrix; got {found}. The force model that returned it is wrong."
        )
