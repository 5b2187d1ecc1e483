"""The quasi-steady flat plate: lift, drag, rotation and added mass from the motion at one instant.

Equations and sources are in ``fmu/README.md``, the arithmetic in ``fmu/aero/lw_plate.c``.
"""

from __future__ import annotations

import numpy as np

from linkwind.aero.base import Capabilities, body_indices
from linkwind.aero.planform import mean_chord, relative, thin
from linkwind.aero.section import curves
from linkwind.errors import ProtocolError, SimulationError
from linkwind.native.forces import Coefficients, Plates, PlateTable
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Motion, Wrench
from linkwind.wind import Wind, wind_table


def plate_table(scenario: Scenario, provider: Provider) -> PlateTable:
    """Return the constants of the plates and wings of a provider.

    Raises:
        ScenarioError: a body is neither plate nor wing.
    """
    shapes, plate = thin(scenario, provider), provider.plate
    tabulated = plate.table if plate.coefficients == "table" else None
    return PlateTable(
        body=np.array(body_indices(scenario, provider), dtype=np.int32),
        size=np.array([(mean_chord(shape), shape.span) for shape in shapes]),
        coefficients=Coefficients[plate.coefficients.upper()],
        density=scenario.environment.density,
        wind=wind_table(scenario.environment, scenario.source),
        strips=plate.strips,
        curves=np.zeros((3, 0)) if tabulated is None else curves(tabulated),
        planform=relative(shapes, plate.strips),
    )


class Plate:
    """Quasi-steady forces on the strips of flat plates and wings: blade elements.

    The wrench holds circulatory lift, drag, rotational terms and the velocity part of the added mass; the
    acceleration part is returned as added inertia: m = π ρ (c/2)² s along the normal, m (c/2)² / 8 about the
    span and m s² (1 - 1/N²) / 12 about the chord, for a plate of chord c and span s in N strips. A strip of a
    wing has its own mean chord and acts at its centre of area.

    Sources: H. Li, T. Goodwill, Z. J. Wang, L. Ristroph, J. Fluid Mech. 937, A6 (2022),
    doi:10.1017/jfm.2022.89 (``ristroph``); A. Andersen, U. Pesavento, Z. J. Wang, J. Fluid Mech. 541, 65
    (2005), doi:10.1017/S002211200500594X (``andersen``).
    """

    capabilities = Capabilities(added_inertia=True)

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        self.forces = Plates(plate_table(scenario, provider))
        self._scenario, self._bodies = scenario, provider.bodies

    def commit(self, t: float, motion: Motion) -> None:
        """Do nothing: the forces depend on the present alone."""

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Write the wrench on the plates for the state at time t [s].

        Raises:
            SimulationError: a wrench, or the wind that it comes from, is not finite.
        """
        status = self.forces.evaluate(t, motion, wrench)
        if status:
            raise self._not_finite(status - 1, t, motion)

    def _not_finite(self, plate: int, t: float, motion: Motion) -> SimulationError:
        if (place := self.forces.wind_fault(plate, t, motion)) is not None:
            wind = Wind(self._scenario)
            wind.velocity(t, place[:3])
            wind.rate(t, place[:3], place[3:])
        body = self.forces.table.body[plate]
        parts = (motion.position, motion.orientation, motion.linear, motion.angular)
        names = ("position", "orientation", "velocity", "angular velocity")
        state = ", ".join(f"{name} {part[body].tolist()}" for name, part in zip(names, parts, strict=True))
        return SimulationError(
            f'{self._scenario.source}: plate "{self._bodies[plate]}": expected a finite wrench at '
            f"t = {t:.9g} s; got another at {state}. Has the motion diverged? Try a smaller coupling.step."
        )

    def save(self) -> bytes:
        """Return nothing: there is no memory."""
        return b""

    def restore(self, blob: bytes) -> None:
        """Take back nothing."""
        if blob:
            raise ProtocolError(f"model plate: expected an empty checkpoint; got {len(blob)} bytes.")
