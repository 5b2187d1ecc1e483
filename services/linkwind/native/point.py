"""An accepted state as it is written: evaluated once, straight into the memory of a message."""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from linkwind.native.faults import fail
from linkwind.native.library import declare
from linkwind.native.multibody import Multibody
from linkwind.spatial import Array, Motion, address

_point = declare("lw_multibody_point", [ctypes.c_void_p] * 2)
_layout = struct.Struct("@PPdPP8Pi15P")
_TIME, _ADDED = 16, 32  # where these stand in it
# Arrays that are written, in the order of lw_point.
_OUT = ("q", "v", "acceleration", "reaction", "wrench", "closure_reaction", "force_effort", "force_power",
        "event_time")  # fmt: skip


class Measures(NamedTuple):
    """Numbers of an accepted state.

    Attributes:
        kinetic_energy: [J].
        potential_energy: of gravity and springs [J].
        joint_gap: largest distance of two joint points, from the poses [m].
        force: largest total force on a body [N].
        missed: accepted minus trial twist, squared, by mass and mean principal inertia [J].
        lost: power of the wrench on that difference [W].
    """

    kinetic_energy: float
    potential_energy: float
    joint_gap: float
    force: float
    missed: float
    lost: float


class AcceptedPoint:
    """Evaluates accepted states of a mechanism into arrays that do not move.

    Attributes:
        force: the last one's total on every body [N], shape (n, 3), in W.
        at: address of the ``lw_point``.
    """

    def __init__(self, multibody: Multibody, motion: Motion, fields: Mapping[str, Array]) -> None:
        """Write into these arrays from now on, which may be views into a message.

        Args:
            multibody: the mechanism.
            motion: takes poses and twists.
            fields: take the other results, flat, by their names in ``linkwind.v1.State``.
        """
        self._multibody = multibody
        n = multibody.n
        self._values = np.zeros((2, multibody.state_size))
        self._state, self._trial = self._values
        self._wrench, self._added, self._difference = np.zeros((n, 6)), np.zeros((n, 6, 6)), np.zeros((n, 6))
        self._measures = np.zeros(len(Measures._fields))
        self._kept = motion, fields  # alive as long as their addresses are used
        results = multibody.results
        self.force = results.total_wrench[:, :3]
        self._added_at = address(self._added)
        self._struct = ctypes.create_string_buffer(_layout.size)
        self.at = ctypes.addressof(self._struct)
        _layout.pack_into(
            self._struct, 0, address(self._state), address(self._trial), 0.0, address(self._wrench), 0,
            *map(address, results), address(self._difference), multibody.closures, *motion.addresses,
            *(address(fields[name]) for name in _OUT), address(self._measures), multibody._fault_at,
        )  # fmt: skip

    def evaluate(
        self, state: Array, trial: Array, wrench: Array, added_inertia: Array | None, time: float
    ) -> Measures:
        """Evaluate one state and write it.

        Args:
            state: shape (state_size,).
            trial: state that the wrench was asked for.
            wrench: [N, N·m], shape (n, 6), force first, in W.
            added_inertia: shape (n, 6, 6), in the body frames; None for none.
            time: [s].

        Raises:
            SimulationError: singular inertia, NaN or infinity.
        """
        self._state[:] = state
        self._trial[:] = trial
        self._wrench[:] = wrench
        added_at = 0
        if added_inertia is not None:
            self._added[:] = added_inertia
            added_at = self._added_at
        struct.pack_into("@d", self._struct, _TIME, time)
        struct.pack_into("@P", self._struct, _ADDED, added_at)
        if status := _point(self._multibody._model, self.at):
            fail(status, self._multibody._fault, self._multibody._names, {})
        return Measures._make(self._measures.tolist())
