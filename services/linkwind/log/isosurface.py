"""The surface on which a field on a grid has a given value, as triangles.

Naive surface nets: a vertex in every cube of eight neighbouring grid points between which the field passes
the level, at the mean of the points where it does so along the cube's edges; a quadrilateral of the four
cubes around every edge along which it does. The triangles are as few as by marching cubes and of a better
shape, and it takes half a page of numpy. Where the field passes the level on the faces of the grid, the
surface is open.

Source: S. F. F. Gibson, Constrained Elastic Surface Nets, MICCAI 1998, doi:10.1007/BFb0056277, without the
relaxation.
"""

from __future__ import annotations

import math
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.frames import Single

Indices = NDArray[np.int64]


class Surface(NamedTuple):
    """A surface of triangles.

    Attributes:
        point: of the vertices, in cells from the first grid point along z, y, x, shape (n, 3).
        triangle: vertices of each, shape (m, 3), counterclockwise in x, y, z as seen from where the field is
            below the level.
    """

    point: Single
    triangle: Indices


def isosurface(values: Single, level: float) -> Surface:
    """Return the surface on which a field has the value ``level``.

    Args:
        values: of the field, shape (layers, rows, columns), each two or more; what is not finite is below.
        level: of the surface.
    """
    above = np.nan_to_num(values - np.float32(level), nan=-1.0, posinf=1.0, neginf=-1.0)
    inside = above > 0.0
    total, count = _crossings(above, inside)
    cubes = np.flatnonzero(count)
    number = np.full(count.shape, -1, np.int64)
    number.ravel()[cubes] = np.arange(len(cubes))
    point = total.reshape(-1, 3)[cubes] / count.ravel()[cubes, None]
    point += np.stack(np.unravel_index(cubes, count.shape), axis=1)
    triangles = [_around(inside, number, axis) for axis in range(3)]
    return Surface(point.astype(np.float32), np.concatenate(triangles))


def simplified(surface: Surface, most: int) -> Surface:
    """Return a surface with about ``most`` triangles at most: vertices within a larger cell become one.

    Source: J. Rossignac, P. Borrel, Multi-resolution 3D approximations for rendering complex scenes, 1993.
    """
    coarse, side = surface, 1.0
    while len(coarse.triangle) > most:
        side *= max(1.1, math.sqrt(len(coarse.triangle) / most))
        coarse = _clustered(surface, side)
    return coarse


def _clustered(surface: Surface, side: float) -> Surface:
    cell = np.floor(surface.point / side).astype(np.int64)
    _, number, count = np.unique(cell, axis=0, return_inverse=True, return_counts=True)
    number = number.ravel()
    point = np.stack([np.bincount(number, axis) for axis in surface.point.T], axis=1) / count[:, None]
    triangle = number[surface.triangle]
    a, b, c = triangle.T
    triangle = triangle[(a != b) & (b != c) & (c != a)]
    return Surface(point.astype(np.float32), np.unique(triangle, axis=0))


def between(values: Single, point: Single) -> Single:
    """Return a field between its grid points, by trilinear interpolation.

    Args:
        values: of the field, shape (layers, rows, columns, …).
        point: where, in cells from the first grid point along z, y, x, shape (n, 3).

    Returns:
        values there, shape (n, …).
    """
    low = np.clip(np.floor(point).astype(np.int64), 0, np.array(values.shape[:3]) - 2)
    share = point - low
    found = np.zeros((len(point), *values.shape[3:]), np.float32)
    for corner in product((0, 1), repeat=3):
        weight = np.where(corner, share, 1.0 - share).prod(axis=1)
        found += weight.reshape(-1, *[1] * (values.ndim - 3)) * values[tuple((low + corner).T)]
    return found


def _crossings(above: Single, inside: Any) -> tuple[Single, Any]:
    """Return the sum of the points on each cube's edges where the level is passed, and how many they are.

    Points are counted from the cube's first corner; cubes are one less than grid points along each axis.
    """
    size = tuple(n - 1 for n in above.shape)
    total, count = np.zeros((*size, 3), np.float32), np.zeros(size, np.int8)
    for axis in range(3):
        low, high = _pair(above, axis)
        crossed = np.not_equal(*_pair(inside, axis))
        share = np.divide(low, low - high, out=np.zeros_like(low), where=crossed)
        across = [a for a in range(3) if a != axis]
        for shift in product((0, 1), repeat=2):
            part: list[slice] = [slice(None)] * 3
            for a, by in zip(across, shift, strict=True):
                part[a] = slice(by, by + size[a])
            here = crossed[tuple(part)]
            count += here
            total[..., axis] += share[tuple(part)]
            for a, by in zip(across, shift, strict=True):
                if by:
                    total[..., a] += here
    return total, count


def _pair(values: Any, axis: int) -> tuple[Any, Any]:
    """Return the values at the low and at the high ends of the edges along an axis."""
    n = values.shape[axis]
    return tuple(np.take(values, range(i, n - 1 + i), axis=axis) for i in (0, 1))  # type: ignore[return-value]


def _around(inside: Any, number: Indices, axis: int) -> Indices:
    """Return two triangles of the four cubes around each edge along an axis where the level is passed."""
    low, high = _pair(inside, axis)
    inner: list[slice] = [slice(1, -1)] * 3  # an edge on a face of the grid has no four cubes around it
    inner[axis] = slice(None)
    place = np.nonzero((low != high)[tuple(inner)])
    falls = low[tuple(inner)][place]
    one, other = (axis + 1) % 3, (axis + 2) % 3
    corners = []
    for by in ((0, 0), (1, 0), (1, 1), (0, 1)):  # around the edge, counterclockwise as z, y, x are counted
        at = list(place)
        at[one], at[other] = at[one] + by[0], at[other] + by[1]
        corners.append(number[tuple(at)])
    a, b, c, d = corners
    b, d = np.where(falls, d, b), np.where(falls, b, d)
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
