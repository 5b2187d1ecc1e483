"""A wind that changes with time: the frame in which the fluid far away is steady.

The lattice goes through the world with V(t), which is all of the wind but its constant components: these are
the stream in the lattice, and bodies are in it with their velocities less V. What makes the fluid far away
faster is a pressure that falls along dV/dt everywhere; in the frame of the lattice it cancels, in the world
it pushes every volume by ρ dV/dt, that of a body as well (the force of Froude and Krylov; J. N. Newman,
*Marine Hydrodynamics*, MIT Press 1977, ch. 4).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from linkwind.aero.flow.motion import State
from linkwind.scenario import Scenario
from linkwind.spatial import Array
from linkwind.wind import Wind


class Frame(NamedTuple):
    """How the lattice goes, and how far it has gone.

    Attributes:
        velocity: V [m/s], shape (d,), in W.
        way: its integral from the start on [m], shape (d,).
    """

    velocity: Array
    way: Array

    def inside(self, state: State) -> State:
        """Return a motion in W as it is in this frame."""
        d, (pose, twist) = len(self.way), state
        pose[:, :d] -= self.way
        twist[:, :d] -= self.velocity
        return State(pose, twist)


def first_wind(scenario: Scenario, dimensions: int) -> Array:
    """Return the wind at the start [m/s], shape (d,), in W."""
    return Wind(scenario).velocity(0.0, np.zeros(3))[:dimensions]


class Drift:
    """Frames, communication point after communication point.

    Attributes:
        now: the one at the point that was committed.
    """

    def __init__(self, scenario: Scenario, dimensions: int) -> None:
        environment = scenario.environment
        self._changes = bool(environment.wind_functions or environment.gusts)
        self._wind, self._stream = Wind(scenario), np.array(environment.uniform_wind)
        self._h = scenario.coupling.step_ns / 1e9
        self._dimensions = dimensions
        self.restart(0, np.zeros(dimensions))

    def restart(self, step: int, way: Array) -> None:
        """Take a point as committed, up to which the frame has gone so far."""
        self.now, self._step = Frame(self._velocity(step), way), step

    def at(self, step: int) -> Frame:
        """Return the frame at the point that was committed, or at the next one."""
        if step == self._step or not self._changes:
            return self.now
        velocity = self._velocity(step)
        return Frame(velocity, self.now.way + 0.5 * self._h * (self.now.velocity + velocity))

    def go(self, step: int) -> None:
        """Commit the point ``step``."""
        self.now, self._step = self.at(step), step

    def acceleration(self, step: int) -> Array | None:
        """Return the mean of dV/dt over the step to a point [m/s²], shape (d,); None in a steady wind."""
        return (self.at(step).velocity - self.now.velocity) / self._h if self._changes else None

    def _velocity(self, step: int) -> Array:
        if not self._changes:
            return np.zeros(self._dimensions)
        wind = self._wind.velocity(step * self._h, np.zeros(3))
        return np.asarray((wind - self._stream)[: self._dimensions])
