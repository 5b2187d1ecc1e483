"""The force models of ``fmu/aero``: their constant tables, and calls that write wrenches in place.

A model is a struct of pointers into the arrays of a frozen table, which the FMU export writes out as
constants. Motions and wrenches cross as structs of addresses, bound once for each object.
"""

from __future__ import annotations

import ctypes
import enum
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.native.library import declare
from linkwind.native.wind import WindStruct, WindTable
from linkwind.spatial import Array, Motion, Wrench, address

Indices = NDArray[np.int32]

VARIABLES = ("t", "x", "y", "z", "vx", "vy", "vz", "wx", "wy", "wz", "theta")
COMPONENTS = ("fx", "fy", "fz", "tx", "ty", "tz")


class Coefficients(enum.IntEnum):
    """Coefficient sets of the plate (``fmu/aero/lw_plate.h``)."""

    RISTROPH = 0
    ANDERSEN = 1
    TABLE = 2


@dataclass(frozen=True)
class PlateTable:
    """Flat plates and wings in a wind.

    Attributes:
        body: index of each plate among all bodies, shape (n,).
        size: chord, of a wing the mean one, and span [m], shape (n, 2).
        coefficients: the coefficient set of all plates.
        density: of the fluid [kg/m³].
        wind: the wind that all plates are in.
        strips: that the span of each plate is cut into.
        curves: of TABLE: C_l, C_d and C_m about the middle of the chord, nose up, over the angle of attack
            -π … π, each as ``expression.curves`` lays it out, shape (3, any).
        planform: of each strip, chord and x of its centre over the mean chord, and by how much z of it, over
            the span, is more than that of a plate's strip, whose row is (1, 0, 0), shape (n, strips, 3);
            (0, 0, 3) where all are plates.
    """

    body: Indices
    size: Array
    coefficients: Coefficients
    density: float
    wind: WindTable
    strips: int = 1
    curves: Array = field(default_factory=lambda: np.zeros((3, 0)))
    planform: Array = field(default_factory=lambda: np.zeros((0, 0, 3)))


@dataclass(frozen=True)
class FieldTable:
    """Postfix programs that give the wrench on bodies.

    Attributes:
        body: index of each program's body among all bodies, shape (n,).
        start: first instruction of each program, and the end of the last, shape (n + 1,).
        code: operation and operand of each instruction, shape (instructions, 2).
        constants: what its instructions push, shape (any,).
    """

    body: Indices
    start: Indices
    code: Indices
    constants: Array


