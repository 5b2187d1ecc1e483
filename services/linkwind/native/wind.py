"""The wind (``fmu/aero/lw_wind.h``): a uniform stream and travelling gusts."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from linkwind.native.library import declare
from linkwind.spatial import Array, address

GUST_SHAPES = {"sine": 0, "one_minus_cosine": 1}


@dataclass(frozen=True)
class WindTable:
    """A uniform stream with travelling gusts: U0 + Σ a s(2π(f t + k·r) + φ).

    Attributes:
        uniform: U0 [m/s], shape (3,), in W.
        gusts: a [m/s] (3), f [Hz], k [1/m] (3), φ [rad], shape s as ``GUST_SHAPES`` of each gust, shape
            (n, 9), a and k in W.
    """

    uniform: Array
    gusts: Array


class WindStruct(ctypes.Structure):
    """``lw_wind``; the table must live as long."""

    _fields_ = [("uniform", ctypes.c_double * 3), ("n_gusts", ctypes.c_int), ("gusts", ctypes.c_void_p)]

    @classmethod
    def of(cls, wind: WindTable) -> WindStruct:
        """Return a wind as the library takes it."""
        at = address(wind.gusts) if len(wind.gusts) else None
        return cls((ctypes.c_double * 3)(*wind.uniform), len(wind.gusts), at)


class _Vec3(ctypes.Structure):
    """``lw_vec3``."""

    _fields_ = [(name, ctypes.c_double) for name in "xyz"]


class _WindSample(ctypes.Structure):
    """``lw_wind_sample``."""

    _fields_ = [("velocity", _Vec3), ("rate", _Vec3)]


def wind_at(wind: WindTable, t: float, r: Array, v: Array) -> tuple[Array, Array]:
    """Return the wind at a point that moves, and its rate of change there.

    Args:
        wind: the wind.
        t: time [s].
        r: the point [m], shape (3,), in W.
        v: the point's velocity [m/s], shape (3,), in W.

    Returns:
        Velocity [m/s] and total derivative ∂U/∂t + (v·∇)U [m/s²], each of shape (3,), in W.
    """
    function = declare("lw_wind_at", [ctypes.c_void_p, ctypes.c_double, _Vec3, _Vec3], _WindSample)
    sample = function(ctypes.byref(WindStruct.of(wind)), t, _Vec3(*r), _Vec3(*v))
    velocity, rate = sample.velocity, sample.rate
    return np.array([velocity.x, velocity.y, velocity.z]), np.array([rate.x, rate.y, rate.z])
