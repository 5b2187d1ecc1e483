"""The flow around the bodies, in two dimensions, on a lattice that goes with them.

Lattice Boltzmann for the fluid, markers on the bodies that it follows exactly; nothing is meshed. ``grid``
turns metres into cells, ``outline`` bodies into markers, ``model`` steps. Equations and sources are in
``fmu/README.md``, the arithmetic in ``fmu/flow``.
"""

from linkwind.aero.flow.model import Flow

__all__ = ["Flow"]
