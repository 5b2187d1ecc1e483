"""The window of fluid that goes with the mechanism: where it is in the world, its steps, its pictures."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from linkwind.aero.flow.grid import FRINGE, Grid
from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame
from linkwind.native.boundary import Boundary
from linkwind.native.lattice import Lattice, shear_rate
from linkwind.spatial import Array

SLACK = 2.0  # cells by which the mechanism may leave its place before the window follows
PICTURE = 256  # cells of a picture along the longer side, about
_HEAD = struct.Struct("<8sIIqqd")
_MAGIC = b"LWFLOW01"


class Window:
    """A lattice at a place in the world.

    Attributes:
        lattice: the fluid, at rest at first: the stream everywhere.
        offset: cells by which the window has followed, x and y.
    """

    def __init__(self, grid: Grid, size: tuple[int, int], middle: Array, threads: int) -> None:
        """Fill a window of ``size`` columns and rows; ``middle`` of the mechanism [m], shape (2,)."""
        columns, rows = size
        self.lattice = Lattice(
            columns,
            rows,
            shear_rate=shear_rate(grid.lattice_viscosity),
            stream=grid.stream,
            fringe=FRINGE,
            threads=threads,
        )
        self.offset = np.zeros(2, dtype=np.int64)
        self._kept: NDArray[np.float32] | None = None
        self._kept_offset = np.zeros(2, dtype=np.int64)
        self._cell = grid.cell
        self.step = grid.step
        self._stand = np.array([grid.place[0] * columns, grid.place[1] * rows])
        self._corner = middle - self._stand * grid.cell  # centre of cell (0, 0) at the start [m]

    @property
    def step(self) -> float:
        """Time of a lattice step [s]."""
        return self._step

    @step.setter
    def step(self, value: float) -> None:
        self._step = value
        self._units = np.array([1.0 / self.speed, 1.0 / self.speed, value])

    @property
    def speed(self) -> float:
        """A cell a step [m/s]."""
        return self._cell / self.step

    def poses(self, pose: Array) -> Array:
        """Return poses (x, y [m], cos, sin), shape (n, 4), in cells of the window."""
        cell, (left, low), (x0, y0) = self._cell, self._corner.tolist(), self.offset.tolist()
        inside = [((x - left) / cell - x0, (y - low) / cell - y0, c, s) for x, y, c, s in pose.tolist()]
        return np.array(inside)

    def twists(self, twist: Array) -> Array:
        """Return twists (m/s, m/s, rad/s), shape (n, 3), in cells and steps."""
        scaled: Array = twist * self._units
        return scaled

    def place(self, boundary: Boundary, pose: Array) -> tuple[int, int]:
        """Put bodies into the window; return what came of it, and the marker it is about."""
        self._placed = self.poses(pose)
        return boundary.place(self.lattice, self._placed)

    def go(self, boundary: Boundary, twist: Array, *, look: bool) -> float | None:
        """Step the fluid with the bodies that are placed, and follow them; return the leak [m/s] or None."""
        middle = np.add.reduce(self._placed)[:2] / len(self._placed)
        x, y = ((far > SLACK) - (far < -SLACK) for far in (middle - self._stand).tolist())
        leak = boundary.step(self.lattice, self.twists(twist), (x, y), look=look)
        if x or y:
            self.offset += (x, y)
        return None if leak is None else leak * self.speed

    def halve(self, viscosity: float) -> None:
        """Halve the time of a step; ``viscosity`` in m²/s."""
        self.step *= 0.5
        self.lattice.halve_step(shear_rate(viscosity * self.step / self._cell**2))

    def picture(self, density: float, step: int, time_ns: int) -> FlowFrame:
        """Return the fluid in world units; ``density`` in kg/m³."""
        stride = max(1, max(self.lattice.nx, self.lattice.ny) // PICTURE)
        seen = self.lattice.moments(stride)
        speed = np.float32(self.speed)
        first = self._corner + (self.offset + 0.5 * (stride - 1)) * self._cell
        return FlowFrame(
            step,
            time_ns,
            (float(first[0]), float(first[1])),
            stride * self._cell,
            np.ascontiguousarray(np.moveaxis(seen.velocity, 0, 2) * speed),
            seen.density * np.float32(density * self.speed**2 / 3.0),
            seen.vorticity / np.float32(self.step),
        )

    def keep(self) -> None:
        """Remember the fluid, to come ``back`` to it for another coupling iteration."""
        if self._kept is None:
            self._kept = np.empty_like(self.lattice.populations)
        np.copyto(self._kept, self.lattice.populations)
        self._kept_offset[:] = self.offset

    def back(self) -> None:
        """Exchange the fluid for the one that ``keep`` remembered."""
        if self._kept is not None:
            ahead, offset = self.lattice.populations.copy(), self.offset.copy()
            np.copyto(self.lattice.populations, self._kept)
            self.offset[:] = self._kept_offset
            self._kept, self._kept_offset = ahead, offset

    def save(self) -> bytes:
        """Return everything that changes, as an opaque blob."""
        size = self.lattice.nx, self.lattice.ny
        return _HEAD.pack(_MAGIC, *size, *self.offset.tolist(), self.step) + self.lattice.state

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned.

        Raises:
            ProtocolError: the blob is not of such a window.
        """
        head = blob[: _HEAD.size]
        size = self.lattice.nx, self.lattice.ny
        if len(head) < _HEAD.size or _HEAD.unpack(head)[:3] != (_MAGIC, *size):
            raise ProtocolError(f"model flow: expected a checkpoint of {size} cells; got {len(blob)} bytes.")
        *_, x, y, self.step = _HEAD.unpack(head)
        try:
            self.lattice.state = blob[_HEAD.size :]
        except ValueError as error:
            raise ProtocolError(f"model flow: checkpoint: {error}") from error
        self.offset[:] = x, y
