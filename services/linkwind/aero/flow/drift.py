"""A wind that changes with time: the frame in which the fluid far away keeps its first velocity.

The lattice goes through the world with V(t) = U(t) − U(0), so that its stream is steady, and bodies are in it
with their velocities less V. What makes the fluid far away faster is a pressure that falls along dV/dt
everywhere; in the frame of the lattice it cancels, in the world it pushes every volume by ρ dV/dt, that of a
body as well (the part of Froude and Krylov; C. E. Brennen, *A Review of Added Mass and Fluid Inertial
Forces*, 1982, NCEL CR 82.010).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from linkwind.aero.flow.motion import State
from linkwind.errors import ProtocolError
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
    """Return the wind at the start [m/s], shape (d,)."""
    return Wind(scenario).velocity(0.0, np.zeros(3))[:dimensions]


class Drift:
    """Frames, communication point after communication point.

    Attributes:
        now: the one at the point that was committed.
    """

    def __init__(self, scenario: Scenario, dimensions: int) -> None:
        environment = scenario.environment
        self._changes = bool(environment.wind_functions or environment.gusts)
        self._wind, self._first = Wind(scenario), first_wind(scenario, dimensions)
        self._h = scenario.coupling.step_ns / 1e9
        self._step = 0
        self.now = Frame(np.zeros(dimensions), np.zeros(dimensions))

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

    def save(self) -> bytes:
        """Return what the past has left behind."""
        return self.now.way.astype("<f8").tobytes()

    def restore(self, step: int, blob: bytes) -> None:
        """Take back what ``save`` returned after the point ``step``."""
        d = len(self.now.way)
        if len(blob) != 8 * d:
            raise ProtocolError(f"model flow: expected {8 * d} bytes of its frame; got {len(blob)}.")
        velocity = self._velocity(step) if self._changes else np.zeros(d)
        self.now, self._step = Frame(velocity, np.frombuffer(blob, "<f8").copy()), step

    def _velocity(self, step: int) -> Array:
        wind = self._wind.velocity(step * self._h, np.zeros(3))
        return np.asarray(wind[: len(self._first)] - self._first)
