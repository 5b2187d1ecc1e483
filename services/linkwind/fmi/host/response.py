"""How the wrench of an FMU answers to the twist: from its directional derivatives to the matrix G.

Three linear maps follow one another: twist → inputs of the FMU, J; inputs → outputs, D, from the FMU;
outputs → wrench, M; all about the present motion and values. G = −M D J. Frames, points, units, signs and
scales are in J and M. Only the direct dependence of outputs on inputs is in D, none through the FMU's states.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from linkwind.fmi.host.links import Link, Mapping
from linkwind.fmi.host.transfer import rotation
from linkwind.spatial import Array, Motion


def skew(a: Array) -> Array:
    """Return the matrix of a ×."""
    x, y, z = a
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


class Response:
    """The matrix G of one provider."""

    def __init__(self, mapping: Mapping, bodies: Sequence[int]) -> None:
        """Prepare.

        Args:
            mapping: of the FMU.
            bodies: place of each of the provider's bodies among those of the scenario.
        """
        self._rows = [[body] for body in bodies] if mapping.per_body else [list(bodies)]
        self._inputs, self._outputs = mapping.twist_inputs, mapping.outputs
        self._width = sum(variable.size for variable in mapping.output_variables)
        self._fixed = all(link.frame == "world" and link.point is None for link in self._inputs)
        self._fixed &= not any("acceleration" in link.quantity for link in self._inputs)
        plain = (link.frame == "world" and link.point is None for link in self._outputs)
        self._fixed &= all(plain) and not any(link.quantity == "point" for link in self._outputs)
        self._kept: list[tuple[Array, Array]] | None = None

    def matrix(self, motion: Motion, values: Array, derivatives: Array, interval: float, out: Array) -> None:
        """Fill G.

        Args:
            motion: of all bodies, in W.
            values: of the outputs, shape (instances, outputs).
            derivatives: of the outputs, shape (instances, inputs that depend on a twist, outputs).
            interval: since the accepted motion [s], over which accelerations are differenced; 0: they are
                not.
            out: shape (n, 6, 6) for an instance each body, (6n, 6n) for one instance; rows force and torque,
                columns linear and angular, in W.
        """
        maps = self._kept
        if maps is None:
            maps = [
                (self._by_outputs(row, motion, values[i]), self._by_twist(row, motion, interval))
                for i, row in enumerate(self._rows)
            ]
            self._kept = maps if self._fixed else None
        size = 6 * len(self._rows[0])
        blocks = out.reshape(len(self._rows), size, size)
        for block, (wrench, inputs), derivative in zip(blocks, maps, derivatives, strict=True):
            np.matmul(wrench @ -derivative.T, inputs, out=block)

    def _by_twist(self, bodies: Sequence[int], motion: Motion, interval: float) -> Array:
        """Return J, shape (inputs that depend on a twist, 6n)."""
        jacobian = np.zeros((len(self._inputs), 6 * len(bodies)))
        blocks: dict[Any, Array] = {}
        for row, link in enumerate(self._inputs):
            key = (link.quantity, link.body, link.frame, link.point)
            if key not in blocks:
                blocks[key] = _quantity_by_twist(link, bodies[link.body], motion, interval)
            part = slice(6 * link.body, 6 * link.body + 6)
            jacobian[row, part] = link.gain * blocks[key][link.component]
        return jacobian

    def _by_outputs(self, bodies: Sequence[int], motion: Motion, values: Array) -> Array:
        """Return M, shape (6n, outputs)."""
        matrix = np.zeros((6 * len(bodies), self._width))
        points: dict[int, Array] = {}
        for link in self._outputs:
            if link.quantity == "point":
                place = points.setdefault(link.body, np.zeros(3))
                place[link.component] = link.gain * values[link.index] + link.bias
        for link in self._outputs:
            turn = rotation(motion.orientation[bodies[link.body]])
            axis = turn[:, link.component] if link.frame == "body" else np.eye(3)[link.component % 3]
            force, torque = 6 * link.body, 6 * link.body + 3
            if link.quantity == "torque":
                matrix[torque : torque + 3, link.index] = link.gain * axis
            elif link.quantity == "force":
                matrix[force : force + 3, link.index] = link.gain * axis
                arm = self._arm(link, turn, points, motion.position[bodies[link.body]])
                if arm is not None:
                    matrix[torque : torque + 3, link.index] = link.gain * np.cross(arm, axis)
            elif link.quantity == "point":
                acting = self._acting(link.body, turn, values)
                matrix[torque : torque + 3, link.index] = link.gain * np.cross(axis, acting)
        return matrix

    def _arm(self, link: Link, turn: Array, points: dict[int, Array], position: Array) -> Array | None:
        if link.point is not None:
            arm: Array = turn @ np.array(link.point)
            return arm
        return points[link.body] - position if link.body in points else None

    def _acting(self, body: int, turn: Array, values: Array) -> Array:
        """Return the force that acts where the FMU says, in W [N]."""
        force = np.zeros(3)
        for link in self._outputs:
            if link.quantity == "force" and link.body == body and link.point is None:
                axis = turn[:, link.component] if link.frame == "body" else np.eye(3)[link.component]
                force += (link.gain * values[link.index] + link.bias) * axis
        return force


def _quantity_by_twist(link: Link, body: int, motion: Motion, interval: float) -> Array:
    """Return the derivative of a quantity, in its frame, by a body's twist: shape (3, 6), linear first."""
    turn = rotation(motion.orientation[body])
    arm, omega = turn @ np.array(link.point or (0.0, 0.0, 0.0)), motion.angular[body]
    linear, angular, quantity = np.zeros((3, 3)), np.zeros((3, 3)), link.quantity
    if quantity in ("velocity", "relative_velocity"):
        linear, angular = np.eye(3), -skew(arm)
    elif quantity == "angular_velocity":
        angular = np.eye(3)
    elif quantity == "angular_acceleration" and interval:
        angular = np.eye(3) / interval
    elif quantity == "acceleration" and interval:
        linear = np.eye(3) / interval
        angular = -skew(arm) / interval - skew(np.cross(omega, arm)) - skew(omega) @ skew(arm)
    block = np.hstack([linear, angular])
    return turn.T @ block if link.frame == "body" else block
