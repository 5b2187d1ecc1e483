"""The total wrench on bodies that move as recorded, from what providers answered about that motion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from linkwind.log.contents import WRENCH
from linkwind.log.reader import Log
from linkwind.mechanism import quaternion
from linkwind.messages import WrenchMessage
from linkwind.protocol import DynamicsSession
from linkwind.schema import MESSAGES
from linkwind.spatial import Array, Motion, Wrench
from linkwind.wire import FixedLayout


class Answered(NamedTuple):
    """A provider's answer about a trial state: bodies, their trial twists, shape (m, 6), and the wrench."""

    bodies: tuple[int, ...]
    twist: Array
    wrench: Wrench


class Loads:
    """Puts the total wrench of live and recorded answers into recorded states.

    Of every provider the last answer about a communication point counts,

        (force, torque) − R A Rᵀ acceleration − G (twist − trial twist),

    with the recorded acceleration and twist of the accepted state.

    Attributes:
        motion: of the last state.
        force: its total on every body [N], shape (n, 3), in W.
    """

    def __init__(self, log: Log, session: DynamicsSession) -> None:
        """Prepare for the states of ``log`` and the live providers of ``session``."""
        self._log, self._session = log, session
        self._messages: dict[str, WrenchMessage] = {}
        self._waiting: dict[int, dict[str, Answered]] = {}
        self._layout: FixedLayout | None = None

    def answered(self) -> None:
        """Take the live answers to the motion that the session has."""
        for name, participant in self._session.participants.items():
            self._take(name, participant.bodies, participant.answer)

    def recorded(self, name: str, payload: bytes) -> None:
        """Take the recorded answer of another provider to that motion."""
        bodies = tuple(self._log.bodies.index(body) for body in self._log.provider_bodies[name])
        if name not in self._messages:
            found = MESSAGES["WrenchStep"].FromString(payload)
            self._messages[name] = WrenchMessage(
                self._log.run,
                name,
                len(bodies),
                kind="mean" if found.kind == 2 else "point",
                added_inertia=len(found.added_inertia) > 0,
                response_size=len(found.response),
                diagnostics=[""] * len(found.diagnostics),
            )
        self._messages[name].load(payload, f"{self._log.path}: {WRENCH}{name}")
        self._take(name, bodies, self._messages[name].wrench)

    def _take(self, name: str, bodies: tuple[int, ...], wrench: Wrench) -> None:
        trial, rows = self._session.motion.trial, list(bodies)
        twist = np.hstack([trial.linear[rows], trial.angular[rows]])
        matrices = (None if m is None else m.copy() for m in (wrench.added_inertia, wrench.response))
        kept = Wrench(wrench.force.copy(), wrench.torque.copy(), *matrices)
        self._waiting.setdefault(self._session.motion.at[0], {})[name] = Answered(bodies, twist, kept)

    def state(self, payload: bytes) -> bytes:
        """Return an encoded State with the total wrench of the answers about it in the place of its own."""
        if self._layout is None:
            self._prepare(payload)
        assert self._layout is not None
        if not self._layout.load(payload):
            self._layout.fill(MESSAGES["State"].FromString(payload))
        step = int(self._layout.views["step"][0])
        self._wrench[...] = 0.0
        for answer in self._waiting.pop(step, {}).values():
            self._add(answer)
        return self._layout.payload()

    def _prepare(self, payload: bytes) -> None:
        self._layout = FixedLayout(MESSAGES["State"].FromString(payload))
        views, n = self._layout.views, len(self._log.bodies)
        self.motion = Motion.of(views, "motion")
        self._wrench = views["wrench"].reshape(n, 6)
        self.force = self._wrench[:, :3]
        self._acceleration = views["acceleration"].reshape(n, 6)

    def _add(self, answer: Answered) -> None:
        rows, wrench = list(answer.bodies), answer.wrench
        total = np.hstack([wrench.force, wrench.torque])
        if wrench.added_inertia is not None:
            for i, body in enumerate(rows):
                turn = np.kron(np.eye(2), quaternion.matrix(self.motion.orientation[body]))
                total[i] -= turn @ wrench.added_inertia[i] @ turn.T @ self._acceleration[body]
        if wrench.response is not None:
            off = np.hstack([self.motion.linear[rows], self.motion.angular[rows]]) - answer.twist
            if wrench.response.ndim == 2:
                total -= (wrench.response @ off.ravel()).reshape(total.shape)
            else:
                total -= np.einsum("bij,bj->bi", wrench.response, off)
        self._wrench[rows] += total
