"""Motion into the inputs of an FMU, its outputs into a wrench.

What is exchanged as it stands (world frame, centre of mass, SI) is copied by index, all bodies at once;
only quantities in another frame, at another point or derived from others are computed one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.fmi.host.links import Link, Mapping, Vector3
from linkwind.spatial import Array, Motion, Wrench

Index = NDArray[np.intp]
Wind = Callable[[float, Array], Array]
_RAW = {"position": (0, 3), "orientation": (3, 4), "velocity": (7, 3), "angular_velocity": (10, 3)}


@dataclass(frozen=True)
class _Signal:
    """A quantity that has to be computed."""

    quantity: str
    body: int
    frame: str
    point: Vector3 | None


def rotation(orientation: Array) -> Array:
    """Return the matrix, body to world, of a unit quaternion (w, x, y, z)."""
    w, x, y, z = orientation
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


class Inputs:
    """Fills the inputs of all instances.

    Attributes:
        remembers: whether a quantity needs the accepted motion (an unwrapped angle, an acceleration).
    """

    def __init__(self, mapping: Mapping, bodies: Sequence[int], n: int, wind: Wind, density: float) -> None:
        """Prepare.

        Args:
            mapping: of the FMU.
            bodies: place of each of the provider's bodies among those of the scenario.
            n: number of bodies of the scenario.
            wind: of time [s] and place [m], in W [m/s].
            density: of the fluid [kg/m³].
        """
        self._n, self._wind, self._density = n, wind, density
        self._signals: dict[_Signal, int] = {}
        self._size = 13 * n
        rows = [[body] for body in bodies] if mapping.per_body else [list(bodies)]
        self._take: Index = np.array(
            [[self._place(link, row[link.body]) for link in mapping.inputs] for row in rows], dtype=np.intp
        ).reshape(len(rows), len(mapping.inputs))
        gain, bias = (np.array([getattr(link, key) for link in mapping.inputs]) for key in ("gain", "bias"))
        self._gain = gain if (gain != 1.0).any() else None
        self._bias = bias if bias.any() else None
        self._source = np.zeros(self._size)
        kinds = {signal.quantity for signal in self._signals}
        self.remembers = bool(kinds & {"angle", "acceleration", "angular_acceleration"})
        self._angles = np.zeros(n)
        self._before: tuple[float, Array, Array] | None = None

    def _place(self, link: Link, body: int) -> int:
        """Return where the value of a link lies in the source."""
        if link.quantity in _RAW and link.frame == "world" and link.point is None:
            begin, size = _RAW[link.quantity]
            return begin * self._n + size * body + link.component
        signal = _Signal(link.quantity, body, link.frame, link.point)
        if signal not in self._signals:
            self._signals[signal] = self._size
            self._size += 3
        return self._signals[signal] + link.component

    def fill(self, t: float, motion: Motion, out: Array) -> None:
        """Write the inputs for a motion at time t [s]; ``out`` has shape (instances, inputs)."""
        source, n = self._source, self._n
        source[: 3 * n] = motion.position.reshape(-1)
        source[3 * n : 7 * n] = motion.orientation.reshape(-1)
        source[7 * n : 10 * n] = motion.linear.reshape(-1)
        source[10 * n : 13 * n] = motion.angular.reshape(-1)
        for signal, place in self._signals.items():
            value = self._compute(signal, t, motion)
            source[place : place + 3] = value
        source.take(self._take, out=out, mode="clip")
        if self._gain is not None:
            out *= self._gain
        if self._bias is not None:
            out += self._bias

    def _compute(self, signal: _Signal, t: float, motion: Motion) -> Any:
        """Return a quantity in its frame and at its point: three numbers, or one."""
        body, quantity = signal.body, signal.quantity
        if quantity == "density":
            return self._density
        if quantity == "angle":
            return self._angle(body, motion)
        turn = rotation(motion.orientation[body])
        arm = turn @ np.array(signal.point or (0.0, 0.0, 0.0))
        position, omega = motion.position[body] + arm, motion.angular[body]
        if quantity == "position":
            return position
        velocity = motion.linear[body] + np.cross(omega, arm)
        if quantity in ("acceleration", "angular_acceleration"):
            linear, angular = self._differences(t, motion, body)
            centripetal = np.cross(omega, np.cross(omega, arm))
            value = angular if quantity[:2] == "an" else linear + np.cross(angular, arm) + centripetal
        else:
            value = omega if quantity == "angular_velocity" else velocity
            if quantity in ("wind", "relative_velocity"):
                wind = self._wind(t, position)
                value = wind if quantity == "wind" else velocity - wind
        return turn.T @ value if signal.frame == "body" else value

    def _angle(self, body: int, motion: Motion) -> float:
        """Return the angle about z [rad] on the branch next to the accepted one."""
        w, _, _, z = motion.orientation[body]
        turn = 4.0 * np.pi  # a quaternion that is continuous in time comes back after two turns
        angle = 2.0 * np.arctan2(z, w)
        return float(angle + turn * np.round((self._angles[body] - angle) / turn))

    def _differences(self, t: float, motion: Motion, body: int) -> tuple[Array, Array]:
        """Return the accelerations since the accepted motion; zero before there is one."""
        if self._before is None or t <= self._before[0]:
            return np.zeros(3), np.zeros(3)
        before, linear, angular = self._before
        h = t - before
        return (motion.linear[body] - linear[body]) / h, (motion.angular[body] - angular[body]) / h

    def commit(self, t: float, motion: Motion) -> None:
        """Remember the accepted motion."""
        self._angles = np.array([self._angle(body, motion) for body in range(self._n)])
        self._before = (t, motion.linear.copy(), motion.angular.copy())

    def interval(self, t: float) -> float:
        """Return the time [s] since the accepted motion that accelerations are differenced from, or 0."""
        return max(0.0, t - self._before[0]) if self._before else 0.0

    def save(self) -> bytes:
        """Return what is remembered."""
        if not self.remembers or self._before is None:
            return b""
        t, linear, angular = self._before
        return np.concatenate(([t], self._angles, linear.ravel(), angular.ravel())).tobytes()

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned."""
        numbers, n = np.frombuffer(blob), self._n
        if not len(numbers):
            self._angles, self._before = np.zeros(n), None
            return
        self._angles = numbers[1 : n + 1].copy()
        linear, angular = numbers[n + 1 : 4 * n + 1], numbers[4 * n + 1 :]
        self._before = (float(numbers[0]), linear.reshape(n, 3).copy(), angular.reshape(n, 3).copy())


