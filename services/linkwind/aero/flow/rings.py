"""Markers on an ellipsoid that is drawn in along its normals: rings, as far apart as the markers on them."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from linkwind.aero.flow.nearness import Truths
from linkwind.aero.flow.outline import SPACING, even
from linkwind.native.boundary import Indices
from linkwind.spatial import Array

FINE = 720  # points of a curve on which markers are put
CLOSEST = 0.85  # cells between two markers, at least


def ellipsoid(half: Array, by: float) -> tuple[Array, Indices]:
    """Return markers, shape (k, 3), and triangles between them, shape (m, 4), the last corner twice.

    The rings lie about that axis of which two meridians are most nearly as long.

    Args:
        half: of the size along each axis [cells], shape (3,).
        by: how far the surface is drawn in [cells].
    """
    axis = int(np.argmin([_uneven(np.roll(half, -axis)) for axis in range(3)]))
    rings = _rings(np.roll(half, -axis), by)
    first = np.cumsum([0, *map(len, rings)])
    faces = [
        _triangles(one, other, k, m)
        for (one, other), (k, m) in zip(pairwise(rings), pairwise(first.tolist()), strict=False)
    ]
    return np.roll(np.concatenate(rings), axis, axis=1), np.concatenate(faces)


def _uneven(half: Array) -> float:
    """Return how much longer one of the two meridians in planes of axes is than the other, at least 1."""
    angle = np.linspace(0.0, np.pi, FINE)
    one, other = (float(_steps(_surface(half, angle, turn, 0.0)[0]).sum()) for turn in (0.0, 0.5 * np.pi))
    return round(max(one / other, other / one), 9)  # the first axis of those alike


def _rings(half: Array, by: float) -> list[Array]:
    """Return the rings about the first axis from pole to pole, where one may have a single marker."""
    angle = np.linspace(0.0, np.pi, 4 * FINE + 1)
    meridians, whole = zip(*(_surface(half, angle, turn, by) for turn in (0.0, 0.5 * np.pi)), strict=True)
    kept = whole[0] & whole[1]
    along = np.concatenate([[0.0], np.cumsum(sum(_steps(line[kept]) for line in meridians) / 2.0)])
    count = max(2, round(float(along[-1]) / SPACING))
    turn = 2.0 * np.pi * np.arange(FINE) / FINE
    rings: list[Array] = []
    for ring in np.interp(along[-1] * np.arange(count + 1) / count, along, angle[kept]):
        points, stayed = _surface(half, ring, turn, by)
        if stayed.any():
            markers = even(points[stayed], SPACING, least=1)
            markers = markers if len(markers) > 1 else points[stayed].mean(axis=0)[None]
            kept_markers = _clear_of(rings, markers)
            rings += [kept_markers] if len(kept_markers) else []
    return rings


def _clear_of(rings: list[Array], markers: Array) -> Array:
    """Return those of the markers that are not too close to others: at a tip or a rim rings are."""
    known = np.concatenate([*rings[-3:], np.empty((0, 3))])
    first = len(known)
    for marker in markers:
        if not len(known) or np.linalg.norm(known - marker, axis=1).min() >= CLOSEST:
            known = np.vstack([known, marker])
    return known[first:]


def _surface(half: Array, angle: Array | float, turn: Array | float, by: float) -> tuple[Array, Truths]:
    """Return points of the surface drawn in, shape (k, 3), and which have not crossed to another side."""
    along, away = np.cos(angle), np.sin(angle)
    unit = np.column_stack(np.broadcast_arrays(along, away * np.cos(turn), away * np.sin(turn)))
    points, normal = half * unit, unit / half
    drawn = points - by * normal / np.linalg.norm(normal, axis=1)[:, None]
    stayed: Truths = (drawn * points >= -1e-9).all(axis=1)
    return drawn, stayed


def _steps(line: Array) -> Array:
    steps: Array = np.linalg.norm(np.diff(line, axis=0), axis=1)
    return steps


def _triangles(one: Array, other: Array, first: int, second: int) -> Indices:
    """Return those between two rings, whose markers are numbered from `first` and `second` on."""
    found = []
    for ring, start, beside, beside_start in ((one, first, other, second), (other, second, one, first)):
        for k in range(len(ring) if len(ring) > 2 else len(ring) - 1):
            following = (k + 1) % len(ring)
            middle = 0.5 * (ring[k] + ring[following])
            tip = beside_start + int(np.argmin(np.linalg.norm(beside - middle, axis=1)))
            found.append((start + k, start + following, tip, tip))
    return np.array(found, np.int32).reshape(-1, 4)
