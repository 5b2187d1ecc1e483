"""A force model that is asked at every n-th communication point only (``every`` of its provider).

At those points t_m = m·n·h the model answers as any other. In between its force and torque go on from its
last two answers on a line (they are held where ``coupling.scheme`` is ``explicit``, ``coupling.order`` is 0,
or the model gives means over its step), and its added inertia and diagnostics are the last ones::

    W(t_m + s·n·h) = W_m + s (W_m − W_{m−1})          0 < s < 1

What that misses is of second order in n·h, and so is the run. To everybody else it is a model that answers
at every point: nothing in protocol, log and recovery knows of it.
"""

from __future__ import annotations

import dataclasses
import struct
from collections.abc import Callable

import numpy as np

from linkwind.aero.base import ForceModel, item
from linkwind.errors import InputError, ProtocolError
from linkwind.frames import Frame
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Array, Motion, Wrench

_HEAD = struct.Struct("<q")  # the last step that was committed


class Seldom:
    """A model between whose answers there are steps."""

    def __init__(
        self, scenario: Scenario, provider: Provider, build: Callable[[Scenario, Provider], ForceModel]
    ) -> None:
        """Build the model, for which a step is n of the scenario's.

        Raises:
            InputError: the model says how its wrench depends on the twist at the end of the step, which
                holds for one step only; or what ``build`` raises.
        """
        self._every = provider.every
        own_ns = provider.every * scenario.coupling.step_ns
        coupling = scenario.coupling.model_copy(update={"step": own_ns / 1e9})
        self._model = build(scenario.model_copy(update={"coupling": coupling}), provider)
        can = self._model.capabilities
        if can.response_size:
            raise InputError(
                f"{item(scenario, provider, 'every')}: expected 1 for a model that returns the response to "
                f"the twist at the end of the step; got {provider.every}. Leave it out; take a larger "
                "coupling.step, with dynamics.substeps."
            )
        self.capabilities = dataclasses.replace(can, own_step_ns=can.own_step_ns or own_ns)
        held = scenario.coupling.scheme == "explicit" or scenario.coupling.order == 0 or can.kind == "mean"
        self._depth = 1 if held else 2
        n = len(provider.bodies)
        # Of the last answers: force and torque, newest first; added inertia and diagnostics of the newest.
        self._wrenches = np.zeros((2, n, 6))
        self._rest = np.zeros(36 * n * can.added_inertia + len(can.diagnostics))
        self._answered = 0
        self._committed = -1
        self._asked: tuple[Array, Array] | None = None
        self._frame: Callable[[], Frame | None] = getattr(self._model, "frame", lambda: None)

    def commit(self, t: float, motion: Motion) -> None:
        """Take the accepted state; the model sees that of its own points."""
        self._committed += 1
        if self._committed % self._every:
            return
        if self._asked is not None:
            self._wrenches[1] = self._wrenches[0]
            self._wrenches[0], self._rest[:] = self._asked
            self._answered += 1
            self._asked = None
        self._model.commit(t, motion)

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Ask the model, or go on from its last answers."""
        place = (self._committed + 1) % self._every
        if place == 0:
            self._model.evaluate(t, motion, wrench)
            self._asked = np.concatenate((wrench.force, wrench.torque), axis=1), _rest(wrench)
            return
        newest, before = self._wrenches
        now = newest
        if min(self._answered, self._depth) == 2:
            now = newest + place / self._every * (newest - before)
        wrench.force[:], wrench.torque[:] = now[:, :3], now[:, 3:]
        added = 0 if wrench.added_inertia is None else wrench.added_inertia.size
        if wrench.added_inertia is not None:
            wrench.added_inertia[:] = self._rest[:added].reshape(wrench.added_inertia.shape)
        if wrench.diagnostics is not None:
            wrench.diagnostics[:] = self._rest[added:]

    def frame(self) -> Frame | None:
        """Return the model's frame, by the step of the run."""
        frame = self._frame()
        return None if frame is None else dataclasses.replace(frame, step=frame.step * self._every)

    def save(self) -> bytes:
        """Return the last answers and the model's own memory."""
        head = _HEAD.pack(self._committed) + bytes([min(self._answered, 2)])
        return head + self._wrenches.tobytes() + self._rest.tobytes() + self._model.save()

    def restore(self, blob: bytes) -> None:
        """Take back what ``save`` returned."""
        wrenches = _HEAD.size + 1
        rest = wrenches + self._wrenches.nbytes
        end = rest + self._rest.nbytes
        if len(blob) < end:
            raise ProtocolError(f"{type(self).__name__}: expected {end} bytes and more; got {len(blob)}.")
        self._committed, self._answered = _HEAD.unpack_from(blob)[0], blob[_HEAD.size]
        self._wrenches = np.frombuffer(blob[wrenches:rest]).reshape(self._wrenches.shape).copy()
        self._rest = np.frombuffer(blob[rest:end]).copy()
        self._asked = None
        self._model.restore(blob[end:])

    def close(self) -> None:
        """End what the model holds."""
        getattr(self._model, "close", lambda: None)()


def _rest(wrench: Wrench) -> Array:
    """Return added inertia and diagnostics in one row."""
    parts = [part.ravel() for part in (wrench.added_inertia, wrench.diagnostics) if part is not None]
    return np.concatenate(parts) if parts else np.zeros(0)
