"""Rigid bodies in a fluid on a lattice (``fmu/flow/lw_boundary.c``): their markers, and the forces between.

Lattice units: cells, steps, the density of the fluid at rest. Equations and sources: ``fmu/README.md``,
"Bodies in the flow".
"""

from __future__ import annotations

import ctypes
import enum
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.native.lattice import Lattice
from linkwind.native.library import declare
from linkwind.spatial import Array, address

Indices = NDArray[np.int32]

_STENCIL = 9
_ARRAYS = ("body", "next", "point", "joined")  # read
_WRITTEN = ("arm", "at", "cell", "weight", "lightness", "velocity", "first", "factor", "solution")


class Placement(enum.IntEnum):
    """What came of putting the bodies somewhere (``lw_placement``)."""

    PLACED = 0
    OUTSIDE = 1
    OVERLAP = 2


class Markers(NamedTuple):
    """The markers of some bodies; their outlines lie between them.

    Attributes:
        body: the bodies that carry each marker, the second -1 where there is one only, int32, shape (k, 2).
        next: the marker beside it on the same outline, -1 where an open one ends, int32, shape (k,).
        point: its place in the frame of each of the two [cells], from the centre of mass, shape (k, 2, 2).
        joined: 1 where two bodies may touch, for there is a joint between them, int32, shape (n, n).
    """

    body: Indices
    next: Indices
    point: Array
    joined: Indices


class _Boundary(ctypes.Structure):
    """``lw_boundary``."""

    _fields_ = [
        ("bodies", ctypes.c_int32),
        ("count", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in (*_ARRAYS, *_WRITTEN)),
    ]


class Boundary:
    """Bodies whose markers the fluid follows.

    Attributes:
        markers: as given.
        at: place of each marker in the window [cells], shape (k, 2), after ``place``.
        wrench: on each body (x, y, about z), shape (n, 3), after ``evaluate``.
        response: minus its derivative by the twists, shape (3n, 3n), symmetric, after ``evaluate``.
    """

    def __init__(self, bodies: int, markers: Markers) -> None:
        """Make room for ``bodies`` bodies with their markers."""
        self.markers = markers
        k, n = len(markers.body), bodies
        self.at, self.wrench, self.response = np.zeros((k, 2)), np.zeros((n, 3)), np.zeros((3 * n, 3 * n))
        self._kept: list[NDArray[Any]] = [
            np.ascontiguousarray(markers.body, np.int32),
            np.ascontiguousarray(markers.next, np.int32),
            np.ascontiguousarray(markers.point, np.float64),
            np.ascontiguousarray(markers.joined, np.int32),
            np.zeros((k, 2, 2)),
            self.at,
            np.zeros((k, 2), np.int32),
            np.zeros((k, _STENCIL)),
            np.zeros((k, _STENCIL)),
            np.zeros((k, 2)),
            np.zeros(k, np.int32),
            np.zeros((k, k)),
            np.zeros((k, 6 * n + 2)),
        ]
        self._struct = _Boundary(n, k, *(_at(array) for array in self._kept))
        self._self = ctypes.addressof(self._struct)
        self._marker, self._pose, self._twist = ctypes.c_int32(), np.zeros((n, 4)), np.zeros((n, 3))
        self._pose_at, self._twist_at = address(self._pose), address(self._twist)
        self._marker_at = ctypes.addressof(self._marker)
        self._out = address(self.wrench), address(self.response)
        pointer = ctypes.c_void_p
        self._place = declare("lw_boundary_place", [pointer] * 4)
        self._evaluate = declare("lw_boundary_wrench", [pointer] * 4, None)
        self._act = declare("lw_boundary_act", [pointer] * 4, None)
        self._leak = declare("lw_boundary_leak", [pointer] * 4, ctypes.c_double)
        self._clear = declare("lw_boundary_clear", [pointer] * 3, None)

    def place(self, lattice: Lattice, pose: Array) -> tuple[Placement, int]:
        """Put the bodies somewhere in the window, at the end of the coming step.

        Args:
            lattice: the fluid.
            pose: x and y of the centre of mass in the window [cells], cosine and sine of the angle, (n, 4).

        Returns:
            What came of it, and the marker that it is about.
        """
        self._pose[:] = pose
        status = self._place(self._self, lattice.struct_address, self._pose_at, self._marker_at)
        return (Placement(status) if status else Placement.PLACED), self._marker.value

    def evaluate(self, twist: Array) -> None:
        """Compute ``wrench`` and ``response`` for twists at the end of the step, shape (n, 3), where "
        "placed."""
        self._twist[:] = twist
        self._evaluate(self._self, self._twist_at, *self._out)

    def step(
        self, lattice: Lattice, twist: Array, shift: tuple[int, int] = (0, 0), *, look: bool = True
    ) -> float | None:
        """Let the fluid go on by one step with the bodies where they were placed.

        Args:
            lattice: the fluid.
            twist: at the end of the step, shape (n, 3).
            shift: of the window [cells].
            look: for leaks.

        Returns:
            The largest velocity through an outline, halfway between two markers [cells/step], if looked for.
        """
        self._twist[:] = twist
        force = lattice.force_address
        arguments = (self._self, lattice.struct_address, force, self._twist_at)
        self._act(*arguments)
        leak = self._leak(*arguments) if look else None
        lattice.step(shift)
        self._clear(self._self, lattice.struct_address, force)
        return leak


def _at(array: NDArray[Any]) -> int:
    return int(array.__array_interface__["data"][0])
