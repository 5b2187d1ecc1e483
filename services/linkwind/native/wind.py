"""The wind (``fmu/aero/lw_wind.h``): a uniform stream, functions of time and place, and travelling gusts."""

from __future__ import annotations

import ctypes
import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from linkwind.native.library import declare
from linkwind.spatial import Array, address

GUST_SHAPES = {"sine": 0, "one_minus_cosine": 1}
VARIABLES = ("t", "x", "y", "z")  # of the functions


@dataclass(frozen=True)
class WindTable:
    """A uniform stream with functions and travelling gusts: U0 + u(t, r) + Σ a s(2π(f t + k·r) + φ).

    Attributes:
        uniform: U0 [m/s], shape (3,), in W.
        gusts: a [m/s] (3), f [Hz], k [1/m] (3), φ [rad], shape s as ``GUST_SHAPES`` of each gust, shape
            (n, 9), a and k in W.
        code: operation and operand of each instruction of the program whose results 0, 1, 2 are u along x, y
            and z, and whose variables are ``VARIABLES``, shape (m, 2).
        constants: what its instructions push, shape (any,).
        inputs: how many of the constants, the first ones, are inputs.
    """

    uniform: Array
    gusts: Array
    code: NDArray[np.int32] = field(default_factory=lambda: np.zeros((0, 2), np.int32))
    constants: Array = field(default_factory=lambda: np.zeros(0))
    inputs: int = 0


class WindStruct(ctypes.Structure):
    """``lw_wind``; the table must live as long."""

    _fields_ = [
        ("uniform", ctypes.c_double * 3),
        ("n_gusts", ctypes.c_int),
        ("gusts", ctypes.c_void_p),
        ("instructions", ctypes.c_int),
        ("code", ctypes.c_void_p),
        ("constants", ctypes.c_void_p),
    ]

    @classmethod
    def of(cls, wind: WindTable) -> WindStruct:
        """Return a wind as the library takes it."""
        at = address(wind.gusts) if len(wind.gusts) else None
        code = int(wind.code.__array_interface__["data"][0]) if len(wind.code) else None
        constants = address(wind.constants) if len(wind.constants) else None
        uniform = (ctypes.c_double * 3)(*wind.uniform)
        return cls(uniform, len(wind.gusts), at, len(wind.code), code, constants)


_pointer = ctypes.c_void_p
_sample = declare("lw_wind_sample_many", [_pointer, ctypes.c_int, *[_pointer] * 5], None)


class Sampler:
    """A wind that is asked for again and again."""

    def __init__(self, table: WindTable) -> None:
        self._table = table  # its memory is the library's
        self._struct = WindStruct.of(table)
        self._at = ctypes.addressof(self._struct)

    def __call__(self, t: Array | float, r: Array, v: Array) -> tuple[Array, Array]:
        """Return the wind at points that move, and its rate of change there; see ``wind_at``."""
        shape = np.shape(r)
        n = math.prod(shape[:-1])
        room = np.empty(13 * n)
        points, speeds, velocity, rate = room[n:].reshape((4, *shape))
        room[:n].reshape(shape[:-1])[...] = t
        points[...], speeds[...] = r, v
        at = address(room)
        _sample(self._at, n, *(at + 8 * n * first for first in (0, 1, 4, 7, 10)))
        return velocity, rate


def wind_at(wind: WindTable, t: Array | float, r: Array, v: Array) -> tuple[Array, Array]:
    """Return the wind at points that move, and its rate of change there.

    Args:
        wind: the wind.
        t: time [s], of all points or of each, shape (…).
        r: the points [m], shape (…, 3), in W.
        v: their velocities [m/s], shape (…, 3), in W.

    Returns:
        Velocity [m/s] and total derivative ∂U/∂t + (v·∇)U [m/s²], each of shape (…, 3), in W.
    """
    return Sampler(wind)(t, r, v)
