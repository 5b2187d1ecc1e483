"""A fluid on a lattice (``fmu/flow``): memory, parameters, and one call a step.

Lattice units: a cell is 1 wide, a step takes 1, the density is 1 at rest, so the speed of sound is 1/√3.
Equations and sources: ``fmu/README.md``, "Flow on a lattice".
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from linkwind.native.fluid import Floats, Fluid, address, aligned
from linkwind.native.library import declare
from linkwind.native.threads import team

DIRECTIONS = 9
_PADDING = 112  # floats behind each plane: without it all planes of 512 x 448 would share the same cache sets
_APART = 3  # rows between the places that populations have by turns, in the memory of a single thread


class _Lattice(ctypes.Structure):
    """``lw_lattice``."""

    _fields_ = [
        *((name, ctypes.c_int32) for name in ("nx", "ny", "fringe", "force_begin", "force_end")),
        ("shear_rate", ctypes.c_float),
        ("stream", ctypes.c_float * 2),
        ("plane", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("populations", "next", "force", "blend", "threads")),
        ("instructions", ctypes.c_int32),
    ]


@dataclass(frozen=True)
class Picture:
    """Means over square blocks of cells, row-major, y along the first axis of a plane.

    Attributes:
        velocity: momentum over mass [cells/step], shape (2, ny // stride, nx // stride).
        density: less 1, shape (ny // stride, nx // stride).
        vorticity: ∂v/∂x − ∂u/∂y [1/step], central differences (one-sided at borders), shape of density.
    """

    velocity: Floats
    density: Floats
    vorticity: Floats


class Lattice(Fluid):
    """A window full of fluid, surrounded by an undisturbed stream.

    Attributes:
        nx, ny: cells along x and y.
        fringe: layers on every side that relax towards the stream.
        threads: that share a step; the bits do not depend on it.
        force: on the fluid of each cell in the coming step [cells/step², times the density 1], shape
            (2, ny, nx), float32; read in ``force_rows`` only, never changed by a step.
        struct_address, force_address: of the ``lw_lattice`` and of ``force``, for the rest of the library.
    """

    def __init__(
        self,
        nx: int,
        ny: int,
        *,
        shear_rate: float,
        stream: tuple[float, float] = (0.0, 0.0),
        fringe: int = 24,
        threads: int = 1,
    ) -> None:
        """Fill a window with the stream.

        Args:
            nx: cells along x; steps are fastest where it is a multiple of 16.
            ny: cells along y.
            shear_rate: ω between 0 and 2, see ``linkwind.native.fluid.shear_rate()``.
            stream: velocity of the undisturbed fluid [cells/step], at most 0.3.
            fringe: layers on every side that relax towards the stream, layer k by 0.3 (1 − k/fringe)³ a step.
            threads: that share a step.

        Raises:
            ValueError: an argument is out of its range.
            LinkwindError: the threads cannot be started.
        """
        _check_size(nx, ny, fringe)
        if threads < 1:
            raise ValueError(f"threads: expected 1 or more; got {threads}")
        self.nx, self.ny, self.fringe, self.threads = nx, ny, fringe, threads
        plane = -(-nx * (ny + _APART) // 16) * 16 + _PADDING
        self._memory = aligned((1 if threads == 1 else 2) * DIRECTIONS * plane)
        planes = self._memory.reshape(-1, DIRECTIONS, plane)
        begins = (planes[0], planes[0, :, _APART * nx :]) if threads == 1 else planes
        self._places: list[Floats] = [of[:, : nx * ny].reshape(DIRECTIONS, ny, nx) for of in begins]
        self.force = aligned(2 * ny * nx).reshape(2, ny, nx)
        self._blend = np.zeros(nx, dtype=np.float32)
        first, second = map(address, self._places)
        self.force_address = address(self.force)
        rest = (plane, first, second, self.force_address, address(self._blend))
        self._struct = _Lattice(nx, ny, fringe, 0, ny, 0.0, (0.0, 0.0), *rest)
        self.shear_rate, self.stream = shear_rate, stream
        self.struct_address = ctypes.addressof(self._struct)
        if threads > 1:
            self._struct.threads = team(self, self.threads)
        number, pointer = ctypes.c_int32, ctypes.c_void_p
        self._step = declare("lw_lattice_step", [pointer, number, number], None)
        self._moments = declare("lw_lattice_moments", [pointer, number, pointer, pointer], None)
        self._halve_step = declare("lw_lattice_halve_step", [pointer, ctypes.c_float])
        declare("lw_lattice_init", [pointer], None)(self.struct_address)

    @property
    def force_rows(self) -> tuple[int, int]:
        """First and past the last row of ``force`` that a step reads; the others count as zero."""
        return self._struct.force_begin, self._struct.force_end

    @force_rows.setter
    def force_rows(self, value: tuple[int, int]) -> None:
        if not 0 <= value[0] <= value[1] <= self.ny:
            raise ValueError(f"force_rows: expected a range within 0 … {self.ny}; got {value}")
        self._struct.force_begin, self._struct.force_end = value

    def step(self, shift: tuple[int, int] = (0, 0)) -> None:
        """Go on by one step.

        Args:
            shift: of the window, by -1, 0 or 1 cells along each axis: cell (i, j) is
                (i + shift[0], j + shift[1]) of the window before, to which ``force`` belongs. What was
                outside of it is the stream.

        Raises:
            ValueError: the shift is a larger one.
        """
        x, y = shift
        if not (-1 <= x <= 1 and -1 <= y <= 1):
            raise ValueError(f"shift: expected -1, 0 or 1 cells along each axis; got {shift}")
        self._step(self.struct_address, x, y)

    def moments(self, stride: int = 1) -> Picture:
        """Return the present state as means over blocks of ``stride`` × ``stride`` cells.

        It is the state after the collision: where a force acted, half of it is too much in the velocity.

        Raises:
            ValueError: there would be less than two blocks along a side.
        """
        if not 1 <= stride <= min(self.nx, self.ny) // 2:
            raise ValueError(f"stride: expected 1 … {min(self.nx, self.ny) // 2}; got {stride}")
        velocity = np.empty((2, self.ny // stride, self.nx // stride), dtype=np.float32)
        density = np.empty(velocity.shape[1:], dtype=np.float32)
        self._moments(self.struct_address, stride, address(velocity), address(density))
        vorticity = np.gradient(velocity[1], stride, axis=1) - np.gradient(velocity[0], stride, axis=0)
        return Picture(velocity, density, vorticity)


def _check_size(nx: int, ny: int, fringe: int) -> None:
    if fringe < 1:
        raise ValueError(f"fringe: expected 1 or more layers; got {fringe}")
    for name, size in (("nx", nx), ("ny", ny)):
        if size < 2 * fringe + 8:
            raise ValueError(f"{name}: expected at least 2 fringe + 8 = {2 * fringe + 8} cells; got {size}")
