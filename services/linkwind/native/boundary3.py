"""Rigid bodies in a fluid on a lattice in space (``fmu/flow/lw_boundary3.c``): markers, and their forces.

Lattice units: cells, steps, the density of the fluid at rest. Equations and sources: ``fmu/README.md``,
"Bodies in the flow" and "Bodies in space".
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.native.boundary import Indices, Placement
from linkwind.native.fluid import aligned
from linkwind.native.lattice3 import Lattice3
from linkwind.native.library import declare
from linkwind.spatial import Array, address

_STENCIL = 36  # 9 rows of 3 cells and a fourth without weight
_TILE = 8  # markers in a block of the matrix, columns that are solved for at once


class Markers3(NamedTuple):
    """The markers of some bodies in space; their surfaces lie between them.

    Attributes:
        body: that carries each marker, int32, shape (k,).
        point: place in the frame of the body [cells], from the centre of mass, shape (k, 3).
        face: the markers around patches of the surfaces, in whose middle leaks are looked for; a triangle
            repeats its last one, int32, shape (m, 4).
        joined: 1 where two bodies may touch, for there is a joint between them, int32, shape (n, n).
    """

    body: Indices
    point: Array
    face: Indices
    joined: Indices


class _Tiles(ctypes.Structure):
    """``lw_tiles``."""

    _fields_ = [
        ("blocks", ctypes.c_int32),
        ("instructions", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in ("end", "start", "tiles")),
    ]


class _Boundary3(ctypes.Structure):
    """``lw_boundary3``."""

    _fields_ = [
        *((name, ctypes.c_int32) for name in ("bodies", "count", "faces")),
        *((name, ctypes.c_void_p) for name in ("body", "face", "joined", "point")),
        *(
            (name, ctypes.c_void_p)
            for name in (
                "arm",
                "at",
                "cell",
                "weight",
                "lightness",
                "velocity",
                "order",
                "cells",
                "box",
                "touched",
            )
        ),
        ("mobility", _Tiles),
        *((name, ctypes.c_void_p) for name in ("solution", "products")),
    ]


class Boundary3:
    """Bodies whose markers the fluid follows.

    Attributes:
        markers: as given.
        at: place of each marker in the window [cells], shape (k, 3), after ``place``.
        wrench: on each body, force and torque about the centre of mass, shape (n, 6), after ``evaluate``.
        response: minus its derivative by the twists, shape (6n, 6n), symmetric, after ``evaluate``.
    """

    def __init__(self, bodies: int, markers: Markers3) -> None:
        """Make room for ``bodies`` bodies with their markers."""
        self.markers = markers
        k, n, m = len(markers.body), bodies, len(markers.face)
        blocks, width = -(-k // _TILE), -(-(4 * n + 3) // _TILE) * _TILE
        self.at, self.wrench, self.response = np.zeros((k, 3)), np.zeros((n, 6)), np.zeros((6 * n, 6 * n))
        read: list[NDArray[Any]] = [
            np.ascontiguousarray(markers.body, np.int32),
            np.ascontiguousarray(markers.face, np.int32),
            np.ascontiguousarray(markers.joined, np.int32),
            np.ascontiguousarray(markers.point, np.float64),
        ]
        written: list[NDArray[Any]] = [
            np.zeros((k, 3)),
            self.at,
            np.zeros((k, 3), np.int32),
            _doubles(k * _STENCIL),
            _doubles(k * _STENCIL),
            np.zeros((k, 3)),
            np.zeros((k, 2)),  # a number and a double each
            np.zeros((blocks, 3, _TILE), np.int32),
            np.zeros((blocks, 6), np.int32),
            np.zeros(blocks, np.int32),
        ]
        matrix: list[NDArray[Any]] = [
            np.zeros(blocks, np.int32),
            np.zeros(blocks, np.int64),
            _doubles(blocks * (blocks + 1) // 2 * _TILE * _TILE),  # most of it is never touched
        ]
        solved: list[NDArray[Any]] = [_doubles(blocks * _TILE * width), _doubles(width * width)]
        self._kept = read, written, matrix, solved
        self._struct = _Boundary3(
            *(n, k, m),
            *map(_at, (*read, *written)),
            _Tiles(blocks, 0, *map(_at, matrix)),
            *map(_at, solved),
        )
        self._self = ctypes.addressof(self._struct)
        self._marker, self._pose, self._twist = ctypes.c_int32(), np.zeros((n, 7)), np.zeros((n, 6))
        self._pose_at, self._twist_at = address(self._pose), address(self._twist)
        self._marker_at = ctypes.addressof(self._marker)
        self._out = address(self.wrench), address(self.response)
        pointer = ctypes.c_void_p
        self._place = declare("lw_boundary3_place", [pointer] * 4)
        self._evaluate = declare("lw_boundary3_wrench", [pointer] * 4, None)
        self._act = declare("lw_boundary3_act", [pointer] * 3, None)
        self._leak = declare("lw_boundary3_leak", [pointer] * 3, ctypes.c_double)
        self._clear = declare("lw_boundary3_clear", [pointer] * 2, None)

    def place(self, lattice: Lattice3, pose: Array) -> tuple[Placement, int]:
        """Put the bodies somewhere in the window, at the end of the coming step.

        Args:
            lattice: the fluid.
            pose: centre of mass in the window [cells] and unit quaternion (w, x, y, z), body to world,
                shape (n, 7).

        Returns:
            What came of it, and the marker that it is about.
        """
        self._pose[:] = pose
        status = self._place(self._self, lattice.struct_address, self._pose_at, self._marker_at)
        return Placement(status), self._marker.value

    def evaluate(self, twist: Array) -> None:
        """Compute ``wrench`` and ``response`` where placed, for twists at the end of the step, (n, 6)."""
        self._twist[:] = twist
        self._evaluate(self._self, self._twist_at, *self._out)

    def step(
        self, lattice: Lattice3, twist: Array, shift: tuple[int, int, int] = (0, 0, 0), *, look: bool = True
    ) -> float | None:
        """Let the fluid go on by one step with the bodies where they were placed.

        Args:
            lattice: the fluid.
            twist: at the end of the step, linear then angular, shape (n, 6).
            shift: of the window [cells].
            look: for leaks.

        Returns:
            The largest velocity through a surface, in the middle of its patches [cells/step], if looked for.
        """
        self._twist[:] = twist
        arguments = (self._self, lattice.struct_address, self._twist_at)
        self._act(*arguments)
        leak = self._leak(*arguments) if look else None
        lattice.step(shift)
        self._clear(self._self, lattice.struct_address)
        return leak


def _doubles(count: int) -> Array:
    """Return zeros at the start of a cache line, of which the system gives memory where it is written."""
    return aligned(2 * count).view(np.float64)


def _at(array: NDArray[Any]) -> int:
    return int(array.__array_interface__["data"][0])
