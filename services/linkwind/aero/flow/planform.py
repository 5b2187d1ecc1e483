"""Markers on a flat wing of any planform: a row along its edge, drawn in, and a grid inside that.

Where a part is so narrow that nothing is left of it, a single row joins what it connects; a tip just ends.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from linkwind.aero.flow.nearness import Truths, from_line, inside
from linkwind.aero.flow.outline import SPACING, even
from linkwind.aero.flow.rings import CLOSEST
from linkwind.native.boundary import Indices
from linkwind.spatial import Array

FROM_RIM = 0.85 * SPACING  # cells, at least, from the drawn-in edge to the grid in it
FINE = 0.125  # cells from point to point of an edge that is drawn in
CROSSED = 0.01  # cells nearer to another part of the edge than that is drawn in: a point beyond a corner
SHARP = float(np.cos(np.radians(30.0)))  # of the turn at corners that have a marker of their own
FAR = 2.0 * SPACING  # cells between markers: more is no patch

Covered = Callable[[Array], Truths]


def wing(corners: Array, free: float, covered: Covered) -> tuple[Array, Indices]:
    """Return markers, shape (k, 3), and patches between them, shape (m, 4).

    Args:
        corners: (x, z) of the planform [cells], from x towards z, shape (n, 2).
        free: by how much a free edge is drawn in [cells].
        covered: which points of an edge, shape (k, 3), are not free.
    """
    edge, inwards = _edge(corners)
    by = np.where(covered(np.insert(edge, 1, 0.0, axis=1)), 0.5 * SPACING, free)
    room = max(_deepest(corners) - 0.5 * SPACING, 0.0)  # two rows are left where the wing is widest
    rim, sharp = _drawn_in(edge, inwards, np.minimum(by, room))
    row = _apart(_along(rim, sharp))
    row = row[inside(corners, row) | (from_line(corners, row) < CROSSED)]
    grid = _grid(rim)
    places = grid.reshape(-1, 2)
    kept = inside(rim, places) & (from_line(rim, places) >= FROM_RIM)
    number = np.where(kept, len(row) + np.cumsum(kept) - 1, -1).reshape(grid.shape[:2])
    points = np.concatenate([row, places[kept]])
    patches = np.concatenate([_quads(number), _beside(row, places[kept])])
    return np.insert(_filled(rim, points), 1, 0.0, axis=1), patches.astype(np.int32)


def _edge(corners: Array) -> tuple[Array, Array]:
    """Return points along an edge and unit vectors inwards, each shape (k, 2); at a notch a fan of them."""
    points, vectors = [], []
    following = np.roll(corners, -1, axis=0)
    along = (following - corners) / np.hypot(*(following - corners).T)[:, None]
    inwards = np.column_stack([-along[:, 1], along[:, 0]])
    for k, (a, b) in enumerate(zip(corners, following, strict=True)):
        before, own = inwards[k - 1], inwards[k]
        if before[0] * own[1] < before[1] * own[0]:  # a notch
            share = np.linspace(0.0, 1.0, 16)[:, None]
            fan = (1.0 - share) * before + share * own
            points.append(np.tile(a, (16, 1)))
            vectors.append(fan / np.maximum(np.hypot(*fan.T), 1e-9)[:, None])
        count = max(1, int(np.ceil(np.hypot(*(b - a)) / FINE)))
        points.append(a + (b - a) * ((np.arange(count) + 0.5) / count)[:, None])
        vectors.append(np.tile(own, (count, 1)))
    return np.concatenate(points), np.concatenate(vectors)


def _deepest(corners: Array) -> float:
    """Return about the radius of the largest circle in a planform [cells]."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, z = np.linspace(low, high, 65).T
    places = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    return float(from_line(corners, places[inside(corners, places)]).max(initial=0.0))


