"""A made-up fluid in a box: Hill's spherical vortex, as arrays and as a force model that shows it."""

from __future__ import annotations

import struct

import numpy as np

from linkwind.aero.base import Capabilities
from linkwind.frames import VolumeFrame
from linkwind.spatial import Motion, Wrench

RADIUS, SPEED, DENSITY = 0.3, 2.0, 1.2
AXIS = (0.1, -0.05)  # y and z of the line along which the vortex goes
START = -0.2


def hill(
    t: float, step_ns: int, *, size: tuple[int, int, int] = (18, 20, 24), cell: float = 0.06
) -> VolumeFrame:
    """Return Hill's vortex at time t [s], which goes along x through still fluid.

    Its vorticity is about the line along which it goes, 7.5 SPEED/RADIUS² times the distance from there,
    and ends at its surface.

    Source: M. J. M. Hill, On a spherical vortex, Phil. Trans. R. Soc. A 185, 1894.
    """
    origin = (-0.6, -0.5, -0.55)
    z, y, x = np.meshgrid(*(o + cell * np.arange(n) for o, n in zip(origin[::-1], size, strict=True)),
                          indexing="ij")  # fmt: skip
    x, y, z = x - START - SPEED * t, y - AXIS[0], z - AXIS[1]
    r2 = y * y + z * z
    far, a2 = np.sqrt(x * x + r2), RADIUS**2
    with np.errstate(divide="ignore", invalid="ignore"):
        cube = (RADIUS / far) ** 3
        along = np.where(far < RADIUS, 1.5 * (1.0 - (x * x + 2.0 * r2) / a2),
                         -1.0 + cube * (1.0 - 1.5 * r2 / far**2))  # fmt: skip
        outwards = 1.5 * np.where(far < RADIUS, x / a2, cube * x / far**2)  # over the distance from the line
    velocity = SPEED * np.stack([along + 1.0, outwards * y, outwards * z], axis=-1)
    pressure = -0.5 * DENSITY * (velocity**2).sum(axis=-1)
    step = round(t * 1e9) // step_ns
    return VolumeFrame(step, step * step_ns, origin, cell, velocity.astype("f4"), pressure.astype("f4"))


class VolumeModel:
    """A force model that shows Hill's vortex at every ``every``-th communication point; it can roll back.

    Its force is −velocity.
    """

    def __init__(self, *, step_ns: int = 1_000_000, every: int = 5, **size: object) -> None:
        self.capabilities = Capabilities()
        self._step_ns, self._every, self._size = step_ns, every, size
        self._committed, self._shown = 0, -1

    def commit(self, t: float, motion: Motion) -> None:
        self._committed = round(t * 1e9) // self._step_ns

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        wrench.force[:] = -motion.linear[: len(wrench)]
        wrench.torque[:] = 0.0

    def frame(self) -> VolumeFrame | None:
        if self._committed % self._every or self._committed == self._shown:
            return None
        self._shown = self._committed
        return hill(self._committed * self._step_ns / 1e9, self._step_ns, **self._size)

    def save(self) -> bytes:
        return struct.pack("<qq", self._committed, self._shown)

    def restore(self, blob: bytes) -> None:
        self._committed, self._shown = struct.unpack("<qq", blob)
