"""What the dynamics writes to the log of the accepted states, and what follows from them."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np

from linkwind.coupling import CommunicationPoint
from linkwind.frames import Frame
from linkwind.log.state import StateMessage, StepEncoder
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import Multibody
from linkwind.native.point import AcceptedPoint
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion


class MessageLog(Protocol):
    """Where the messages go: the log of a run (:class:`linkwind.log.writer.LogWriter`), or a comparison."""

    def motion(self, payload: bytes, time_ns: int) -> None: ...
    def wrench(self, provider: str, payload: bytes, time_ns: int) -> None: ...
    def state(self, payload: bytes, time_ns: int) -> None: ...
    def step(self, payload: bytes, time_ns: int) -> None: ...
    def timing(self, payload: bytes, time_ns: int) -> None: ...
    def scene(self, time_ns: int, motion: Motion, force: Array) -> None: ...
    def frame(self, provider: str, frame: Frame) -> None: ...
    def checkpoint(self, provider: str, payload: bytes, time_ns: int) -> None: ...
    def diagnostics(self, names: Mapping[str, Sequence[str]]) -> None: ...
    def programs(self, programs: Mapping[str, str]) -> None: ...


class Recorder:
    """Computes what belongs to each communication point, writes it, keeps what the summary needs.

    Attributes:
        log: to write to.
        joint_gap_max: largest distance of two joint points so far, from the poses [m].
        force_max: largest aerodynamic force on a body so far [N].
        state: the message of accepted points.
        accepted: what evaluates them into it.
    """

    def __init__(
        self, log: MessageLog, scenario: Scenario, mechanism: Mechanism, multibody: Multibody
    ) -> None:
        self.joint_gap_max = 0.0
        self.force_max = 0.0
        self.log = log
        self._step_ns = scenario.coupling.step_ns
        self.state = StateMessage(
            multibody.n,
            len(mechanism.q0),
            len(mechanism.v0),
            len(mechanism.closures),
            len(mechanism.events),
            len(mechanism.forces),
        )
        self._step = StepEncoder(scenario.coupling.order)
        self.use(multibody)

    def use(self, multibody: Multibody) -> None:
        """Evaluate points by this from now on."""
        self.accepted = AcceptedPoint(multibody, self.state.motion, self.state.fields)

    def point(self, point: CommunicationPoint) -> None:
        """Write an accepted communication point and what the coupling did to get there."""
        state, time_ns = point.state, point.step * self._step_ns
        found = self.accepted.evaluate(
            state.values, point.trial.values, point.wrench, point.added_inertia, time_ns / 1e9
        )
        payload = self.state.encode(
            point.step,
            time_ns,
            kinetic_energy=found.kinetic_energy,
            potential_energy=found.potential_energy,
            external_work=state.external_work,
            dissipated_work=state.dissipated_work,
            joint_gap=found.joint_gap,
        )
        self.log.state(payload, time_ns)
        payload = self._step.encode(
            point.step,
            time_ns,
            iteration=point.iterations - 1,
            order=point.order,
            extrapolation_error=point.errors,
            residual=math.sqrt(found.missed),
            interface_energy=found.lost * self._step_ns / 1e9,
        )
        self.log.step(payload, time_ns)
        self.log.scene(time_ns, self.state.motion, self.accepted.force)
        self.joint_gap_max = max(self.joint_gap_max, found.joint_gap)
        self.force_max = max(self.force_max, found.force)


def tables_sha256(mechanism: Mechanism) -> str:
    """Return the hash of everything that the core is given about the mechanism."""
    digest = hashlib.sha256()
    for array in (*vars(mechanism.tables).values(), mechanism.q0, mechanism.v0):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()
