"""Flow around thin wings in three dimensions: vortex rings on the bodies, and the wakes that they shed."""

from linkwind.aero.vortex.model import Vortex

__all__ = ["Vortex"]
