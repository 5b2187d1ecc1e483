"""A force model whose every call can be seen."""

from __future__ import annotations

import numpy as np

from linkwind.aero.base import Capabilities
from linkwind.spatial import Motion, Wrench


class FakeModel:
    """force = −velocity, torque x = value; remembers its calls."""

    def __init__(
        self,
        *,
        rollback: bool = True,
        added_inertia: bool = False,
        response_size: int = 0,
        value: float = 0.0,
    ) -> None:
        self.capabilities = Capabilities(
            rollback=rollback, added_inertia=added_inertia, response_size=response_size
        )
        self.calls: list[tuple[str, object]] = []
        self.blobs: list[bytes] = []
        self.poison: tuple[str, int, float] | None = None
        self.response: np.ndarray | float = 0.0
        self._value = value

    def commit(self, t: float, motion: Motion) -> None:
        self.calls.append(("commit", t))

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        self.calls.append(("evaluate", t))
        wrench.force[:] = -motion.linear[: len(wrench)]
        wrench.torque[:, 0] = self._value
        if wrench.added_inertia is not None:
            wrench.added_inertia[:, 0, 0] = 1.0
        if wrench.response is not None:
            wrench.response.ravel()[:] = np.ravel(self.response)
        if self.poison is not None:
            name, body, value = self.poison
            getattr(wrench, name)[body].ravel()[0] = value

    def save(self) -> bytes:
        self.blobs.append(str(len(self.blobs)).encode())
        return self.blobs[-1]

    def restore(self, blob: bytes) -> None:
        self.calls.append(("restore", blob))
