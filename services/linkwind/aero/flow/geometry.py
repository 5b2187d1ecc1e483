"""What differs between a flow in the plane and one in space."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from linkwind.aero.flow.grid import Grid
from linkwind.aero.flow.interior import Interior, InteriorInSpace
from linkwind.aero.flow.motion import State, between, between_in_space, planar, spatial
from linkwind.aero.flow.outline import markers
from linkwind.aero.flow.surface import surface_markers
from linkwind.frames import FlowFrame, VolumeFrame
from linkwind.native.boundary import Boundary, Placement
from linkwind.native.boundary3 import Boundary3
from linkwind.native.fluid import shear_rate
from linkwind.native.lattice import Lattice
from linkwind.native.lattice3 import Lattice3
from linkwind.scenario.bodies import Body, Joint
from linkwind.spatial import Array, Motion

PICTURE = 256  # cells of a picture in the plane along its longer side, about
PICTURE3 = 250_000  # cells of one in space, at most


class Walls(Protocol):
    """Markers of bodies of either kind, as far as they are alike."""

    markers: Any
    wrench: Array
    response: Array

    def place(self, lattice: Any, pose: Array) -> tuple[Placement, int]:
        """Put the bodies somewhere in the window."""

    def evaluate(self, twist: Array) -> None:
        """Compute ``wrench`` and ``response``."""

    def step(self, lattice: Any, twist: Array, shift: Any, *, look: bool = True) -> float | None:
        """Let the fluid go on by one step."""


class Inside(Protocol):
    """The fluid inside closed shapes."""

    any: bool

    def inertia(self, pose: Array) -> Array:
        """Return its inertia, shape (n, d, d)."""


@dataclass(frozen=True)
class Place:
    """Where a picture is taken.

    Attributes:
        first: centre of the first of its cells [m], in W.
        cell: side of its cells [m].
        speed: a cell of the lattice a step [m/s].
        pressure: of a difference of the lattice's density of 1 [Pa].
        step: time of a step of the lattice [s].
    """

    first: tuple[float, ...]
    cell: float
    speed: float
    pressure: float
    step: float


@dataclass(frozen=True)
class Geometry:
    """A flow in the plane, or in space.

    Attributes:
        twist: which of the six components of a twist in space there are.
        width: numbers of a pose.
        state: the motion of some bodies.
        between: two states, after a share of a step of so many seconds.
        lattice: of a grid, with so many cells along each axis, and threads.
        walls: the markers of bodies, from where they are at the start.
        inside: the fluid inside bodies, of a density as ``Grid.density``.
        stride: cells along a side of those of a picture, for so many cells of the lattice along each axis.
        picture: of the fluid: step, time [ns], where, and what the lattice shows.
    """

    twist: tuple[int, ...]
    width: int
    state: Callable[[Motion, Array | slice], State]
    between: Callable[[State, State, float, float], State]
    lattice: Callable[[Grid, Sequence[int], int], Lattice | Lattice3]
    walls: Callable[[list[Body], list[Joint], State, Grid], Walls]
    inside: Callable[[list[Body], float], Inside]
    stride: Callable[[Sequence[int]], int]
    picture: Callable[[int, int, Place, Any], FlowFrame | VolumeFrame]


def _lattice(grid: Grid, size: Sequence[int], threads: int) -> Lattice:
    rate, (x, y) = shear_rate(grid.lattice_viscosity), grid.stream
    return Lattice(*size, shear_rate=rate, stream=(x, y), fringe=grid.fringe, threads=threads)


def _lattice3(grid: Grid, size: Sequence[int], threads: int) -> Lattice3:
    rate, (x, y, z) = shear_rate(grid.lattice_viscosity), grid.stream
    return Lattice3(*size, shear_rate=rate, stream=(x, y, z), fringe=grid.fringe, threads=threads)


def _outlines(bodies: list[Body], joints: list[Joint], start: State, grid: Grid) -> Boundary:
    return Boundary(len(bodies), markers(bodies, joints, grid.cell, grid.lattice_viscosity))


def _surfaces(bodies: list[Body], joints: list[Joint], start: State, grid: Grid) -> Boundary3:
    found = surface_markers(bodies, joints, start.pose, grid.cell, grid.lattice_viscosity)
    return Boundary3(len(bodies), found)


def _stride(size: Sequence[int]) -> int:
    return max(1, max(size) // PICTURE)


def _stride3(size: Sequence[int]) -> int:
    share = math.prod(size) / PICTURE3
    return max(1, math.ceil(math.cbrt(share)))


def _flow_frame(step: int, time_ns: int, place: Place, seen: Any) -> FlowFrame:
    (x, y), speed = place.first, np.float32(place.speed)
    return FlowFrame(
        step,
        time_ns,
        (x, y),
        place.cell,
        np.ascontiguousarray(np.moveaxis(seen.velocity, 0, 2) * speed),
        seen.density * np.float32(place.pressure),
        seen.vorticity / np.float32(place.step),
    )


def _volume_frame(step: int, time_ns: int, place: Place, seen: Any) -> VolumeFrame:
    (x, y, z), speed = place.first, np.float32(place.speed)
    velocity = np.ascontiguousarray(np.moveaxis(seen.velocity, 0, 3) * speed)
    pressure = seen.density * np.float32(place.pressure)
    return VolumeFrame(step, time_ns, (x, y, z), place.cell, velocity, pressure)


PLANE = Geometry(
    twist=(0, 1, 5), width=4, state=planar, between=between, lattice=_lattice, walls=_outlines,
    inside=Interior, stride=_stride, picture=_flow_frame,
)  # fmt: skip
SPACE = Geometry(
    twist=(0, 1, 2, 3, 4, 5), width=7, state=spatial, between=between_in_space, lattice=_lattice3,
    walls=_surfaces, inside=InteriorInSpace, stride=_stride3, picture=_volume_frame,
)  # fmt: skip


def geometry(dimensions: int) -> Geometry:
    """Return the one of 2 or 3 dimensions."""
    return PLANE if dimensions == 2 else SPACE
