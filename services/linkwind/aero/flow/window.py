"""The window of fluid that goes with the mechanism: where it is in the world, its steps, its pictures."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from linkwind.aero.flow.drift import Frame
from linkwind.aero.flow.geometry import Geometry, Place, Walls
from linkwind.aero.flow.grid import Grid
from linkwind.errors import ProtocolError
from linkwind.frames import FlowFrame, VolumeFrame
from linkwind.native.boundary import Placement
from linkwind.native.fluid import shear_rate
from linkwind.spatial import Array

SLACK = 2.0  # cells by which the mechanism may leave its place before the window follows
_MAGIC = b"LWFLOW01"


class Window:
    """A lattice at a place in the world.

    Attributes:
        lattice: the fluid, at rest at first: the stream everywhere.
        size: its cells along each axis.
        offset: cells by which the window has followed, along each axis.
    """

    def __init__(
        self, geometry: Geometry, grid: Grid, size: tuple[int, ...], middle: Array, threads: int
    ) -> None:
        """Fill a window of ``size`` cells; ``middle`` of the mechanism [m], shape (d,)."""
        self._geometry, self.size, d = geometry, size, grid.dimensions
        self.lattice = geometry.lattice(grid, size, threads)
        self.offset = np.zeros(d, dtype=np.int64)
        self._kept: NDArray[np.float32] | None = None
        self._kept_offset = np.zeros(d, dtype=np.int64)
        self._head = struct.Struct(f"<8s{d}I{d}qd")
        self._cell = grid.cell
        self.step = grid.step
        self._stand = np.array(grid.place) * size
        self._corner = middle - self._stand * grid.cell  # centre of its first cell at the start [m]

    @property
    def step(self) -> float:
        """Time of a lattice step [s]."""
        return self._step

    @step.setter
    def step(self, value: float) -> None:
        self._step = value
        linear = len(self.size)
        self._units = np.array([1.0 / self.speed] * linear + [value] * (len(self._geometry.twist) - linear))

    @property
    def speed(self) -> float:
        """A cell a step [m/s]."""
        return self._cell / self.step

    def poses(self, pose: Array) -> Array:
        """Return poses, centres of mass first [m], in cells of the window."""
        d, inside = len(self.size), pose.copy()
        inside[:, :d] = (pose[:, :d] - self._corner) / self._cell - self.offset
        return inside

    def twists(self, twist: Array) -> Array:
        """Return twists [m/s, rad/s] in cells and steps."""
        scaled: Array = twist * self._units
        return scaled

    def place(self, walls: Walls, pose: Array) -> tuple[Placement, int]:
        """Put bodies into the window; return what came of it, and the marker it is about."""
        self._placed = self.poses(pose)
        return walls.place(self.lattice, self._placed)

    def go(self, walls: Walls, twist: Array, *, look: bool) -> float | None:
        """Step the fluid with the bodies that are placed, and follow them; return the leak [m/s] or None."""
        middle = np.add.reduce(self._placed)[: len(self.size)] / len(self._placed)
        shift = tuple((far > SLACK) - (far < -SLACK) for far in (middle - self._stand).tolist())
        leak = walls.step(self.lattice, self.twists(twist), shift, look=look)
        if any(shift):
            self.offset += shift
        return None if leak is None else leak * self.speed

    def halve(self, viscosity: float) -> None:
        """Halve the time of a step; ``viscosity`` in m²/s."""
        self.step *= 0.5
        self.lattice.halve_step(shear_rate(viscosity * self.step / self._cell**2))

    def picture(self, density: float, step: int, time_ns: int, frame: Frame) -> FlowFrame | VolumeFrame:
        """Return the fluid in the world, where the window goes with ``frame``; ``density`` in kg/m³."""
        stride = self._geometry.stride(self.size)
        first = self._corner + (self.offset + 0.5 * (stride - 1)) * self._cell
        pressure = density * self.speed**2 / 3.0
        first += frame.way
        place = Place(tuple(first.tolist()), stride * self._cell, self.speed, pressure, self.step)
        picture = self._geometry.picture(step, time_ns, place, self.lattice.moments(stride))
        if frame.velocity.any():
            picture.velocity[...] += frame.velocity.astype(np.float32)
        return picture

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

    def save(self, before: bytes) -> bytes:
        """Return everything that changes, as an opaque blob behind other bytes; it is copied once."""
        head = self._head.pack(_MAGIC, *self.size, *self.offset.tolist(), self.step)
        return b"".join((before, head, *self.lattice.parts))

    def restore(self, blob: bytes | memoryview) -> None:
        """Take back what ``save`` returned.

        Raises:
            ProtocolError: the blob is not of such a window.
        """
        head, d = blob[: self._head.size], len(self.size)
        if len(head) < self._head.size or self._head.unpack(head)[: d + 1] != (_MAGIC, *self.size):
            raise ProtocolError(
                f"model flow: expected a checkpoint of {self.size} cells; got {len(blob)} bytes."
            )
        numbers = self._head.unpack(head)
        self.step = numbers[-1]
        try:
            self.lattice.state = blob[self._head.size :]
        except ValueError as error:
            raise ProtocolError(f"model flow: checkpoint: {error}") from error
        self.offset[:] = numbers[d + 1 : -1]
