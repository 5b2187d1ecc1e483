"""Surfaces of bodies as points and cells around them, in the body frame, for programs that show meshes."""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from linkwind.scenario.ears import triangles
from linkwind.scenario.shapes import ROUND, AnyShape, Ellipsoid, Plate, Polygon, Wing
from linkwind.spatial import Array


class Surface(NamedTuple):
    """Points [m], shape (k, 3), and the numbers of those around each cell, as seen from outside."""

    point: Array
    cells: list[list[int]]


def surface(shape: AnyShape) -> Surface:
    """Return the whole surface of a shape, in convex cells: of a plate and of a wing a sheet, else closed."""
    if isinstance(shape, Plate):
        x, z = 0.5 * shape.length, 0.5 * shape.span
        return Surface(np.array([[-x, 0, -z], [x, 0, -z], [x, 0, z], [-x, 0, z]]), [[0, 1, 2, 3]])
    if isinstance(shape, Wing):
        return Surface(np.insert(shape.planform, 1, 0.0, axis=1), [*map(list, triangles(shape.planform))])
    if isinstance(shape, Ellipsoid):
        return _ellipsoid(0.5 * np.array(shape.size))
    outline = shape.outline()
    whole = [list(range(len(outline)))]
    end = [*map(list, triangles(outline))] if isinstance(shape, Polygon) else whole
    return _prism(outline, 0.5 * shape.span, end)


def _prism(outline: Array, half: float, end: list[list[int]]) -> Surface:
    """Return two ends, of cells of the outline's points, and the sides between them."""
    n = len(outline)
    low, high = [cell[::-1] for cell in end], [[n + i for i in cell] for cell in end]
    point = np.concatenate([np.insert(outline, 2, z, axis=1) for z in (-half, half)])
    sides = [[i, j, n + j, n + i] for i, j in _around(n)]
    return Surface(point, [*low, *high, *sides])


def _ellipsoid(half: Array) -> Surface:
    """Return rings of latitude and the poles, which are the first and the last point."""
    n, rings = ROUND, ROUND // 2 - 1
    turn = 2.0 * np.pi * np.arange(n) / n
    latitude = np.pi * np.arange(1, rings + 1) / (rings + 1) - 0.5 * np.pi
    across, up = np.cos(latitude)[:, None], np.sin(latitude)[:, None]
    ring = np.stack(np.broadcast_arrays(across * np.cos(turn), across * np.sin(turn), up), axis=-1)
    pole = np.array([[0.0, 0.0, 1.0]])
    first = [1 + n * ring for ring in range(rings)]
    between = [[a + i, a + j, b + j, b + i] for a, b in pairwise(first) for i, j in _around(n)]
    below = [[0, 1 + j, 1 + i] for i, j in _around(n)]
    above = [[first[-1] + i, first[-1] + j, 1 + n * rings] for i, j in _around(n)]
    return Surface(half * np.concatenate([-pole, ring.reshape(-1, 3), pole]), [*below, *between, *above])


def _around(n: int) -> list[tuple[int, int]]:
    return [(i, (i + 1) % n) for i in range(n)]
