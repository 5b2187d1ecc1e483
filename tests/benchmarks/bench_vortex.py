"""Vortex rings and wakes: velocities against numpy, and a step of three wings with long wakes."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

from linkwind.native.vortex import SurfaceTable, VortexLattice
from linkwind.native.wind import WindTable
from linkwind.spatial import Array

WINGS, CHORDWISE, SPANWISE, ROWS = 3, 6, 12, 100
STEP = 0.05
TARGET = 0.1
ROUNDS = 5


def _wings() -> VortexLattice:
    """Three plates of 1 by 3, one above the other, that have gone a whole wake's length."""
    corner = np.zeros((WINGS, CHORDWISE + 1, SPANWISE + 1, 3))
    corner[..., 0] = (np.arange(CHORDWISE + 1) / CHORDWISE)[:, None]
    corner[..., 2] = 3.0 * np.arange(SPANWISE + 1) / SPANWISE
    control = 0.5 * (corner[:, :-1, :-1] + corner[:, 1:, 1:])
    calm = WindTable(np.zeros(3), np.zeros((0, 9)))
    lattice = VortexLattice(SurfaceTable(corner, control, 1.2, STEP, 0.05, ROWS, calm))
    for k in range(ROWS + 1):
        _step(lattice, k)
    return lattice


def _step(lattice: VortexLattice, k: int) -> None:
    pose, twist = np.zeros((WINGS, 7)), np.zeros((WINGS, 6))
    pose[:, 0], pose[:, 1] = -3.0 * STEP * k, np.arange(WINGS)
    pose[:, 3:] = np.cos(0.05), 0.0, 0.0, -np.sin(0.05)
    twist[:, 0] = -3.0
    lattice.evaluate(k * STEP, pose, twist)
    lattice.commit(k * STEP, pose, twist)


def _numpy(begin: Array, end: Array, strength: Array, points: Array) -> Array:
    """The same law, some points at a time so that the arrays stay in the cache."""
    found = np.empty_like(points)
    smooth = 0.05**2 * ((end - begin) ** 2).sum(axis=1)
    for i in range(0, len(points), 4):
        a, b = (points[i : i + 4, None] - ends for ends in (begin, end))
        x, y = np.sqrt((a * a).sum(axis=2)), np.sqrt((b * b).sum(axis=2))
        below = x * y * (x * y + (a * b).sum(axis=2)) + smooth
        scale = strength / (4.0 * np.pi) * (x + y) / below
        found[i : i + 4] = (scale[:, :, None] * np.cross(a, b)).sum(axis=1)
    return found


def _took(job: Callable[[], object]) -> float:
    times = []
    for _ in range(ROUNDS):
        start = time.perf_counter()
        job()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def main() -> list[dict[str, object]]:
    """Run both."""
    lattice = _wings()
    points = np.random.default_rng(0).normal(size=(2000, 3)) * [20.0, 3.0, 3.0]
    across, along = SPANWISE * (ROWS + CHORDWISE + 2), (SPANWISE + 1) * (ROWS + CHORDWISE)
    filaments = WINGS * (across + along)
    begin = np.random.default_rng(1).normal(size=(filaments, 3))
    end, strength = begin + 0.1, np.ones(filaments)
    own = _took(lambda: lattice.velocity(0.0, points)) / (filaments * len(points))
    theirs = _took(lambda: _numpy(begin, end, strength, points[:40])) / (filaments * 40)
    beats = iter(range(ROWS + 1, ROWS + 1 + ROUNDS))
    whole = _took(lambda: _step(lattice, next(beats)))
    return [
        {
            "case": f"velocity by {filaments} filaments at a point",
            "quantity": "ns a filament, against numpy",
            "value": 1e9 * own, "reference": 1e9 * theirs,
            "ratio": own / theirs, "ok": own / theirs <= TARGET,
        },
        {
            "case": f"step of {WINGS} wings of {CHORDWISE} × {SPANWISE} rings, wakes of {ROWS} rows",
            "quantity": "ms", "value": 1e3 * whole, "reference": None, "ratio": None, "ok": None,
        },
    ]  # fmt: skip
