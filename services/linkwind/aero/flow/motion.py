"""Motion of bodies in the plane: out of the messages, and between two states."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from linkwind.spatial import Array, Motion


class Planar(NamedTuple):
    """Bodies in the plane, in W.

    Attributes:
        pose: centre of mass x, y [m], cosine and sine of the angle, shape (n, 4).
        twist: velocity x, y [m/s], about z [rad/s], shape (n, 3).
    """

    pose: Array
    twist: Array

    def fastest(self, reach: Sequence[float]) -> float:
        """Return the largest speed of a point up to ``reach`` [m] from the centres of mass, body by body."""
        fastest = 0.0
        for (x, y, turn), far in zip(self.twist.tolist(), reach, strict=True):
            speed = math.hypot(x, y) + abs(turn) * far
            if not speed <= fastest:  # not a number stays visible
                fastest = speed
        return fastest


def planar(motion: Motion, bodies: Array | slice) -> Planar:
    """Return the motion of some of the bodies in the plane; a slice of them is faster."""
    arrays = (motion.position, motion.orientation, motion.linear, motion.angular)
    # So few numbers make a list faster than the parts of an array.
    rows = [
        (x, y, w * w - z * z, 2.0 * w * z, vx, vy, turn)
        for (x, y, _), (w, _, _, z), (vx, vy, _), (_, _, turn) in zip(
            *(array[bodies].tolist() for array in arrays), strict=True
        )
    ]
    both = np.array(rows)
    return Planar(both[:, :4], both[:, 4:])


def between(start: Planar, end: Planar, share: float, h: float) -> Planar:
    """Return the motion after a ``share`` of a step of h [s]: the cubic through poses and twists."""
    turn = _turn(start.pose, end.pose)
    travel = np.column_stack([end.pose[:, :2] - start.pose[:, :2], turn])
    s, one = share, 1.0 - share
    moved = s * s * (3.0 - 2.0 * s) * travel + h * s * one * (one * start.twist - s * end.twist)
    slopes = one * (1.0 - 3.0 * s) * start.twist + s * (3.0 * s - 2.0) * end.twist
    twist = (6.0 * s * one / h) * travel + slopes
    c, n = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    cosine, sine = start.pose[:, 2], start.pose[:, 3]
    turned = np.column_stack([cosine * c - sine * n, sine * c + cosine * n])
    return Planar(np.hstack([start.pose[:, :2] + moved[:, :2], turned]), twist)


def _turn(start: Array, end: Array) -> Array:
    """Return the angle from one pose to another [rad], shape (n,)."""
    (c0, s0), (c1, s1) = start[:, 2:].T, end[:, 2:].T
    turn: Array = np.arctan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)
    return turn