def _drawn_in(edge: Array, inwards: Array, by: Array) -> tuple[Array, Truths]:
    """Return the edge drawn in, with the corners where its sides meet, and which of its points are corners.

    Args:
        edge: points, shape (k, 2).
        inwards: unit vectors there, shape (k, 2).
        by: how far each is drawn in [cells], shape (k,).
    """
    moved = edge + by[:, None] * inwards
    clear = [bool((np.hypot(*(edge - point).T) > by - CROSSED).all()) for point in moved]
    stays = np.array(clear) & (inside(edge, moved) | (by < CROSSED))
    points, along = moved[stays], np.column_stack([inwards[stays, 1], -inwards[stays, 0]])
    line: list[Array] = []
    sharp: list[bool] = []
    for k in range(len(points)):
        following = (k + 1) % len(points)
        line.append(points[k])
        sharp.append(False)
        corner = _corner(points[k], along[k], points[following], along[following])
        if corner is not None:
            line.append(corner)
            sharp.append(float((along[k] * along[following]).sum()) < SHARP)
    return np.array(line), np.array(sharp)


def _corner(a: Array, along_a: Array, b: Array, along_b: Array) -> Array | None:
    """Return where two lines meet, if they turn there, close to both points."""
    turn = float(along_a[0] * along_b[1] - along_a[1] * along_b[0])
    if turn < 1e-6:
        return None
    off = b - a
    corner: Array = a + along_a * float(off[0] * along_b[1] - off[1] * along_b[0]) / turn
    near = max(np.hypot(*(corner - a)), np.hypot(*(corner - b))) < 4.0 * FINE
    return corner if near else None


def _along(line: Array, sharp: Truths) -> Array:
    """Return markers on a closed line, one at each sharp corner, evenly between them, shape (k, 2)."""
    if not sharp.any():
        return even(line, SPACING)
    first = int(np.argmax(sharp))
    line, sharp = np.roll(line, -first, axis=0), np.roll(sharp, -first)
    line = np.vstack([line, line[:1]])
    markers = []
    for a, b in pairwise([*np.flatnonzero(sharp).tolist(), len(line) - 1]):
        piece = line[a : b + 1]
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(piece, axis=0).T))])
        count = max(1, round(float(length[-1]) / SPACING))
        at = length[-1] * np.arange(count) / count
        markers.append(np.column_stack([np.interp(at, length, values) for values in piece.T]))
    return np.concatenate(markers)


def _apart(markers: Array) -> Array:
    """Return those that are not too close to earlier ones."""
    kept = markers[:1]
    for marker in markers[1:]:
        if np.hypot(*(kept - marker).T).min() >= CLOSEST:
            kept = np.vstack([kept, marker])
    return kept


def _grid(rim: Array) -> Array:
    """Return the grid that would fill the box around a rim, without its border, shape (rows, columns, 2)."""
    lines = []
    for values in rim.T:
        parts = max(1, round(float(np.ptp(values)) / SPACING))
        lines.append(np.linspace(values.min(), values.max(), parts + 1)[1:-1])
    return np.stack(np.meshgrid(*lines), axis=-1)


def _filled(rim: Array, markers: Array) -> Array:
    """Return the markers and others in the holes between grid and rim, the largest hole first."""
    low, high = rim.min(axis=0), rim.max(axis=0)
    x, z = (np.arange(a, b, 2.0 * FINE) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    places = places[inside(rim, places)]
    hole = np.full(len(places), np.inf)
    for marker in markers:
        hole = np.minimum(hole, np.hypot(*(places - marker).T))
    while len(places) and hole.max() >= FROM_RIM:
        marker = places[int(np.argmax(hole))]
        markers = np.vstack([markers, marker])
        hole = np.minimum(hole, np.hypot(*(places - marker).T))
    return markers


def _quads(number: Indices) -> Indices:
    """Return the patches between four markers of a grid each, shape (m, 4); -1 where there is no marker."""
    corners = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    patches = np.stack(corners, axis=-1).reshape(-1, 4)
    return patches[(patches >= 0).all(axis=1)]


def _beside(row: Array, grid: Array) -> Indices:
    """Return the triangles from pieces of the row to the nearest marker of the grid, shape (m, 4)."""
    found = []
    for k in range(len(row) if len(grid) else 0):
        a, b = row[k], row[(k + 1) % len(row)]
        off = np.hypot(*(grid - 0.5 * (a + b)).T)
        tip = int(np.argmin(off))
        if max(float(np.hypot(*(b - a))), float(off[tip])) < FAR:
            found.append((k, (k + 1) % len(row), len(row) + tip, len(row) + tip))
    return np.array(found, np.int32).reshape(-1, 4)
