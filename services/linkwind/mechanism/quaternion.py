"""Unit quaternions (w, x, y, z) at the start of a run; the core has its own for motion."""

from __future__ import annotations

import math

import numpy as np

from linkwind.spatial import Array

IDENTITY: Array = np.array([1.0, 0.0, 0.0, 0.0])


def about_z(angle: float) -> Array:
    """Return the turn by ``angle`` [rad] about z; it keeps its sign through several turns."""
    return np.array([math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)])


def product(a: Array, b: Array) -> Array:
    """Return the turn ``b`` followed by ``a``."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return np.array(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ]
    )


def inverse(q: Array) -> Array:
    """Return the opposite turn."""
    return q * [1.0, -1.0, -1.0, -1.0]


def matrix(q: Array) -> Array:
    """Return the rotation matrix, shape (3, 3); exactly the identity where q is."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotate(q: Array, vector: Array) -> Array:
    """Return the vector turned by q, shape (3,)."""
    turned: Array = matrix(q) @ vector
    return turned


def from_z(axis: Array) -> Array:
    """Return the shortest turn that takes z to the direction of ``axis``, which is not zero."""
    x, y, z = axis / math.hypot(*axis)
    if z < 0.0 and x == 0.0 and y == 0.0:
        return np.array([0.0, 1.0, 0.0, 0.0])
    # (1 + z·a, z × a), with 1 + z written without cancellation for an axis close to -z.
    scalar = (x * x + y * y) / (1.0 - z) if z < 0.0 else 1.0 + z
    turn = np.array([scalar, -y, x, 0.0])
    unit: Array = turn / math.hypot(*turn) + 0.0  # no -0.0
    return unit


def from_matrix(rotation: Array) -> Array:
    """Return the quaternion of a rotation matrix, shape (3, 3), its largest element positive.

    Each row of ``four`` is the quaternion times 4 of its elements; the longest is the most accurate.
    """
    (a, b, c), (d, e, f), (g, h, i) = rotation
    four = np.array(
        [
            [1 + a + e + i, h - f, c - g, d - b],
            [h - f, 1 + a - e - i, b + d, c + g],
            [c - g, b + d, 1 - a + e - i, f + h],
            [d - b, c + g, f + h, 1 - a - e + i],
        ]
    )
    row = four[np.argmax(np.diag(four))]
    unit: Array = row / math.hypot(*row) + 0.0  # no -0.0
    return unit
