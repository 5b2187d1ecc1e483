"""How far points are from a shape: what of one body lies on another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from linkwind.scenario.shapes import AnyShape, Ellipsoid, Plate, Wing
from linkwind.spatial import Array

Truths = NDArray[np.bool_]


def distance(shape: AnyShape, points: Array) -> Array:
    """Return the distance of points, shape (k, 3), from a shape, 0 inside [m], both in the body frame.

    From an ellipsoid it is that along the line to its middle, which is no less.
    """
    if isinstance(shape, Plate):
        outside = np.abs(points) - 0.5 * np.array([shape.length, 0.0, shape.span])
        return _norm(np.maximum(outside, 0.0))
    if isinstance(shape, Ellipsoid):
        scale = np.maximum(_norm(points / (0.5 * np.array(shape.size))), 1.0)
        return _norm(points) * (1.0 - 1.0 / scale)
    if isinstance(shape, Wing):
        outline, flat, beyond = shape.planform, points[:, ::2], np.abs(points[:, 1])
    else:
        outline, flat = shape.outline(), points[:, :2]
        beyond = np.maximum(np.abs(points[:, 2]) - 0.5 * shape.span, 0.0)
    beside = np.where(inside(outline, flat), 0.0, from_line(outline, flat))
    return _norm(np.column_stack([beside, beyond]))


def inside(outline: Array, points: Array) -> Truths:
    """Return which points, shape (k, 2), are inside a closed outline, shape (n, 2)."""
    (x, y), a, b = points.T[:, :, None], outline, np.roll(outline, -1, axis=0)
    crosses = (a[:, 1] > y) != (b[:, 1] > y)
    rise = np.where(crosses, b[:, 1] - a[:, 1], 1.0)
    right = x < a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / rise
    odd: Truths = np.count_nonzero(crosses & right, axis=1) % 2 == 1
    return odd


def from_line(outline: Array, points: Array) -> Array:
    """Return the distance of points, shape (k, 2), from a closed outline, shape (n, 2)."""
    along = np.roll(outline, -1, axis=0) - outline
    to = points[:, None] - outline
    share = np.clip((to * along).sum(axis=2) / (along * along).sum(axis=1), 0.0, 1.0)
    nearest: Array = _norm(to - share[:, :, None] * along).min(axis=1)
    return nearest


def _norm(vectors: Array) -> Array:
    norm: Array = np.linalg.norm(vectors, axis=-1)
    return norm
