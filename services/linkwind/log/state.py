"""Encoders of the messages that only the log carries: State, Step and Timing.

Each owns one message of fixed layout (``linkwind.wire``), so that encoding is a few numpy copies. The
schema, with units and frames, is ``schemas/linkwind/v1/log.proto``.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

from linkwind.schema import MESSAGES
from linkwind.spatial import Array, Motion
from linkwind.wire import FixedLayout

# Fields 9 to 13 of State, one double each, with the tags between them (field number · 8 + wire type 1):
# packing them in one go takes a third of the time of five numpy views.
ENERGIES = struct.Struct("<dBdBdBdBd")


class StateEncoder:
    """Encodes the accepted trajectory, one message a communication point.

    Args:
        n: number of bodies.
        nq: number of joint coordinates.
        nv: number of joint velocities.
        closures: number of joints that close loops.
        events: number of things that may happen to joints.
        forces: number of force elements.
    """

    def __init__(self, n: int, nq: int, nv: int, closures: int = 0, events: int = 0, forces: int = 0) -> None:
        six = [0.0] * (6 * n)
        motion = {"position": six[: 3 * n], "orientation": six[: 4 * n]}
        motion |= {"linear": six[: 3 * n], "angular": six[: 3 * n]}
        scalars = ("kinetic_energy", "potential_energy", "external_work", "dissipated_work", "joint_gap")
        self._layout = FixedLayout(
            MESSAGES["State"](
                step=0, time_ns=0, motion=motion, q=[0.0] * nq, v=[0.0] * nv,
                acceleration=six, reaction=six, wrench=six, closure_reaction=[0.0] * (6 * closures),
                event_time=[0.0] * events, force_effort=[0.0] * forces, force_power=[0.0] * forces,
                **dict.fromkeys(scalars, 0.0),
            )
        )  # fmt: skip
        views = self._layout.views
        self._step, self._time_ns = views["step"], views["time_ns"]
        self._position = views["motion.position"].reshape(n, 3)
        self._orientation = views["motion.orientation"].reshape(n, 4)
        self._linear = views["motion.linear"].reshape(n, 3)
        self._angular = views["motion.angular"].reshape(n, 3)
        self._q, self._v = views["q"], views["v"]
        self._acceleration = views["acceleration"].reshape(n, 6)
        self._reaction = views["reaction"].reshape(n, 6)
        self._wrench = views["wrench"].reshape(n, 6)
        self._closure_reaction = views["closure_reaction"].reshape(closures, 6)
        self._event_time = views["event_time"]
        self._force_effort, self._force_power = views["force_effort"], views["force_power"]
        self._energies = self._layout.regions["kinetic_energy"].offset

    def encode(
        self,
        step: int,
        time_ns: int,
        motion: Motion,
        *,
        q: Array,
        v: Array,
        acceleration: Array,
        reaction: Array,
        wrench: Array,
        kinetic_energy: float,
        potential_energy: float,
        external_work: float,
        dissipated_work: float,
        joint_gap: float,
        closure_reaction: Array | None = None,
        event_time: Array | None = None,
        force_effort: Array | None = None,
        force_power: Array | None = None,
    ) -> bytes:
        """Return the State at one communication point.

        Args:
            step: index of the communication point.
            time_ns: simulation time [ns].
            motion: accepted poses and twists, in W at the centres of mass.
            q: joint coordinates, shape (nq,).
            v: joint velocities, shape (nv,).
            acceleration: of the bodies [m/s², rad/s²], shape (n, 6), linear first, in W.
            reaction: of the joint of each body, parent on child [N, N·m], shape (n, 6), force first, in W
                at the joint's point on the child.
            wrench: total on each body, with the part of A [N, N·m], shape (n, 6), force first, in W.
            kinetic_energy: [J].
            potential_energy: of gravity and springs [J].
            external_work: done by the fluid and by force elements without a potential since t_0 [J].
            dissipated_work: taken by joint dampers since t_0 [J].
            joint_gap: largest distance of two joint points, from the poses [m].
            closure_reaction: of the joints that close loops, as ``reaction``, shape (closures, 6).
            event_time: when each event happened [s], -1 for not yet, shape (events,).
            force_effort: of force elements [N or N·m], shape (forces,).
            force_power: that they give to the bodies [W], shape (forces,).
        """
        self._step[0] = step
        self._time_ns[0] = time_ns
        self._position[...] = motion.position
        self._orientation[...] = motion.orientation
        self._linear[...] = motion.linear
        self._angular[...] = motion.angular
        self._q[:], self._v[...] = q, v
        self._acceleration[...] = acceleration
        self._reaction[...] = reaction
        self._wrench[...] = wrench
        if closure_reaction is not None:
            self._closure_reaction[...] = closure_reaction
        if event_time is not None:
            self._event_time[...] = event_time
        if force_effort is not None and force_power is not None:
            self._force_effort[...], self._force_power[...] = force_effort, force_power
        ENERGIES.pack_into(
            self._layout.buffer, self._energies, kinetic_energy,
            0x51, potential_energy, 0x59, external_work, 0x61, dissipated_work, 0x69, joint_gap,
        )  # fmt: skip
        return self._layout.payload()


class StepEncoder:
    """Encodes what the coupling did, one message an exchange.

    Args:
        order: largest degree of the extrapolation in the run.
    """

    def __init__(self, order: int) -> None:
        errors = [math.nan] * (order + 1)
        self._layout = FixedLayout(
            MESSAGES["Step"](
                step=0,
                time_ns=0,
                iteration=0,
                order=0,
                extrapolation_error=errors,
                residual=0.0,
                interface_energy=0.0,
            )
        )
        self._views = self._layout.views

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
        views = self._views
        views["step"][0], views["time_ns"][0] = step, time_ns
        views["iteration"][0], views["order"][0] = iteration, order
        errors = views["extrapolation_error"]
        errors[:] = math.nan
        errors[: len(extrapolation_error)] = extrapolation_error
        views["residual"][0] = residual
        views["interface_energy"][0] = interface_energy
        return self._layout.payload()


class TimingEncoder:
    """Encodes wall-clock times, one message an exchange; they are never part of a result."""

    def __init__(self) -> None:
        self._layout = FixedLayout(MESSAGES["Timing"](step=0, exchange_ns=0))
        self._step, self._exchange_ns = self._layout.views["step"], self._layout.views["exchange_ns"]

    def encode(self, step: int, exchange_ns: int) -> bytes:
        """Return the Timing of one exchange: ``exchange_ns`` from putting the motion to every wrench."""
        self._step[0], self._exchange_ns[0] = step, exchange_ns
        return self._layout.payload()
