"""What ends a run in the flow, each with where it is, what was expected, and what to change."""

from __future__ import annotations

from linkwind.aero.base import item
from linkwind.aero.flow.grid import FRINGE, MAX_SPEED, MAX_SUBSTEPS
from linkwind.errors import SimulationError
from linkwind.scenario import Body, Provider, Scenario
from linkwind.spatial import Array


class Refusals:
    """The errors of one provider's flow."""

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        self._scenario, self._provider = scenario, provider

    def _item(self, key: str) -> str:
        return item(self._scenario, self._provider, "flow", key)

    def outside(self, t: float, bodies: list[str]) -> SimulationError:
        """A marker of these bodies has come to the border of the window."""
        margin = FRINGE[self._provider.flow.dimensions] + 2
        return SimulationError(
            f"{self._item('window')}: t = {t:.6g} s: expected every body inside the window, {margin} "
            f"cells from its border; got {_named(bodies)} outside. Make the window larger: bodies "
            "drift apart, or start far from each other."
        )

    def overlap(self, t: float, bodies: list[str]) -> SimulationError:
        """A marker of these bodies lies on another."""
        what = "outlines" if self._provider.flow.dimensions == 2 else "surfaces"
        return SimulationError(
            f"{self._item('cells')}: t = {t:.6g} s: expected {what} at least a cell apart; got "
            f"{_named(bodies)} on another. Bodies that touch need a joint between them, or more cells."
        )

    def too_fast(self, fastest: float) -> SimulationError:
        """No lattice step is short enough for a speed [m/s]."""
        return SimulationError(
            f"{self._item('cells')}: expected bodies of at most {MAX_SUBSTEPS} lattice steps of {MAX_SPEED} "
            f"cells in a communication step; got {fastest:.4g} m/s. Has the motion diverged? Try a smaller "
            "coupling.step."
        )

    def too_fast_for_light(self, body: str, fastest: float, limit: float) -> SimulationError:
        """A body that needs the response goes faster than one lattice step allows, both in m/s."""
        step = self._scenario.coupling.step
        return SimulationError(
            f"{self._scenario.source}: coupling.step: expected bodies below {MAX_SPEED} cells a step, "
            f'{limit:.4g} m/s, because "{body}" is light and needs the response of a single lattice step; '
            f"got {fastest:.4g} m/s. Use at most {0.5 * step:.3g} s."
        )

    def lighter_than_inside(self, body: Body, least: float) -> SimulationError:
        """A free closed body has less mass than this [kg]."""
        index = [other.name for other in self._scenario.bodies].index(body.name)
        return SimulationError(
            f"{self._scenario.where('bodies', index)}.mass: expected at least {least:.3g} kg, for the fluid "
            f"inside a closed shape weighs on a free one that is lighter; got {body.mass:g} kg. Use fewer "
            "cells, or plates, which may be without mass."
        )

    def turned_by_inside(self, body: Body, inertia: float, least: float) -> SimulationError:
        """A free closed body has less inertia about some axis than this, both in kg·m²."""
        index = [other.name for other in self._scenario.bodies].index(body.name)
        return SimulationError(
            f"{self._scenario.where('bodies', index)}.inertia: expected at least {least:.3g} kg·m² about "
            "each axis, for the fluid inside a closed shape turns a free one that has less; got "
            f"{inertia:.3g} about one. Make it larger, as that of a solid body, or use fewer cells."
        )

    def unstable(self, t: float, force: Array) -> SimulationError:
        """A force is not finite."""
        return SimulationError(
            f"{self._item('cells')}: expected a finite force at t = {t:.6g} s; got {force.tolist()}: the "
            "fluid is unstable. Use a smaller coupling.step, more cells, or a longer start_time."
        )


def _named(bodies: list[str]) -> str:
    return " and ".join(f'"{name}"' for name in bodies)