class _Pointers4(ctypes.Structure):
    """``lw_motion``."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("position", "orientation", "linear", "angular")]


class _Pointers3(ctypes.Structure):
    """``lw_wrench``."""

    _fields_ = [(name, ctypes.c_void_p) for name in ("force", "torque", "added_inertia")]


class _Plates(ctypes.Structure):
    """``lw_plates``."""

    _fields_ = [
        ("n", ctypes.c_int),
        ("coefficients", ctypes.c_int),
        ("strips", ctypes.c_int),
        ("curve_size", ctypes.c_int),
        ("body", ctypes.c_void_p),
        ("size", ctypes.c_void_p),
        ("planform", ctypes.c_void_p),
        ("curves", ctypes.c_void_p),
        ("density", ctypes.c_double),
        ("wind", WindStruct),
    ]


class _Field(ctypes.Structure):
    """``lw_field``."""

    _fields_ = [
        ("n", ctypes.c_int),
        ("body", ctypes.c_void_p),
        ("start", ctypes.c_void_p),
        ("code", ctypes.c_void_p),
        ("constants", ctypes.c_void_p),
    ]


class _Bound:
    """The struct of addresses of the object last seen; holds the object, so that its memory stays."""

    def __init__(self, pointers: type[ctypes.Structure]) -> None:
        self._pointers = pointers
        self._object: Motion | Wrench | None = None
        self._struct: ctypes.Structure | None = None
        self._at = 0

    def at(self, item: Motion | Wrench) -> int:
        if item is not self._object:
            self._struct = self._pointers(*item.addresses)
            self._at = ctypes.addressof(self._struct)
            self._object = item
        return self._at


def _indices(array: Indices) -> Indices:
    return np.ascontiguousarray(array, dtype=np.int32)


def _index_address(array: Indices) -> int:
    return int(array.__array_interface__["data"][0])


class Plates:
    """Quasi-steady flat plates and wings.

    Attributes:
        at: address of the ``lw_plates``.
    """

    def __init__(self, table: PlateTable) -> None:
        self.table = table
        self._body = _indices(table.body)
        self._struct = _Plates(
            len(table.body),
            table.coefficients,
            table.strips,
            table.curves.shape[1],
            _index_address(self._body),
            address(table.size),
            address(table.planform) if table.planform.size else None,
            address(table.curves) if table.curves.size else None,
            table.density,
            WindStruct.of(table.wind),
        )
        self.at = ctypes.addressof(self._struct)
        arguments = [ctypes.c_void_p, ctypes.c_double, ctypes.c_void_p, ctypes.c_void_p]
        self._evaluate = declare("lw_plates_evaluate", arguments)
        self._motion, self._wrench = _Bound(_Pointers4), _Bound(_Pointers3)

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> int:
        """Write the wrench on every plate, and its added inertia where the wrench has a place for it.

        Args:
            t: time [s].
            motion: all bodies of the scenario.
            wrench: the plates, in the order of the table; filled in place.

        Returns:
            0, or 1 + the index of the first plate whose wrench is not finite.
        """
        return self._evaluate(self.at, t, self._motion.at(motion), self._wrench.at(wrench))  # type: ignore[no-any-return]

    def wind_fault(self, plate: int, t: float, motion: Motion) -> Array | None:
        """Return where a plate meets a wind that is not finite, if that is why its wrench is not.

        Args:
            plate: its index in the table.
            t: time [s].
            motion: all bodies of the scenario.

        Returns:
            Position [m] and velocity [m/s] of the centre of one of its strips, shape (6,), or None.
        """
        place = np.zeros(6)
        pointer = ctypes.c_void_p
        arguments = [pointer, ctypes.c_int, ctypes.c_double, pointer, pointer]
        fault = declare("lw_plates_wind_fault", arguments)
        return place if fault(self.at, plate, t, self._motion.at(motion), address(place)) else None


class Field:
    """A force field given as postfix programs.

    Attributes:
        theta: angle about world z of each body's x axis at the last accepted state [rad], unwrapped,
            shape (n,); it is the field's only memory.
        at: address of the ``lw_field``.
    """

    def __init__(self, table: FieldTable, theta: Array) -> None:
        self.table = table
        self.theta = theta
        self._arrays = [_indices(array) for array in (table.body, table.start, table.code)]
        constants = address(table.constants) if len(table.constants) else None
        self._struct = _Field(len(table.body), *map(_index_address, self._arrays), constants)
        self.at, self._theta_at = ctypes.addressof(self._struct), address(theta)
        pointer = ctypes.c_void_p
        self._commit: Any = declare("lw_field_commit", [pointer, pointer, pointer], None)
        self._evaluate = declare("lw_field_evaluate", [pointer, ctypes.c_double, pointer, pointer, pointer])
        self._motion, self._accepted, self._wrench = map(_Bound, (_Pointers4, _Pointers4, _Pointers3))

    def commit(self, motion: Motion) -> None:
        """Take the angles of an accepted state as those to unwrap against."""
        self._commit(self.at, self._accepted.at(motion), self._theta_at)

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> int:
        """Write force and torque on every body.

        Args:
            t: time [s].
            motion: all bodies of the scenario.
            wrench: the field's bodies, in the order of the table; filled in place.

        Returns:
            0, or 1 + 6 i + c where component c of body i is the first that is not finite.
        """
        return self._evaluate(  # type: ignore[no-any-return]
            self.at, t, self._motion.at(motion), self._theta_at, self._wrench.at(wrench)
        )

    def variables(self, i: int, t: float, motion: Motion) -> dict[str, float]:
        """Return the values of all variables for the i-th body of the field."""
        pointer = ctypes.c_void_p
        arguments = [pointer, ctypes.c_int, ctypes.c_double, pointer, pointer, pointer]
        values = np.zeros(len(VARIABLES))
        function = declare("lw_field_variables", arguments, None)
        function(self.at, i, t, self._motion.at(motion), self._theta_at, address(values))
        return dict(zip(VARIABLES, values.tolist(), strict=True))
