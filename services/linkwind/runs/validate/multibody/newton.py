"""Bodies by Newton's and Euler's equations, and joints as equations between them, in numpy.

Written apart from the core, to hold it against: bodies in coordinates of their own (position, unit
quaternion, velocity and angular velocity, all in W), joints by Lagrange multipliers, not stabilised.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from linkwind.mechanism.quaternion import matrix
from linkwind.native.multibody import Tables
from linkwind.scenario import Joint, Scenario
from linkwind.spatial import Array, Motion

State = Array
"""Shape (n, 13): position, orientation, velocity, angular velocity."""


def cross(a: Array, b: Array) -> Array:
    """Return a × b of two vectors; numpy's own is thirty times slower."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def state_of(motion: Motion) -> State:
    """Return the state with the poses and twists of a motion."""
    return np.hstack([motion.position, motion.orientation, motion.linear, motion.angular])


class Bodies:
    """Bodies under gravity and given wrenches.

    Attributes:
        inverse: M⁻¹ at the state last prepared, shape (n, 6, 6).
    """

    def __init__(self, tables: Tables) -> None:
        """Take masses, inertias and gravity from the tables of a mechanism."""
        self._mass, self._gravity = tables.mass, tables.gravity
        self._inertia = tables.inertia[:, [0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(-1, 3, 3)
        self.inverse = np.zeros((len(self._mass), 6, 6))

    def accelerations(self, y: State, wrench: Array) -> Array:
        """Return accelerations, linear first, in W, shape (n, 6), under wrenches at the centres of mass."""
        a = np.empty((len(y), 6))
        for i, body in enumerate(y):
            turn, w = matrix(body[3:7]), body[10:13]
            inertia = turn @ self._inertia[i] @ turn.T
            self.inverse[i, :3, :3] = np.eye(3) / self._mass[i]
            self.inverse[i, 3:, 3:] = np.linalg.inv(inertia)
            a[i, :3] = self._gravity + wrench[i, :3] / self._mass[i]
            a[i, 3:] = self.inverse[i, 3:, 3:] @ (wrench[i, 3:] - cross(w, inertia @ w))
        return a


def rates(y: State, a: Array) -> State:
    """Return dy/dt for accelerations a, shape (n, 6)."""
    w, x, yy, z = y[:, 3:7].T
    wx, wy, wz = y[:, 10:13].T
    turning = 0.5 * np.column_stack(
        [
            -x * wx - yy * wy - z * wz,
            w * wx + z * wy - yy * wz,
            w * wy + x * wz - z * wx,
            w * wz + yy * wx - x * wy,
        ]
    )
    return np.hstack([y[:, 7:10], turning, a])


def rk4(y: State, h: float, rate: Callable[[float, State], State]) -> State:
    """Return the state a step of h [s] later; ``rate`` is told which part of the step has gone by."""
    k1 = rate(0.0, y)
    k2 = rate(0.5, y + 0.5 * h * k1)
    k3 = rate(0.5, y + 0.5 * h * k2)
    k4 = rate(1.0, y + h * k3)
    end: State = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    end[:, 3:7] /= np.linalg.norm(end[:, 3:7], axis=1, keepdims=True)
    return end


ZERO = np.zeros(3)
KEPT_ALONG = {  # axes of the joint's frame on the parent along which the points stay together
    "fixed": (0, 1, 2), "revolute": (0, 1, 2), "spherical": (0, 1, 2), "prismatic": (0, 1), "planar": (2,),
}  # fmt: skip
KEPT_SQUARE = {  # axes on parent and child that stay square
    "fixed": ((0, 1), (0, 2), (1, 2)), "prismatic": ((0, 1), (0, 2), (1, 2)),
    "revolute": ((0, 2), (1, 2)), "planar": ((0, 2), (1, 2)), "spherical": (),
}  # fmt: skip


@dataclass(frozen=True)
class _Side:
    """A body of a joint: its number (-1: the world), the joint's point and frame on it."""

    body: int
    point: Array
    frame: Array


@dataclass(frozen=True)
class _Seen:
    """A side at a state, in W: arm from the centre of mass, its point, frame, and twist."""

    arm: Array
    point: Array
    frame: Array
    linear: Array
    angular: Array

    @property
    def rate(self) -> Array:
        return self.linear + cross(self.angular, self.arm)

    @property
    def centripetal(self) -> Array:
        return cross(self.angular, cross(self.angular, self.arm))


class Linked:
    """Bodies with joints, all of them equations: g(y) = 0, J a = -drift."""

    def __init__(self, scenario: Scenario, tables: Tables, start: State) -> None:
        """Take the joints of a scenario; their frames on the children are where they lie at the start."""
        self._bodies = Bodies(tables)
        names = {body.name: i for i, body in enumerate(scenario.bodies)} | {"world": -1}
        self._joints = [
            (joint, *_sides(joint, names, start)) for joint in scenario.joints if joint.type != "free"
        ]
        self._lengths = [_apart(parent, child, start) for _, parent, child in self._joints]

    def accelerations(self, y: State) -> Array:
        """Return the accelerations of the bodies, linear first, in W, shape (n, 6)."""
        free = self._bodies.accelerations(y, np.zeros((len(y), 6)))
        rows, drifts = [], []
        for (joint, parent, child), length in zip(self._joints, self._lengths, strict=True):
            a, b = _seen(parent, y), _seen(child, y)
            for on_a, on_b, drift in _equations(joint.type, a, b, length):
                row = np.zeros((len(y), 6))
                for side, part in ((parent, on_a), (child, on_b)):
                    if side.body >= 0:
                        row[side.body] += part
                rows.append(row)
                drifts.append(drift)
        jacobian = np.array(rows)
        moved = np.einsum("kni,nij->knj", jacobian, self._bodies.inverse)
        delassus = np.einsum("kni,lni->kl", moved, jacobian)
        missing = -np.array(drifts) - np.einsum("kni,ni->k", jacobian, free)
        multipliers = np.linalg.lstsq(delassus, missing, rcond=1e-11)[0]
        linked: Array = free + np.einsum("k,kni->ni", multipliers, moved)
        return linked

    def go(self, y: State, h: float, steps: int) -> State:
        """Return the state ``steps`` steps of h [s] later, by RK4."""
        for _ in range(steps):
            y = rk4(y, h, lambda part, at: rates(at, self.accelerations(at)))
        return y


def _sides(joint: Joint, names: dict[str, int], start: State) -> tuple[_Side, _Side]:
    z = np.array(joint.axis) / np.linalg.norm(joint.axis)
    x = cross(z, np.eye(3)[np.argmin(np.abs(z))])
    x /= np.linalg.norm(x)
    frame = np.column_stack([x, cross(z, x), z])
    parent = _Side(names[joint.parent], np.array(joint.parent_point), frame)
    child = names[joint.child]
    turned = _seen(parent, start).frame
    return parent, _Side(child, np.array(joint.child_point), matrix(start[child, 3:7]).T @ turned)


def _seen(side: _Side, y: State) -> _Seen:
    if side.body < 0:
        return _Seen(np.zeros(3), side.point, side.frame, np.zeros(3), np.zeros(3))
    body = y[side.body]
    turn = matrix(body[3:7])
    arm = turn @ side.point
    return _Seen(arm, body[:3] + arm, turn @ side.frame, body[7:10], body[10:13])


def _apart(parent: _Side, child: _Side, y: State) -> float:
    return float(np.linalg.norm(_seen(child, y).point - _seen(parent, y).point))


def _row(linear: Array, angular: Array) -> Array:
    return np.concatenate((linear, angular))


def _equations(kind: str, a: _Seen, b: _Seen, length: float) -> list[tuple[Array, Array, float]]:
    """Return what each equation of a joint says of the accelerations of both bodies, and its drift."""
    d, rate = b.point - a.point, b.rate - a.rate
    bent = b.centripetal - a.centripetal
    if kind == "distance":
        n = d / length
        on_a, on_b = _row(-n, -cross(a.arm, n)), _row(n, cross(b.arm, n))
        return [(on_a, on_b, float(rate @ rate + d @ bent) / length)]
    found = []
    for k in KEPT_ALONG[kind]:
        e = a.frame[:, k]
        turning = cross(a.angular, e)
        drift = cross(a.angular, turning) @ d + 2.0 * turning @ rate + e @ bent
        found.append((_row(-e, cross(e, d) - cross(a.arm, e)), _row(e, cross(b.arm, e)), float(drift)))
    for k, m in KEPT_SQUARE[kind]:
        e, f = a.frame[:, k], b.frame[:, m]
        e1, f1 = cross(a.angular, e), cross(b.angular, f)
        drift = cross(a.angular, e1) @ f + 2.0 * e1 @ f1 + e @ cross(b.angular, f1)
        about = cross(e, f)
        found.append((_row(ZERO, about), _row(ZERO, -about), float(drift)))
    return found
