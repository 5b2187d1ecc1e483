"""No fluid: every wrench is zero."""

from __future__ import annotations

from linkwind.aero.base import Capabilities
from linkwind.errors import ProtocolError
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Motion, Wrench


class Vacuum:
    """The force model of a mechanism without a fluid."""

    capabilities = Capabilities()
    forces = None

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        pass

    def commit(self, t: float, motion: Motion) -> None:
        """Do nothing: there is no memory."""

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Write zero wrenches."""
        wrench.force[:] = 0.0
        wrench.torque[:] = 0.0

    def save(self) -> bytes:
        """Return nothing: there is no memory."""
        return b""

    def restore(self, blob: bytes) -> None:
        """Take back nothing."""
        if blob:
            raise ProtocolError(f"model none: expected an empty checkpoint; got {len(blob)} bytes.")
