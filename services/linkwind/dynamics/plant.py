"""The mechanism as the coupling sees it: a state that advances by one macro step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from linkwind.coupling import Met
from linkwind.dynamics.methods import multibody
from linkwind.errors import SimulationError
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import NOT_YET, ORDERED, Integrator
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion


class State(NamedTuple):
    """A mechanism at a communication point.

    Attributes:
        step: index of the communication point.
        values: coordinates, velocities, the integrator's memory and times of events, shape (state_size,).
        external_work: done by the fluid and by force elements without a potential since t_0 [J].
        dissipated_work: taken by joint dampers since t_0 [J].
    """

    step: int
    values: Array
    external_work: float
    dissipated_work: float


class MechanismPlant:
    """A mechanism with its integrator (:class:`linkwind.coupling.Plant`).

    Attributes:
        initial: the state at t_0.
        multibody: the mechanism.
        orders: communication points after which events, by number, happen at once.
    """

    def __init__(self, mechanism: Mechanism, scenario: Scenario, where: Callable[[], str]) -> None:
        """Make the plant of ``scenario``; ``where`` tells the step and time of an error."""
        self._where = where
        self._step_ns = scenario.coupling.step_ns
        self._step = self._step_ns / 1e9
        self.change(mechanism, scenario)
        self.initial = State(0, self.multibody.initial_state(mechanism.q0, mechanism.v0), 0.0, 0.0)
        self._motion = Motion.at_rest(self.multibody.n)
        self.orders: dict[int, int] = {}

    def order(self, event: int, step: int) -> None:
        """Let an event, by its number, happen at the start behind communication point ``step``."""
        self.orders.setdefault(event, step)

    def _begin(self, state: State) -> Array:
        """Return the values to advance from: those of the state, with what is ordered for it."""
        if not self.orders:
            return state.values
        due = [event for event, step in self.orders.items() if step == state.step]
        if not due:
            return state.values
        values = state.values.copy()
        times = values[len(values) - self.multibody.events :]
        for event in due:
            if times[event] == NOT_YET:
                times[event] = ORDERED
        return values

    def change(self, mechanism: Mechanism, scenario: Scenario) -> None:
        """Go on under the settings of another scenario with the same bodies, joints and steps."""
        self.multibody = multibody(mechanism, scenario)
        dynamics = scenario.dynamics
        self._how: dict[str, Any] = {
            "integrator": Integrator[dynamics.integrator.upper()],
            "substeps": dynamics.substeps,
            "rtol": dynamics.rtol,
            "atol": dynamics.atol,
        }

    def advance(self, state: State, nodes: Array, wrenches: Array, added_inertia: Array | None) -> State:
        """Return the state one macro step later; see :class:`linkwind.coupling.Plant`."""
        try:
            values, work = self.multibody.advance(
                self._begin(state),
                self._step,
                nodes,
                wrenches,
                added_inertia,
                time=self._time(state),
                **self._how,
            )
        except SimulationError as error:
            raise self._located(error) from error
        return _later(state, values, work)

    def meet(
        self,
        state: State,
        nodes: Array,
        wrenches: Array,
        added_inertia: Array | None,
        response: Array,
        about: Array,
    ) -> Met:
        """Advance under an affine wrench; see :class:`linkwind.coupling.Plant`."""
        try:
            values, work, affine = self.multibody.advance_affine(
                self._begin(state),
                self._step,
                nodes,
                wrenches,
                added_inertia,
                response,
                about,
                time=self._time(state),
                **self._how,
            )
        except SimulationError as error:
            raise self._located(error) from error
        return Met(_later(state, values, work), *affine)

    def twist(self, state: State) -> Array:
        """Return the twists of the bodies, shape (n, 6), linear first, in W."""
        self.multibody.motion(state.values, self._motion)
        twist = np.empty((self.multibody.n, 6))
        twist[:, :3], twist[:, 3:] = self._motion.linear, self._motion.angular
        return twist

    def inertia(self, state: State, added_inertia: Array | None, response: Array) -> Array:
        """Return what a response amounts to as inertia; see :class:`linkwind.coupling.Plant`."""
        return self.multibody.affine_inertia(state.values, added_inertia, response, self._step)

    def _time(self, state: State) -> float:
        """Return the simulation time at a state [s]: a multiple of the step, never a sum."""
        return state.step * self._step_ns / 1e9

    def _located(self, error: SimulationError) -> SimulationError:
        return SimulationError(f"dynamics: after the exchange of {self._where()}: {error}")


def _later(state: State, values: Array, work: Array) -> State:
    external, dissipated = work.tolist()
    return State(state.step + 1, values, state.external_work + external, state.dissipated_work + dissipated)


def acceleration_weight(mechanism: Mechanism) -> Array:
    """Return 1/mass and 1/(mean principal inertia) of the bodies [1/kg, 1/(kg·m²)], shape (n, 6).

    Massless bodies count with the lightest mass that there is.
    """
    tables = mechanism.tables
    mass = tables.mass
    inertia = tables.inertia[:, :3].mean(axis=1)
    weight = np.empty((len(mass), 6))
    for columns, values in ((slice(0, 3), mass), (slice(3, 6), inertia)):
        positive = values[values > 0.0]
        floor = positive.min() if len(positive) else 1.0
        weight[:, columns] = (1.0 / np.maximum(values, floor))[:, None]
    return weight
