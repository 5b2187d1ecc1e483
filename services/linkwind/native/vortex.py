"""Thin surfaces with free wakes (``fmu/vortex``): memory, and the two calls of a step.

Equations and sources: ``fmu/README.md``, "Vortex lattice".
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass

import numpy as np

from linkwind.native.library import declare
from linkwind.native.threads import team
from linkwind.native.wind import WindStruct, WindTable
from linkwind.spatial import Array, address


@dataclass(frozen=True)
class SurfaceTable:
    """Surfaces of c by s vortex rings, one a body.

    Attributes:
        corner: of the rings [m], in the frames of the bodies from their centres of mass, along the chord from
            the leading edge, then along the span, shape (n, c + 1, s + 1, 3).
        control: points that no fluid passes, likewise, shape (n, c, s, 3).
        density: of the fluid [kg/m³].
        step: between two rows of the wake [s].
        core: radius of the wakes' cores [m].
        rows: of the wakes that are kept.
        wind: that all surfaces are in.
        suction: share of the pull along the chord, at the leading edges, that is there.
    """

    corner: Array
    control: Array
    density: float
    step: float
    core: float
    rows: int
    wind: WindTable
    suction: float = 1.0

    @property
    def shape(self) -> tuple[int, int, int]:
        """Surfaces, rings along the chord and along the span."""
        n, chordwise, spanwise, _ = self.control.shape
        return n, chordwise, spanwise


_NUMBERS = ("surfaces", "chordwise", "spanwise", "capacity", "instructions")
_REMEMBERED = ("strength", "steady", "wake", "wake_rings")
_TRIAL = ("trial_twist", "trial_strength", "trial_steady", "by_twist", "steady_by_twist")
_ROOM = (
    "placed",
    "normal",
    "edge",
    "filaments",
    "points",
    "influence",
    "matrix",
    "pivots",
    "change",
    "gained",
    "pressed",
    "row",
)


class _Vortex(ctypes.Structure):
    """``lw_vortex``."""

    _fields_ = [
        *((name, ctypes.c_int32) for name in _NUMBERS),
        *((name, ctypes.c_double) for name in ("density", "step", "core", "suction")),
        ("wind", WindStruct),
        *((name, ctypes.c_void_p) for name in ("corner", "control", "threads")),
        ("started", ctypes.c_int32),
        ("rows", ctypes.c_int32),
        *((name, ctypes.c_void_p) for name in (*_REMEMBERED, *_TRIAL, *_ROOM)),
    ]


class VortexLattice:
    """Surfaces, the strengths of their rings, and their wakes.

    Attributes:
        table: as given.
        wrench: on each body [N, N·m], shape (n, 6), in W at its centre of mass, after ``evaluate``.
        response: minus its derivative by the twists, shape (6n, 6n), after ``evaluate``.
    """

    def __init__(self, table: SurfaceTable, threads: int = 1) -> None:
        """Make room.

        Args:
            table: the surfaces.
            threads: that share the work; no bit depends on it.

        Raises:
            LinkwindError: the threads cannot be started.
        """
        self.table = table
        n, c, s = table.shape
        self.wrench, self.response = np.zeros((n, 6)), np.zeros((6 * n, 6 * n))
        self._pose, self._twist = np.zeros((n, 7)), np.zeros((n, 6))
        self._struct = _Vortex(n, c, s, table.rows, 0, table.density, table.step, table.core)
        self._struct.suction = table.suction
        self._self = ctypes.addressof(self._struct)
        declare("lw_vortex_init", [ctypes.c_void_p], None)(self._self)
        self._struct.wind = WindStruct.of(table.wind)
        self._struct.threads = team(self, threads) if threads > 1 else None
        filaments, points, targets = (
            declare(f"lw_vortex_{name}", [ctypes.c_void_p], ctypes.c_int32)(self._self)
            for name in ("filaments", "points", "targets")
        )
        self._arrays = {
            "corner": np.ascontiguousarray(table.corner, np.float64),
            "control": np.ascontiguousarray(table.control, np.float64),
            "strength": np.zeros((n, c, s)),
            "steady": np.zeros((n, 6)),
            "wake": np.zeros((table.rows, n, s + 1, 3)),
            "wake_rings": np.zeros((table.rows, n, s)),
            "trial_twist": np.zeros((n, 6)),
            "trial_strength": np.zeros((n, c, s)),
            "trial_steady": np.zeros((n, 6)),
            "by_twist": np.zeros((6 * n, n * c * s)),
            "steady_by_twist": np.zeros((6 * n, 6 * n)),
            "placed": np.zeros((n, c + 1, s + 1, 3)),
            "normal": np.zeros((n, c, s, 3)),
            "edge": np.zeros((n, s + 1, 3)),
            "filaments": np.zeros((filaments, 8)),
            "points": np.zeros((6, points)),
            "influence": np.zeros((n * c * s, 3, targets)),
            "matrix": np.zeros((n * c * s,) * 2),
            "pivots": np.zeros(n * c * s),
            "change": np.zeros((3, targets)),
            "gained": np.zeros((n, c, s)),
            "pressed": np.zeros((n, 6)),
            "row": np.zeros((n, 6)),
        }
        for name, array in self._arrays.items():
            setattr(self._struct, name, address(array))
        pointer, number = ctypes.c_void_p, ctypes.c_double
        self._evaluate = declare("lw_vortex_evaluate", [pointer, number, *[pointer] * 4])
        self._commit = declare("lw_vortex_commit", [pointer, number, pointer, pointer])
        self._at = address(self._pose), address(self._twist)
        self._out = address(self.wrench), address(self.response)

    def evaluate(self, t: float, pose: Array, twist: Array) -> bool:
        """Compute ``wrench`` and ``response`` for the trial state at the end of a step.

        Args:
            t: time [s].
            pose: position [m] and unit quaternion of each body, shape (n, 7), in W.
            twist: [m/s, rad/s], shape (n, 6), in W.

        Returns:
            Whether there are strengths that let nothing through.
        """
        self._pose[:], self._twist[:] = pose, twist
        return not self._evaluate(self._self, t, *self._at, *self._out)

    def commit(self, t: float, pose: Array, twist: Array) -> Array | None:
        """Take the state that was accepted at the time [s] evaluated last; shed a row of the wakes.

        Returns:
            A corner of the wakes [m] where the wind is not finite, shape (3,), if there is one.
        """
        self._pose[:], self._twist[:] = pose, twist
        fault: int = self._commit(self._self, t, *self._at)
        return self._arrays["wake"].reshape(-1, 3)[fault - 1] if fault else None

    def velocity(self, t: float, point: Array) -> Array:
        """Return the velocity of the fluid [m/s] at points [m], shape (m, 3), after an evaluation."""
        points, found = np.ascontiguousarray(point, np.float64), np.zeros((len(point), 3))
        arguments = [ctypes.c_void_p, ctypes.c_double, ctypes.c_int32, ctypes.c_void_p, ctypes.c_void_p]
        function = declare("lw_vortex_velocity", arguments, None)
        function(self._self, t, len(points), address(points), address(found))
        return found

    @property
    def rows(self) -> int:
        """Rows of rings in each wake; 0 before the first commit."""
        return int(self._struct.rows)

    @property
    def strength(self) -> Array:
        """Strengths of the surfaces' rings as committed [m²/s], shape (n, c, s)."""
        return self._arrays["strength"]

    @property
    def trial_strength(self) -> Array:
        """Strengths of the surfaces' rings as evaluated last [m²/s], shape (n, c, s)."""
        return self._arrays["trial_strength"]

    @property
    def surface(self) -> Array:
        """Corners of the surfaces' rings where they were last [m], shape (n, c + 1, s + 1, 3), in W."""
        return self._arrays["placed"]

    @property
    def targets(self) -> Array:
        """Where fluid passes no wing and where forces act, as evaluated last [m], shape (any, 3), in W."""
        n, c, s = self.table.shape
        return self._arrays["points"][:3, : n * c * (3 * s + 1)].T

    @property
    def wake(self) -> tuple[Array, Array]:
        """Corners of the wakes behind the edges [m], (rows, n, s + 1, 3), and strengths, (rows, n, s)."""
        return self._arrays["wake"][: self.rows], self._arrays["wake_rings"][: self.rows]

    def save(self) -> bytes:
        """Return everything that was committed; empty before that."""
        if not self._struct.started:
            return b""
        parts = (self._arrays["strength"], self._arrays["steady"], *self.wake)
        return b"".join(np.ascontiguousarray(part, "<f8").tobytes() for part in parts)

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned.

        Raises:
            ValueError: it is not of these surfaces.
        """
        n, c, s = self.table.shape
        fixed, row = n * c * s + 6 * n, n * (s + 1) * 3 + n * s
        rows, rest = divmod(len(blob) // 8 - fixed, row) if blob else (0, 0)
        if len(blob) % 8 or rest or not 0 <= rows <= self.table.rows:
            most = 8 * (fixed + row * self.table.rows)
            raise ValueError(f"{8 * fixed} bytes and {8 * row} for each row, up to {most}; got {len(blob)}")
        self._struct.started, self._struct.rows = bool(blob), rows
        numbers = np.frombuffer(blob, "<f8")
        at = 0
        parts = (self._arrays["strength"], self._arrays["steady"], *self.wake)
        for part in parts if blob else ():
            part[:] = numbers[at : at + part.size].reshape(part.shape)
            at += part.size
