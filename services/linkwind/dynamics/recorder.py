"""What the dynamics writes to the log of the accepted states, and what follows from them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from linkwind.coupling import CommunicationPoint
from linkwind.frames import FlowFrame
from linkwind.log.state import StateEncoder, StepEncoder
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import Multibody
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion, Wrench


class MessageLog(Protocol):
    """Where the messages go: the log of a run (:class:`linkwind.log.writer.LogWriter`), or a comparison."""

    def motion(self, payload: bytes, time_ns: int) -> None: ...
    def wrench(self, provider: str, payload: bytes, time_ns: int) -> None: ...
    def state(self, payload: bytes, time_ns: int) -> None: ...
    def step(self, payload: bytes, time_ns: int) -> None: ...
    def timing(self, payload: bytes, time_ns: int) -> None: ...
    def scene(self, time_ns: int, motion: Motion, wrench: Wrench) -> None: ...
    def frame(self, provider: str, frame: FlowFrame) -> None: ...
    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None: ...
    def diagnostics(self, names: Mapping[str, Sequence[str]]) -> None: ...


class Recorder:
    """Computes what belongs to each communication point, writes it, keeps what the summary needs.

    Attributes:
        log: to write to.
        joint_gap_max: largest distance of two joint points so far, from the poses [m].
        force_max: largest aerodynamic force on a body so far [N].
        multibody: by which points are evaluated.
    """

    def __init__(
        self, log: MessageLog, scenario: Scenario, mechanism: Mechanism, multibody: Multibody
    ) -> None:
        n = multibody.n
        self.joint_gap_max = 0.0
        self.force_max = 0.0
        self.log = log
        self.multibody = multibody
        self._events = len(mechanism.events)
        self._step_ns = scenario.coupling.step_ns
        self._state = StateEncoder(
            n,
            len(mechanism.q0),
            len(mechanism.v0),
            len(mechanism.closures),
            len(mechanism.events),
            len(mechanism.forces),
        )
        self._step = StepEncoder(scenario.coupling.order)
        self._accepted, self._accepted_twist = _motion_and_twist(n)
        self._trial, self._trial_twist = _motion_and_twist(n)
        self._total = Wrench.zeros(n)
        self._loads = np.zeros((2, n, 3))
        # Norm of a twist: mass for the linear part, the mean principal inertia for the angular one.
        inertia = mechanism.tables.inertia[:, :3].mean(axis=1)
        self._twist_inertia = np.repeat([mechanism.tables.mass, inertia], 3)

    def point(self, point: CommunicationPoint) -> None:
        """Write an accepted communication point and what the coupling did to get there."""
        multibody, values = self.multibody, point.state.values
        time_ns = point.step * self._step_ns
        multibody.motion(values, self._accepted)
        result = multibody.evaluate(values, point.wrench, point.added_inertia, time=time_ns / 1e9)
        kinetic, potential = multibody.energy(values)
        gap = multibody.joint_gap(self._accepted)
        q, v = multibody.coordinates(values)
        payload = self._state.encode(
            point.step,
            time_ns,
            self._accepted,
            q=q,
            v=v,
            acceleration=result.acceleration,
            reaction=result.reaction,
            wrench=result.total_wrench,
            kinetic_energy=kinetic,
            potential_energy=potential,
            external_work=point.state.external_work,
            dissipated_work=point.state.dissipated_work,
            joint_gap=gap,
            closure_reaction=result.closure_reaction,
            force_effort=result.effort,
            force_power=result.power,
            event_time=values[len(values) - self._events :],
        )
        self.log.state(payload, time_ns)
        self._coupling(point, time_ns)
        force = self._total.force
        force[:] = result.total_wrench[:, :3]
        self._total.torque[:] = result.total_wrench[:, 3:]
        self.log.scene(time_ns, self._accepted, self._total)
        self.joint_gap_max = max(self.joint_gap_max, gap)
        self.force_max = max(self.force_max, math.sqrt((force * force).sum(axis=1).max()))

    def _coupling(self, point: CommunicationPoint, time_ns: int) -> None:
        """Write how far the trial state was from the accepted one, and the power lost between them."""
        self.multibody.motion(point.trial.values, self._trial)
        difference = self._accepted_twist - self._trial_twist
        np.copyto(self._loads, point.wrench.reshape(-1, 2, 3).swapaxes(0, 1))
        squared = difference.dot(self._twist_inertia * difference)
        power = difference.dot(self._loads.reshape(-1))
        payload = self._step.encode(
            point.step,
            time_ns,
            iteration=point.iterations - 1,
            order=point.order,
            extrapolation_error=point.errors,
            residual=math.sqrt(squared),
            interface_energy=float(power) * self._step_ns / 1e9,
        )
        self.log.step(payload, time_ns)


def _motion_and_twist(n: int) -> tuple[Motion, Array]:
    """Return a motion of ``n`` bodies and its twists as one view, all linear first, shape (6n,)."""
    flat = np.zeros(13 * n)
    position, orientation, linear, angular = np.split(flat, [3 * n, 7 * n, 10 * n])
    motion = Motion(
        position.reshape(n, 3), orientation.reshape(n, 4), linear.reshape(n, 3), angular.reshape(n, 3)
    )
    return motion, flat[7 * n :]


def tables_sha256(mechanism: Mechanism) -> str:
    """Return the hash of everything that the core is given about the mechanism."""
    digest = hashlib.sha256()
    for array in (*vars(mechanism.tables).values(), mechanism.q0, mechanism.v0):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
