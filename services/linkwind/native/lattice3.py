"""A fluid on a lattice in space (``fmu/flow``): memory, parameters, and one call a step.

Lattice units: a cell is 1 wide, a step takes 1, the density is 1 at rest, so the speed of sound is 1/√3.
Equations and sources: ``fmu/README.md``, "Flow in space".
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linkwind.native.fluid import Floats, Fluid, address, aligned
from linkwind.native.library import declare
from linkwind.native.threads import team

DIRECTIONS = 19
_PADDING = 112  # floats from one volume to the next, less whole pages: so they do not share cache sets

Vector = tuple[float, float, float]


class _Lattice3(ctypes.Structure):
    """``lw_lattice3``."""

    _fields_ = [
        *((name, ctypes.c_int32) for name in ("nx", "ny", "nz", "fringe")),
        ("shear_rate", ctypes.c_float),
        ("stream", ctypes.c_float * 3),
        ("volume", ctypes.c_int64),
        *((name, ctypes.c_void_p) for name in ("populations", "next", "force", "forced", "blend", "threads")),
        ("instructions", ctypes.c_int32),
    ]


@dataclass(frozen=True)
class Picture3:
    """Means over cubic blocks of cells, z along the first axis of a volume, then y, then x.

    Attributes:
        velocity: momentum over mass [cells/step], shape (3, nz // stride, ny // stride, nx // stride).
        density: less 1, shape (nz // stride, ny // stride, nx // stride).
    """

    velocity: Floats
    density: Floats


class Lattice3(Fluid):
    """A window full of fluid in space, surrounded by an undisturbed stream.

    Attributes:
        nx, ny, nz: cells along x, y and z.
        fringe: layers on every side that relax towards the stream.
        threads: that share a step; the bits do not depend on it.
        force: on the fluid of each cell in the coming step [cells/step², times the density 1], shape
            (3, nz, ny, nx), float32; read in rows that are ``forced`` only, never changed by a step.
        forced: whether a row of ``force`` is read, shape (nz, ny), uint8, none at first; the others count
            as zero.
        struct_address: of the ``lw_lattice3``, for the rest of the library.
    """

    def __init__(
        self,
        nx: int,
        ny: int,
        nz: int,
        *,
        shear_rate: float,
        stream: Vector = (0.0, 0.0, 0.0),
        fringe: int = 12,
        threads: int = 1,
    ) -> None:
        """Fill a window with the stream.

        Args:
            nx: cells along x; steps are fastest where it is a multiple of 16.
            ny: cells along y.
            nz: cells along z.
            shear_rate: ω between 0 and 2, see ``linkwind.native.fluid.shear_rate()``.
            stream: velocity of the undisturbed fluid [cells/step], at most 0.3.
            fringe: layers on every side that relax towards the stream, layer k by 0.3 (1 − k/fringe)³ a step.
            threads: that share a step.

        Raises:
            ValueError: an argument is out of its range.
            LinkwindError: the threads cannot be started.
        """
        _check_size(nx, ny, nz, fringe)
        if threads < 1:
            raise ValueError(f"threads: expected 1 or more; got {threads}")
        self.nx, self.ny, self.nz, self.fringe, self.threads = nx, ny, nz, fringe, threads
        shape, cells, apart = (nz, ny, nx), nx * ny * nz, (2 * ny + 3) * nx
        volume = -(-(cells + apart) // 1024) * 1024 + _PADDING
        self._memory = aligned((1 if threads == 1 else 2) * DIRECTIONS * volume)
        volumes = self._memory.reshape(-1, DIRECTIONS, volume)
        begins = (volumes[0], volumes[0, :, apart:]) if threads == 1 else volumes
        self._places: list[Floats] = [of[:, :cells].reshape(DIRECTIONS, *shape) for of in begins]
        self.force = aligned(3 * cells).reshape(3, *shape)
        self.forced: NDArray[np.uint8] = np.zeros((nz, ny), dtype=np.uint8)
        self._blend = np.zeros(nx, dtype=np.float32)
        first, second = map(address, self._places)
        force, forced, blend = address(self.force), address(self.forced), address(self._blend)
        rest = (volume, first, second, force, forced, blend)
        self._struct = _Lattice3(nx, ny, nz, fringe, 0.0, (0.0, 0.0, 0.0), *rest)
        self.shear_rate, self.stream = shear_rate, stream
        self.struct_address = ctypes.addressof(self._struct)
        if threads > 1:
            self._struct.threads = team(self, self.threads)
        self._shift = (ctypes.c_int32 * 3)()
        self._shift_address = ctypes.addressof(self._shift)
        pointer = ctypes.c_void_p
        self._step = declare("lw_lattice3_step", [pointer, pointer], None)
        self._moments = declare("lw_lattice3_moments", [pointer, ctypes.c_int32, pointer, pointer], None)
        self._halve_step = declare("lw_lattice3_halve_step", [pointer, ctypes.c_float])
        declare("lw_lattice3_init", [pointer], None)(self.struct_address)

    def step(self, shift: tuple[int, int, int] = (0, 0, 0)) -> None:
        """Go on by one step.

        Args:
            shift: of the window, by -1, 0 or 1 cells along each axis: cell (i, j, k) is
                (i, j, k) + shift of the window before, to which ``force`` belongs. What was outside of it
                is the stream.

        Raises:
            ValueError: the shift is a larger one.
        """
        if not all(-1 <= cells <= 1 for cells in shift):
            raise ValueError(f"shift: expected -1, 0 or 1 cells along each axis; got {shift}")
        self._shift[:] = list(shift)
        self._step(self.struct_address, self._shift_address)

    def moments(self, stride: int = 1) -> Picture3:
        """Return the present state as means over blocks of ``stride``³ cells.

        It is the state after the collision: where a force acted, half of it is too much in the velocity.

        Raises:
            ValueError: there would be less than two blocks along a side.
        """
        most = min(self.nx, self.ny, self.nz) // 2
        if not 1 <= stride <= most:
            raise ValueError(f"stride: expected 1 … {most}; got {stride}")
        shape = tuple(n // stride for n in (self.nz, self.ny, self.nx))
        velocity, density = np.empty((3, *shape), dtype=np.float32), np.empty(shape, dtype=np.float32)
        self._moments(self.struct_address, stride, address(velocity), address(density))
        return Picture3(velocity, density)


def _check_size(nx: int, ny: int, nz: int, fringe: int) -> None:
    if fringe < 1:
        raise ValueError(f"fringe: expected 1 or more layers; got {fringe}")
    for name, size in (("nx", nx), ("ny", ny), ("nz", nz)):
        if size < 2 * fringe + 8:
            raise ValueError(f"{name}: expected at least 2 fringe + 8 = {2 * fringe + 8} cells; got {size}")
