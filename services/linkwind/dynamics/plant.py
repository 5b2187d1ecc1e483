"""The mechanism as the coupling sees it: a state that advances by one macro step."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from linkwind.errors import SimulationError
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import Integrator, Multibody
from linkwind.scenario import Scenario
from linkwind.spatial import Array


class State(NamedTuple):
    """A mechanism at a communication point.

    Attributes:
        values: joint coordinates, joint velocities and the integrator's memory, shape (state_size,).
        external_work: done by the fluid since t_0 [J].
        dissipated_work: taken by joint dampers since t_0 [J].
    """

    values: Array
    external_work: float
    dissipated_work: float


class MechanismPlant:
    """A mechanism with its integrator (:class:`linkwind.coupling.Plant`)."""

    def __init__(self, mechanism: Mechanism, scenario: Scenario, where: Callable[[], str]) -> None:
        """Make the plant of ``scenario``; ``where`` tells the step and time of an error."""
        self.multibody = Multibody(mechanism.tables, mechanism.bodies)
        self._where = where
        self.initial = State(self.multibody.initial_state(mechanism.q0, mechanism.v0), 0.0, 0.0)
        self._step = scenario.coupling.step_ns / 1e9
        self._integrator = Integrator[scenario.dynamics.integrator.upper()]
        self._dynamics = scenario.dynamics

    def advance(self, state: State, nodes: Array, wrenches: Array, added_inertia: Array | None) -> State:
        """Return the state one macro step later; see :class:`linkwind.coupling.Plant`."""
        try:
            values, work = self.multibody.advance(
                state.values,
                self._step,
                nodes,
                wrenches,
                added_inertia,
                integrator=self._integrator,
                substeps=self._dynamics.substeps,
                rtol=self._dynamics.rtol,
                atol=self._dynamics.atol,
            )
        except SimulationError as error:
            raise SimulationError(f"dynamics: after the exchange of {self._where()}: {error}") from error
        external, dissipated = work.tolist()
        return State(values, state.external_work + external, state.dissipated_work + dissipated)
