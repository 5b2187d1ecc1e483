"""Motion of bodies: out of the messages, and between two states; in the plane, and in space."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from linkwind.spatial import Array, Motion


class State(NamedTuple):
    """Bodies in the plane or in space, in W.

    Attributes:
        pose: in the plane the centre of mass x, y [m], cosine and sine of the angle, shape (n, 4); in space
            the centre of mass [m] and the unit quaternion (w, x, y, z), shape (n, 7).
        twist: in the plane velocity x, y [m/s], about z [rad/s], shape (n, 3); in space the velocity and the
            angular velocity, shape (n, 6).
    """

    pose: Array
    twist: Array

    def fastest(self, reach: Sequence[float]) -> float:
        """Return the largest speed of a point up to ``reach`` [m] from the centres of mass, body by body."""
        fastest, linear = 0.0, (self.twist.shape[1] + 1) // 2
        for twist, far in zip(self.twist.tolist(), reach, strict=True):
            speed = math.hypot(*twist[:linear]) + math.hypot(*twist[linear:]) * far
            if not speed <= fastest:  # not a number stays visible
                fastest = speed
        return fastest


def planar(motion: Motion, bodies: Array | slice) -> State:
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
    return State(both[:, :4], both[:, 4:])


def spatial(motion: Motion, bodies: Array | slice) -> State:
    """Return the motion of some of the bodies in space."""
    parts = (motion.position, motion.orientation, motion.linear, motion.angular)
    position, orientation, linear, angular = (part[bodies] for part in parts)
    return State(np.hstack([position, orientation]), np.hstack([linear, angular]))


def between(start: State, end: State, share: float, h: float) -> State:
    """Return the motion in the plane after a ``share`` of a step of h [s]: the cubic through both states."""
    travel = np.column_stack([end.pose[:, :2] - start.pose[:, :2], _turn(start.pose, end.pose)])
    moved, twist = _cubic(travel, start.twist, end.twist, share, h)
    c, n = np.cos(moved[:, 2]), np.sin(moved[:, 2])
    cosine, sine = start.pose[:, 2], start.pose[:, 3]
    turned = np.column_stack([cosine * c - sine * n, sine * c + cosine * n])
    return State(np.hstack([start.pose[:, :2] + moved[:, :2], turned]), twist)


def between_in_space(start: State, end: State, share: float, h: float) -> State:
    """Return the motion in space after a ``share`` of a step of h [s]: the cubic through both states.

    Turns are rotation vectors φ from the start on, with ω = φ̇ + φ × φ̇ / 2 + φ × (φ × φ̇) / 6 + …
    """
    turn = _rotation_vector(start.pose[:, 3:], end.pose[:, 3:])
    travel = np.hstack([end.pose[:, :3] - start.pose[:, :3], turn])
    rate = end.twist.copy()
    across = np.cross(turn, rate[:, 3:])
    rate[:, 3:] += np.cross(turn, across) / 12.0 - 0.5 * across  # φ̇ of ω
    moved, twist = _cubic(travel, start.twist, rate, share, h)
    across = np.cross(moved[:, 3:], twist[:, 3:])
    twist[:, 3:] += 0.5 * across + np.cross(moved[:, 3:], across) / 6.0
    turned = [
        _product(_quaternion(vector), before)
        for vector, before in zip(moved[:, 3:].tolist(), start.pose[:, 3:].tolist(), strict=True)
    ]
    return State(np.hstack([start.pose[:, :3] + moved[:, :3], np.array(turned)]), twist)


def _cubic(travel: Array, first: Array, last: Array, share: float, h: float) -> tuple[Array, Array]:
    """Return how far the bodies have come after a ``share`` of the step, and how fast they go.

    Args:
        travel: in the step.
        first: rates at its start.
        last: rates at its end.
        share: of the step that has passed.
        h: the step [s].
    """
    s, one = share, 1.0 - share
    moved = s * s * (3.0 - 2.0 * s) * travel + h * s * one * (one * first - s * last)
    slopes = one * (1.0 - 3.0 * s) * first + s * (3.0 * s - 2.0) * last
    return moved, (6.0 * s * one / h) * travel + slopes


def _rotation_vector(start: Array, end: Array) -> Array:
    """Return the turns from some orientations to others, less than half of one each, shape (n, 3), in W."""
    found = []
    for before, after in zip(start.tolist(), end.tolist(), strict=True):
        w, *v = _product(after, (before[0], -before[1], -before[2], -before[3]))
        sine = math.hypot(*v)
        scale = 2.0 * math.atan2(math.copysign(sine, w), abs(w)) / sine if sine else 0.0
        found.append([scale * component for component in v])
    return np.array(found)


def _quaternion(vector: Sequence[float]) -> tuple[float, float, float, float]:
    angle = math.hypot(*vector)
    scale = math.sin(0.5 * angle) / angle if angle else 0.5
    x, y, z = vector
    return math.cos(0.5 * angle), scale * x, scale * y, scale * z


def _product(one: Sequence[float], other: Sequence[float]) -> tuple[float, float, float, float]:
    (a, b, c, d), (w, x, y, z) = one, other
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def _turn(start: Array, end: Array) -> Array:
    """Return the angle from one pose to another [rad], shape (n,)."""
    (c0, s0), (c1, s1) = start[:, 2:].T, end[:, 2:].T
    turn: Array = np.arctan2(c0 * s1 - s0 * c1, c0 * c1 + s0 * s1)
    return turn
