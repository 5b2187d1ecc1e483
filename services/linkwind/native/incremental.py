"""The equations of Rahmati & Karimi 2021, Eqs. 6-9, doi:10.3390/app11031136, for any number of hinged links.

The equations are in ``fmu/README.md``, section Baselines; they are there to be compared with.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence

import numpy as np

from linkwind.errors import MechanismError
from linkwind.native.library import declare
from linkwind.native.multibody import JOINT_TYPES, Multibody, Tables
from linkwind.spatial import address

_size = declare("lw_incremental_size", [ctypes.c_void_p], ctypes.c_size_t)
_attach = declare("lw_incremental_attach", [ctypes.c_void_p] * 2, ctypes.c_int32)


class Incremental(Multibody):
    """A mechanism in the plane whose accelerations come from the paper's equations.

    State, motion and energy are those of ``Multibody``; the paper's increments of the velocities are what its
    integrators ``EULER`` and ``SEMI_IMPLICIT_EULER`` make of these accelerations.
    """

    def __init__(
        self,
        tables: Tables,
        bodies: Sequence[str] = (),
        closures: Sequence[str] = (),
        events: Sequence[str] = (),
        forces: Sequence[str] = (),
    ) -> None:
        """Build the mechanism.

        Args:
            tables: the mechanism, as for ``Multibody``.
            bodies: names of the bodies, for errors; their numbers if not given.
            closures: likewise of the joints that close loops.
            events: likewise of what may happen.
            forces: likewise of the force elements.

        Raises:
            MechanismError: a table has a wrong shape or a wrong value, or a joint that the paper does not
                have.
        """
        super().__init__(tables, bodies, closures, events, forces)
        names = self._names
        for kind, others in (("loop", names.closures), ("event", names.events), ("force", names.forces)):
            if others:
                raise MechanismError(
                    f"{kind} {others[0]}: expected none, for which the method incremental has no equation; "
                    "got one. Use reduced or cfe."
                )
        self._equations = np.zeros((_size(self._model) + 7) // 8)
        body = _attach(address(self._equations), self._model)
        if body >= 0:
            kind = next(name for name, code in JOINT_TYPES.items() if code == tables.joint_type[body])
            raise MechanismError(
                f"joint of body {names.bodies[body]}: expected a hinge about z on another body, or a body "
                "free in the plane (planar, to the world, at its centre of mass), no spring, no damper: all "
                f"that the method incremental knows; got one of type {kind}. Use reduced or cfe."
            )