class Outputs:
    """Makes a wrench of the outputs of all instances."""

    def __init__(self, mapping: Mapping, bodies: Sequence[int]) -> None:
        """Prepare; see ``Inputs``."""
        self._bodies = bodies
        self._added = any(link.quantity == "added_inertia" for link in mapping.outputs)
        width = sum(variable.size for variable in mapping.output_variables)
        count = len(bodies) if mapping.per_body else 1
        pairs = [(row, link) for row in range(count) for link in mapping.outputs]
        self._take = np.array([row * width + link.index for row, link in pairs], dtype=np.intp)
        gain, bias = (np.array([getattr(link, key) for _, link in pairs]) for key in ("gain", "bias"))
        self._affine = (gain, bias) if (gain != 1.0).any() or bias.any() else None
        self._groups: dict[tuple[int, str, str, Vector3 | None], list[tuple[int, int]]] = {}
        plain: dict[str, list[tuple[int, int]]] = {"force": [], "torque": [], "added_inertia": []}
        pointed = {(row, link.body) for row, link in pairs if link.quantity == "point"}
        for place, (row, link) in enumerate(pairs):
            body = row if mapping.per_body else link.body
            moved = link.quantity == "force" and (link.point is not None or (row, link.body) in pointed)
            if link.quantity in plain and link.frame == "world" and not moved:
                size = 36 if link.quantity == "added_inertia" else 3
                plain[link.quantity].append((size * body + link.component, place))
            else:
                key = (body, link.quantity, link.frame, link.point)
                self._groups.setdefault(key, []).append((link.component, place))
        self._plain = {key: np.array(pairs_, dtype=np.intp).T for key, pairs_ in plain.items() if pairs_}

    def wrench(self, values: Array, motion: Motion, wrench: Wrench) -> None:
        """Fill the wrench from all output values, shape (instances, outputs)."""
        taken = values.reshape(-1).take(self._take)
        if self._affine is not None:
            taken = taken * self._affine[0] + self._affine[1]
        arrays = {"force": wrench.force, "torque": wrench.torque}
        if self._added and wrench.added_inertia is not None:
            arrays["added_inertia"] = wrench.added_inertia
        for key, array in arrays.items():
            array.fill(0.0)
            if key in self._plain:
                to, place = self._plain[key]
                array.reshape(-1)[to] = taken[place]
        if self._groups:
            self._turned(taken, motion, wrench)

    def _turned(self, taken: Array, motion: Motion, wrench: Wrench) -> None:
        """Add forces and torques of another frame or at another point."""
        points: dict[int, Array] = {}
        forces: list[tuple[int, Array, Array | None]] = []
        for (body, quantity, frame, point), entries in self._groups.items():
            value = np.zeros(3)
            for component, place in entries:
                value[component] = taken[place]
            if quantity == "point":
                points[body] = value
                continue
            turn = rotation(motion.orientation[self._bodies[body]])
            value = turn @ value if frame == "body" else value
            if quantity == "torque":
                wrench.torque[body] += value
            else:
                forces.append((body, value, None if point is None else turn @ np.array(point)))
        for body, force, arm in forces:
            wrench.force[body] += force
            if arm is None and body in points:
                arm = points[body] - motion.position[self._bodies[body]]
            if arm is not None:
                wrench.torque[body] += np.cross(arm, force)
