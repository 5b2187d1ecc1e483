"""Bodies whose motion is prescribed, in the flow: the fluid's side of a run, without dynamics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from linkwind import aero
from linkwind.aero.base import ForceModel
from linkwind.scenario import Scenario, loads
from linkwind.spatial import Array, Motion, Wrench

Path = Callable[[float], tuple[Array, Array]]
"""Pose (x, y [m], angle [rad]) and twist (m/s, m/s, rad/s) at a time [s], each (3,) or (n, 3)."""

Watch = Callable[["Driven", int], None]
"""Is called after each step, with its number."""


@dataclass(frozen=True)
class Forces:
    """What the fluid did to the bodies, step by step.

    Attributes:
        t: middle of each step, which its mean force belongs to [s], shape (steps,).
        wrench: x, y [N] and about z [N·m] in W at the centres of mass, shape (steps, n, 3).
    """

    t: Array
    wrench: Array


class Driven:
    """A force model whose bodies go a prescribed path.

    Attributes:
        scenario: what it was built from.
        model: the force model.
        h: communication step [s].
    """

    def __init__(self, text: str, overrides: Sequence[str] = ()) -> None:
        """Build the first provider of a scenario, given as TOML."""
        self.scenario: Scenario = loads(text, "validation", list(overrides))
        self.model: ForceModel = aero.build(self.scenario, self.scenario.providers[0])
        self.h = self.scenario.coupling.step_ns / 1e9
        self._n = len(self.scenario.bodies)

    def go(self, path: Path, steps: int | None = None, watch: Watch | None = None) -> Forces:
        """Follow ``path`` from t = 0 for ``steps`` steps, by default to the scenario's end."""
        count = self.scenario.steps if steps is None else steps
        wrench, forces = Wrench.zeros(self._n), np.empty((count, self._n, 3))
        now = motion(*path(0.0), self._n)
        self.model.commit(0.0, now)
        self.model.evaluate(0.0, now, wrench)
        for k in range(count):
            self.model.commit(k * self.h, now)
            now = motion(*path((k + 1) * self.h), self._n)
            self.model.evaluate((k + 1) * self.h, now, wrench)
            forces[k, :, :2], forces[k, :, 2] = wrench.force[:, :2], wrench.torque[:, 2]
            if watch:
                watch(self, k)
        self.model.commit(count * self.h, now)
        return Forces(np.asarray((np.arange(count) + 0.5) * self.h, np.float64), forces)


def motion(pose: Array, twist: Array, n: int) -> Motion:
    """Return planar poses and twists as a motion of n bodies."""
    pose, twist = np.broadcast_to(pose, (n, 3)), np.broadcast_to(twist, (n, 3))
    out = Motion.at_rest(n)
    out.position[:, :2], out.linear[:, :2], out.angular[:, 2] = pose[:, :2], twist[:, :2], twist[:, 2]
    out.orientation[:, 0], out.orientation[:, 3] = np.cos(0.5 * pose[:, 2]), np.sin(0.5 * pose[:, 2])
    return out


def at_rest(*place: float) -> Path:
    """Return the path of a body that stays at a place (x, y, angle)."""
    pose, twist = np.array([*place, *np.zeros(3 - len(place))]), np.zeros(3)
    return lambda t: (pose, twist)
