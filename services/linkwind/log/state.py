"""The messages that only the log carries: State, Step and Timing.

Each is one message of fixed layout (``linkwind.wire``), so that encoding is a few copies. The schema, with
units and frames, is ``schemas/linkwind/v1/log.proto``.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from linkwind.schema import MESSAGES
from linkwind.spatial import Motion
from linkwind.wire import FixedLayout

# Neighbouring fields with the tags between them (field number · 8 + wire type): packing them in one go
# takes a third of the time of as many numpy views.
_STAMP = struct.Struct("<QBQ")  # fields 1 and 2 of State
_ENERGIES = struct.Struct("<dBdBdBdBd")  # fields 9 to 13 of State


class StateMessage:
    """The accepted trajectory, one message a communication point: fill the arrays, then encode.

    Attributes:
        motion: accepted poses and twists, in W at the centres of mass.
        fields: the other arrays, flat, by name.
        layout: the message itself.
    """

    def __init__(self, n: int, nq: int, nv: int, closures: int = 0, events: int = 0, forces: int = 0) -> None:
        """Make the message.

        Args:
            n: number of bodies.
            nq: number of joint coordinates.
            nv: number of joint velocities.
            closures: number of joints that close loops.
            events: number of things that may happen to joints.
            forces: number of force elements.
        """
        six = [0.0] * (6 * n)
        motion = {"position": six[: 3 * n], "orientation": six[: 4 * n]}
        motion |= {"linear": six[: 3 * n], "angular": six[: 3 * n]}
        arrays = {
            "q": [0.0] * nq, "v": [0.0] * nv, "acceleration": six, "reaction": six, "wrench": six,
            "closure_reaction": [0.0] * (6 * closures), "event_time": [0.0] * events,
            "force_effort": [0.0] * forces, "force_power": [0.0] * forces,
        }  # fmt: skip
        scalars = ("kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap")
        zeros = dict.fromkeys(scalars, 0.0)
        self.layout = FixedLayout(MESSAGES["State"](step=0, time_ns=0, motion=motion, **arrays, **zeros))
        views, regions = self.layout.views, self.layout.regions
        self.motion = Motion.of(views, "motion")
        self.fields = {name: views[name] for name in arrays}
        self._stamp_at, self._energies_at = regions["step"].offset, regions["kinetic_energy"].offset

    def encode(
        self,
        step: int,
        time_ns: int,
        *,
        kinetic_energy: float,
        potential_energy: float,
        external_work: float,
        dissipated_work: float,
        joint_gap: float,
    ) -> bytes:
        """Return the State at one communication point, with the present values of the arrays.

        Args:
            step: index of the communication point.
            time_ns: simulation time [ns].
            kinetic_energy: [J].
            potential_energy: of gravity and springs [J].
            external_work: done by the fluid and by force elements without a potential since t_0 [J].
            dissipated_work: taken by joint dampers since t_0 [J].
            joint_gap: largest distance of two joint points, from the poses [m].
        """
        buffer = self.layout.buffer
        _STAMP.pack_into(buffer, self._stamp_at, step, 0x11, time_ns)
        _ENERGIES.pack_into(
            buffer, self._energies_at, kinetic_energy,
            0x51, potential_energy, 0x59, external_work, 0x61, dissipated_work, 0x69, joint_gap,
        )  # fmt: skip
        return bytes(buffer)


class StepEncoder:
    """Encodes what the coupling did, one message an exchange.

    Args:
        order: largest degree of the extrapolation in the run.
    """

    def __init__(self, order: int) -> None:
        count = order + 1
        errors = [math.nan] * count
        self._message = struct.Struct(f"<BQBQBIBIBB{count}dBdBd")  # with all tags, and the length of field 5
        self._length = 8 * count
        self._unknown = tuple(tuple(errors[known:]) for known in range(count + 1))

    def encode(
        self,
        step: int,
        time_ns: int,
        *,
        iteration: int,
        order: int,
        extrapolation_error: Sequence[float],
        residual: float,
        interface_energy: float,
    ) -> bytes:
        """Return the Step of one exchange.

        Args:
            step: index of the communication point.
            time_ns: simulation time [ns].
            iteration: coupling iteration, from 0.
            order: degree of the extrapolation that gave the trial state.
            extrapolation_error: E_0 … E_p by degree, at most as many as the largest order allows; degrees
                that could not be estimated are NaN in the message.
            residual: trial against accepted twist, weighted by mass [J^½].
            interface_energy: step size times the power of the wrench on that difference [J].
        """
        errors = *extrapolation_error, *self._unknown[len(extrapolation_error)]
        return self._message.pack(
            0x09, step, 0x11, time_ns, 0x1D, iteration, 0x25, order, 0x2A, self._length, *errors,
            0x31, residual, 0x39, interface_energy,
        )  # fmt: skip


def step_layout(order: int) -> FixedLayout:
    """Return the message of :class:`StepEncoder` with a place for every number, for the native library."""
    fields = {"iteration": 0, "order": 0, "extrapolation_error": [0.0] * (order + 1)}
    return FixedLayout(MESSAGES["Step"](step=0, time_ns=0, residual=0.0, interface_energy=0.0, **fields))


class TimingEncoder:
    """Encodes wall-clock times, one message an exchange; they are never part of a result."""

    def __init__(self) -> None:
        self._layout = FixedLayout(MESSAGES["Timing"](step=0, exchange_ns=0))
        self._step, self._exchange_ns = self._layout.views["step"], self._layout.views["exchange_ns"]

    def encode(self, step: int, exchange_ns: int) -> bytes:
        """Return the Timing of one exchange: ``exchange_ns`` from putting the motion to every wrench."""
        self._step[0], self._exchange_ns[0] = step, exchange_ns
        return self._layout.payload()
