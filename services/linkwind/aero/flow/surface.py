"""The markers that stand for the bodies in the fluid in space: where they lie on the surfaces.

As in the plane (``outline``) a marker makes a surface act as if it were thicker, so surfaces and the free
edges of plates and wings are drawn in. What of an edge lies on another body, with which a joint connects, is
not free: it is drawn in by half the distance of two markers, so that no gap is left in which the fluid leaks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.aero.flow.nearness import Truths, distance, from_line, inside
from linkwind.aero.flow.outline import (
    AT_END,
    SPACING,
    around,
    inset,
    joined,
)
from linkwind.aero.flow.planform import Covered, wing
from linkwind.aero.flow.rings import ellipsoid
from linkwind.native.boundary import Indices
from linkwind.native.boundary3 import Markers3
from linkwind.scenario.bodies import Body, Joint
from linkwind.scenario.shapes import Ellipsoid, Plate, Wing
from linkwind.spatial import Array, rotations, turned

# Cells by which free edges of plates and closed surfaces are drawn in, see `inset`. Calibrated on a square
# plate and on a sphere: their added masses without viscosity; with some G. G. Stokes' force on a sphere that
# oscillates, for 1e-3 to 0.1 cells² a step, and the drag of a plate across a stream at Re 100, which is the
# same with 8 to 28 cells along its chord.
EDGE_INSET = (0.85, 0.05, 0.38, 2.4)
CLOSED_INSET = (0.5, 0.2, 0.2, 1.13)
FROM_RIM = 0.85 * SPACING  # cells, at least, from the rim of a flat end to the grid in it

_Surface = tuple[Array, Indices]  # markers in the body frame [cells], (k, 3), and the patches, (m, 4)


def surface_markers(
    bodies: list[Body], joints: list[Joint], start: Array, cell: float, viscosity: float
) -> Markers3:
    """Return the markers of bodies with shapes.

    Args:
        bodies: of the flow.
        joints: all of the scenario.
        start: poses of the bodies at the start, position [m] and unit quaternion (w, x, y, z), body to world,
            shape (n, 7).
        cell: side of a cell [m].
        viscosity: of the fluid [cells²/step].
    """
    may_touch = joined(bodies, joints)
    points, faces, first = [], [], 0
    for index, body in enumerate(bodies):
        beside = np.flatnonzero(may_touch[index])
        covered = _covered(start[index], [bodies[k] for k in beside], start[beside], cell)
        point, face = _surface(body, cell, viscosity, covered)
        points.append(point)
        faces.append(face + first)
        first += len(point)
    body_of = np.repeat(np.arange(len(bodies), dtype=np.int32), [len(point) for point in points])
    return Markers3(body_of, np.concatenate(points), np.concatenate(faces).astype(np.int32), may_touch)


def _covered(pose: Array, others: list[Body], poses: Array, cell: float) -> Covered:
    """Return what tells which points of a body's frame [cells], shape (k, 3), lie on other bodies."""

    def covered(points: Array) -> Truths:
        world, found = pose[:3] + turned(_axes(pose), cell * points), np.zeros(len(points), bool)
        for other, at in zip(others, poses, strict=True):
            assert other.shape is not None
            found |= distance(other.shape, turned(_axes(at).T, world - at[:3])) <= AT_END * cell
        return found

    return covered


def _axes(pose: Array) -> Array:
    axes: Array = rotations(pose[None, 3:])[0]
    return axes


def _surface(body: Body, cell: float, viscosity: float, covered: Covered) -> _Surface:
    shape, closed = body.shape, inset(CLOSED_INSET, viscosity)
    assert shape is not None  # the scenario has been checked
    if isinstance(shape, Plate):
        half = 0.5 * np.array([shape.length, shape.span]) / cell
        return _plate(half, inset(EDGE_INSET, viscosity), covered)
    if isinstance(shape, Wing):
        return wing(shape.planform / cell, inset(EDGE_INSET, viscosity), covered)
    if isinstance(shape, Ellipsoid):
        return ellipsoid(0.5 * np.array(shape.size) / cell, closed)
    return _cylinder(around(shape, cell, viscosity), 0.5 * shape.span / cell, closed)


# ---- plates ----


def _plate(half: Array, free: float, covered: Covered) -> _Surface:
    """Return a grid along x and z, each line of which ends where the edge is drawn in to.

    Args:
        half: of chord and span [cells], shape (2,).
        free: by how much a free edge is drawn in [cells].
        covered: which points of an edge are not free.
    """

    def reach(axis: int, side: float, at: Array) -> Array:
        """How far lines along an axis go, which come to the edge at places along it."""
        edge = np.zeros((len(at), 3))
        edge[:, 2 * axis], edge[:, 2 - 2 * axis] = side * half[axis], at
        drawn = half[axis] - np.where(covered(edge), 0.5 * SPACING, free)
        reached: Array = np.maximum(drawn, min(half[axis], 0.5 * SPACING))
        return reached

    usual = np.empty((2, 2))  # for each axis, towards both sides
    for axis, side in np.ndindex(2, 2):
        fine = np.linspace(-1.0, 1.0, 2 + round(8.0 * half[1 - axis])) * half[1 - axis]
        usual[axis, side] = reach(axis, 2.0 * side - 1.0, fine).mean()
    count = [max(2, 1 + round(float(length) / SPACING)) for length in usual.sum(axis=1)]
    lines = []
    for axis in (0, 1):
        across = np.linspace(-usual[1 - axis, 0], usual[1 - axis, 1], count[1 - axis])
        low, high = (reach(axis, side, across)[:, None] for side in (-1.0, 1.0))
        lines.append((low + high) * np.linspace(0.0, 1.0, count[axis]) - low)
    x, z = lines[0], lines[1].T
    points = np.stack([x, np.zeros(x.shape), z], axis=-1).reshape(-1, 3)
    return points, _quads(np.arange(x.size).reshape(x.shape))


def _quads(number: NDArray[Any]) -> Indices:
    """Return the patches between rows of numbered markers, shape (m, 4)."""
    corners = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return np.stack(corners, axis=-1).reshape(-1, 4).astype(np.int32)


# ---- cylinders ----


def _cylinder(rim: Array, half: float, by: float) -> _Surface:
    """Return rows of a rim, shape (k, 2), along z, and a grid in each of the flat ends.

    Args:
        rim: the markers on the outline [cells].
        half: of the span [cells].
        by: how far the ends are drawn in [cells].
    """
    reach = max(half - by, min(half, 0.5 * SPACING))
    levels = np.linspace(-reach, reach, max(2, 1 + round(2.0 * reach / SPACING)))
    rows = np.concatenate([np.column_stack([rim, np.full(len(rim), z)]) for z in levels])
    end = _within(rim)
    low, high = (np.column_stack([end, np.full(len(end), z)]) for z in (-reach, reach))
    number = len(end) + np.arange(len(rows)).reshape(len(levels), len(rim))
    return np.concatenate([low, rows, high]), _quads(np.column_stack([number, number[:, 0]]))


def _within(rim: Array) -> Array:
    """Return a grid of points inside an outline and away from it, shape (k, 2)."""
    low, high = rim.min(axis=0), rim.max(axis=0)
    count = np.maximum(1, np.floor((high - low) / SPACING).astype(int))
    x, y = (
        middle + SPACING * (np.arange(n) - 0.5 * (n - 1))
        for middle, n in zip(0.5 * (low + high), count, strict=True)
    )
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return grid[inside(rim, grid) & (from_line(rim, grid) >= FROM_RIM)]
