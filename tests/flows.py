"""A made-up flow with frames: vortices that drift with the wind, as a force model and as arrays."""

from __future__ import annotations

import numpy as np

from linkwind.aero.base import Capabilities
from linkwind.frames import FlowFrame
from linkwind.spatial import Motion, Wrench

WIND = np.array([-5.0, 0.0])
DENSITY = 1.2


def vortices(
    t: float, step_ns: int, *, rows: int = 28, columns: int = 32, cell: float = 0.1, origin=(-2.0, -1.4)
) -> FlowFrame:
    """Return Lamb–Oseen vortices of alternating sign at time t [s], which were shed upstream one by one."""
    x = origin[0] + cell * np.arange(columns)
    y = origin[1] + cell * np.arange(rows)[:, None]
    velocity = np.zeros((rows, columns, 2)) + WIND
    vorticity = np.zeros((rows, columns))
    core, circulation = 0.16, 1.4
    for i in range(24):
        age = t - 0.09 * (i - 8)
        if age <= 0.0:
            continue
        sign = -1.0 if i % 2 else 1.0
        dx = x - (0.3 + 0.8 * WIND[0] * age)
        dy = y - sign * (0.22 + 0.05 * np.sin(3.0 * i))
        squared = dx**2 + dy**2
        size = core**2 + 4.0e-3 * age
        vorticity += sign * circulation / (np.pi * size) * np.exp(-squared / size)
        swirl = sign * circulation / (2.0 * np.pi) * -np.expm1(-squared / size) / np.maximum(squared, 1e-9)
        velocity[..., 0] -= swirl * dy
        velocity[..., 1] += swirl * dx
    pressure = 0.5 * DENSITY * (WIND @ WIND - (velocity**2).sum(axis=2))
    step = round(t * 1e9) // step_ns
    arrays = (velocity.astype("f4"), pressure.astype("f4"), vorticity.astype("f4"))
    return FlowFrame(step, step * step_ns, (float(origin[0]), float(origin[1])), cell, *arrays)


class VortexModel:
    """A force model that shows a frame at every ``every``-th communication point, from the start to the end.

    Its force is −velocity, its own numbers are a count and the time.
    """

    def __init__(self, *, step_ns: int = 1_000_000, every: int = 5, **size: int) -> None:
        self.capabilities = Capabilities(rollback=False, diagnostics=("points [1]", "time [s]"))
        self._step_ns, self._every, self._size = step_ns, every, size
        self._committed = 0
        self._shown = -1

    def commit(self, t: float, motion: Motion) -> None:
        self._committed = round(t * 1e9) // self._step_ns

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        wrench.force[:] = -motion.linear[: len(wrench)]
        wrench.torque[:] = 0.0
        if wrench.diagnostics is not None:
            wrench.diagnostics[:] = self._committed, t

    def frame(self) -> FlowFrame | None:
        if self._committed % self._every or self._committed == self._shown:  # t_0 is committed as well
            return None
        self._shown = self._committed
        return vortices(self._committed * self._step_ns / 1e9, self._step_ns, **self._size)

    def save(self) -> bytes:
        return b""

    def restore(self, blob: bytes) -> None:
        raise AssertionError("it cannot roll back")


def equal(one: FlowFrame, other: FlowFrame) -> bool:
    """Tell whether two frames are the same, the arrays to the bit."""
    scalars = all(
        getattr(one, name) == getattr(other, name) for name in ("step", "time_ns", "cell", "shape")
    ) and np.allclose(one.origin, other.origin, rtol=0.0, atol=1e-12)
    arrays = ("velocity", "pressure", "vorticity")
    return scalars and all(getattr(one, n).tobytes() == getattr(other, n).tobytes() for n in arrays)
