"""A mechanism without providers that goes on from its start, and the time that this takes."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from linkwind.dynamics.methods import multibody
from linkwind.mechanism import Mechanism, build
from linkwind.mechanism.quaternion import rotate
from linkwind.native.multibody import Integrator, Multibody
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion

HELD = np.zeros(1)
TIGHT: dict[str, Any] = {"integrator": Integrator.DOPRI5, "rtol": 1e-12, "atol": 1e-12}
RK4: dict[str, Any] = {"integrator": Integrator.RK4}
RADAU5: dict[str, Any] = {"integrator": Integrator.RADAU5}


class Moving:
    """A mechanism at a time.

    Attributes:
        scenario: what it was built from.
        mechanism: likewise.
        multibody: its dynamics.
        state: at the time.
        seconds: that its steps have taken so far.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Build the mechanism of a scenario, at its start."""
        self.scenario = scenario
        self.mechanism: Mechanism = build(scenario)
        self.multibody: Multibody = multibody(self.mechanism, scenario)
        self.state = self.multibody.initial_state(self.mechanism.q0, self.mechanism.v0)
        self.seconds = 0.0
        self._calm = np.zeros((1, self.multibody.n, 6))

    def go(self, span: float, step: float, **how: Any) -> Moving:
        """Go on for ``span`` [s] in steps of ``step`` [s], ``how`` as ``Multibody.advance`` says."""
        start, steps = time.perf_counter(), max(1, round(span / step))
        self.state, _ = self.multibody.advance(
            self.state, span, HELD, self._calm, None, **{"substeps": steps, **how}
        )
        self.seconds += time.perf_counter() - start
        return self

    @property
    def motion(self) -> Motion:
        """Poses and twists of the bodies."""
        motion = Motion.at_rest(self.multibody.n)
        self.multibody.motion(self.state, motion)
        return motion

    @property
    def gap(self) -> float:
        """By how much its joints are open at most [m]."""
        return self.multibody.joint_gap(self.motion)

    @property
    def energy(self) -> float:
        """Kinetic and potential energy [J]."""
        return sum(self.multibody.energy(self.state))

    def point(self, body: str, place: tuple[float, ...]) -> tuple[Array, Array]:
        """Return where in W a point of a body, given in its frame, is [m], and its velocity [m/s]."""
        i, motion = self.mechanism.bodies.index(body), self.motion
        arm = rotate(motion.orientation[i], np.array(place))
        return motion.position[i] + arm, motion.linear[i] + np.cross(motion.angular[i], arm)
