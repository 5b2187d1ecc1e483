"""The constraint force equation: bodies in coordinates of their own, joints as forces between them.

The equations are in ``fmu/README.md``, section Baselines. It gives the same motion as joint coordinates do,
but for the drift of its joints, and is there to be compared with.
"""

from __future__ import annotations

import ctypes
import enum
from collections.abc import Sequence

import numpy as np

from linkwind.errors import MechanismError
from linkwind.native.library import declare
from linkwind.native.multibody import (
    ACTIONS,
    FORCE_TYPES,
    JOINT_TYPES,
    OCCASIONS,
    Multibody,
    Tables,
)
from linkwind.spatial import Array, address

_pointer = ctypes.c_void_p
_size = declare("lw_maximal_size", [_pointer], ctypes.c_size_t)
_attach = declare("lw_maximal_attach", [_pointer] * 3 + [ctypes.c_int32, ctypes.c_double], None)
_start = declare("lw_maximal_start", [_pointer] * 3, None)
_coordinates = declare("lw_maximal_coordinates", [_pointer] * 4, None)
_PLACES = [OCCASIONS[name] for name in ("position", "speed", "distance")]  # no forces are needed for these
_TURNING = (JOINT_TYPES["revolute"], JOINT_TYPES["planar"])


class Stabilisation(enum.IntEnum):
    """What is done about the drift of the joints."""

    NONE = 0
    BAUMGARTE = 1
    PROJECTION = 2


class Cfe(Multibody):
    """A mechanism whose state is the poses and twists of its bodies, and whose joints are forces.

    A state is position and orientation of each body, then the angle of each revolute and planar joint, which
    the poses tell up to whole turns; then velocity, in W, and angular velocity, in the body's frame, of each
    body; then the integrator's memory, and when events happened. ``nq`` and ``nv`` are those of the state.
    """

    def __init__(
        self,
        tables: Tables,
        bodies: Sequence[str] = (),
        closures: Sequence[str] = (),
        events: Sequence[str] = (),
        forces: Sequence[str] = (),
        *,
        stabilisation: Stabilisation,
        time: float,
    ) -> None:
        """Build the mechanism.

        Args:
            tables: the mechanism, as for ``Multibody``; every body needs mass and inertia, or added inertia.
            bodies: names of the bodies, for errors; their numbers if not given.
            closures: likewise of the joints that close loops.
            events: likewise of what may happen.
            forces: likewise of the force elements.
            stabilisation: of the joints.
            time: in which Baumgarte's method undoes what a joint is open [s]: it goes back as exp(-t/time).

        Raises:
            MechanismError: a table has a wrong shape or a wrong value, a motion is prescribed, or an event is
                no release.
        """
        self.tree = Multibody(tables, bodies, closures, events, forces)
        _check_events(self.tree)
        _check_motions(self.tree)
        super().__init__(_free(tables))
        self._names, self.closures = self.tree._names, self.tree.closures
        self._make_room()
        self._joints = np.zeros((_size(self.tree._model) + 7) // 8)
        _attach(address(self._joints), self._model, self.tree._model, stabilisation, time)

    def initial_state(self, q: Array, v: Array) -> Array:
        """Return the state that joint coordinates ``q`` and velocities ``v`` of the mechanism mean."""
        tree = self.tree.initial_state(q, v)
        state = np.zeros(self.state_size)
        _start(self._model, address(tree), address(state))
        return state

    def coordinates(self, state: Array) -> tuple[Array, Array]:
        """Return the joint coordinates and velocities of the mechanism, from the poses and twists."""
        q, v = np.zeros(self.tree.nq), np.zeros(self.tree.nv)
        self._take(state)
        _coordinates(self._model, self._state_at, address(q), address(v))
        return q, v


def _check_events(tree: Multibody) -> None:
    for i in map(int, np.flatnonzero(tree.tables.event_action != ACTIONS["release"])):
        raise MechanismError(
            f"event {tree._names.events[i]}: expected a release, which is all that method cfe knows; got "
            "a lock or a stop. Use reduced."
        )


def _check_motions(tree: Multibody) -> None:
    for i in map(int, np.flatnonzero(tree.tables.force_type == FORCE_TYPES["motion"])):
        raise MechanismError(
            f"force {tree._names.forces[i]}: expected a spring, an actuator, a point force or buoyancy, "
            "which is what method cfe knows; got a motion. Use reduced."
        )


def _free(tables: Tables) -> Tables:
    """Return the tables of the same bodies without their joints, and with room for the joints' angles."""
    n = len(tables.parent)
    identity, origin = np.tile(np.eye(3), (n, 1, 1)), np.zeros((n, 3))
    angles = int(np.isin(tables.joint_type, _TURNING).sum())
    return Tables(
        parent=np.full(n, -1, np.int32),
        order=tables.order,
        joint_type=np.full(n, JOINT_TYPES["free"], np.int32),
        q_index=np.arange(0, 7 * n, 7, dtype=np.int32),
        v_index=np.arange(0, 6 * n, 6, dtype=np.int32),
        parent_point=origin,
        parent_rotation=identity,
        child_point=origin,
        child_rotation=identity,
        mass=tables.mass,
        inertia=tables.inertia,
        gravity=tables.gravity,
        stiffness=np.zeros(6 * n),
        damping=np.zeros(6 * n),
        # What an event waits for is asked of the tree; of the bodies' own joints, nothing changes.
        event_joint=np.zeros_like(tables.event_joint),
        event_action=tables.event_action,
        event_occasion=np.where(
            np.isin(tables.event_occasion, _PLACES), OCCASIONS["time"], tables.event_occasion
        ),
        event_side=tables.event_side,
        event_threshold=tables.event_threshold,
        event_restitution=tables.event_restitution,
        rest=np.concatenate([np.tile([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], n), np.zeros(angles)]),
        force_type=tables.force_type,
        force_body=tables.force_body,
        force_point=tables.force_point,
        force_number=tables.force_number,
        force_start=tables.force_start,
        force_code=tables.force_code,
        force_constants=tables.force_constants,
        force_input=tables.force_input,
    )
