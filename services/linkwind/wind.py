"""The wind of a scenario at any time and place: a uniform stream, functions, and travelling gusts."""

from __future__ import annotations

import math

import numpy as np

from linkwind.errors import SimulationError
from linkwind.expression import compile_program, law
from linkwind.native.wind import GUST_SHAPES, VARIABLES, Sampler, WindTable
from linkwind.scenario import Environment, Scenario
from linkwind.spatial import Array

COMPONENTS = ("wind[0]", "wind[1]", "wind[2]")  # as errors call them
STILL = np.zeros(3)


def wind_table(environment: Environment, source: str) -> WindTable:
    """Return the wind as a table for the native library: SI units, phases in radians.

    wind(t, r) = U0 + u(t, r) + Σ amplitude · shape(2π(frequency · t + wavenumber · r) + phase)

    Args:
        environment: with the wind.
        source: what errors call the scenario.

    Raises:
        ExpressionError: an expression is wrong.
    """
    gusts = [
        (
            *gust.amplitude,
            gust.frequency,
            *gust.wavenumber,
            math.radians(gust.phase_deg),
            GUST_SHAPES[gust.shape],
        )
        for gust in environment.gusts
    ]
    program = compile_program(
        None,
        {COMPONENTS[i]: law(function) for i, function in environment.wind_functions.items()},
        f"{source}: environment",
        variables=VARIABLES,
        components=COMPONENTS,
        inputs=inputs(environment),
    )
    return WindTable(
        uniform=np.array(environment.uniform_wind),
        gusts=np.array(gusts, dtype=np.float64).reshape(-1, 9),
        code=np.array(program.code, dtype=np.int32).reshape(-1, 2),
        constants=np.array(program.constants, dtype=np.float64),
        inputs=program.inputs,
    )


def inputs(environment: Environment) -> dict[str, float]:
    """Return the inputs of the wind with their values, in the order of the table's constants."""
    return dict(sorted((environment.inputs or {}).items()))


class Wind:
    """The wind of a scenario, the same bits as the force models in C have.

    >>> wind = linkwind.Wind(scenario)
    >>> wind.velocity(t, motion.position) - motion.linear  # the air that the bodies meet
    """

    def __init__(self, scenario: Scenario) -> None:
        """Read the wind.

        Raises:
            ExpressionError: an expression is wrong.
        """
        self._source = scenario.source
        self._at = Sampler(wind_table(scenario.environment, scenario.source))

    def velocity(self, t: Array | float, points: Array) -> Array:
        """Return the velocity of the wind.

        Args:
            t: time [s], of all points or of each, shape (…).
            points: [m], shape (…, 3), in W.

        Returns:
            [m/s], shape (…, 3), in W.

        Raises:
            SimulationError: it is not finite.
        """
        velocity, _ = self._at(t, points, STILL)
        if not np.isfinite(velocity).all():
            self._refuse(t, points, STILL, velocity, "velocity")
        return velocity

    def rate(self, t: Array | float, points: Array, velocities: Array) -> Array:
        """Return how fast the wind changes for observers who pass points, ∂U/∂t + (v·∇)U.

        Args:
            t: time [s], of all points or of each, shape (…).
            points: [m], shape (…, 3), in W.
            velocities: of the observers [m/s], shape (…, 3), in W.

        Returns:
            [m/s²], shape (…, 3), in W.

        Raises:
            SimulationError: it is not finite.
        """
        _, rate = self._at(t, points, velocities)
        if not np.isfinite(rate).all():
            self._refuse(t, points, velocities, rate, "rate of change")
        return rate

    def _refuse(self, t: Array | float, points: Array, velocities: Array, found: Array, what: str) -> None:
        """Raise an error about the first number that is not finite."""
        *at, component = (int(index[0]) for index in np.nonzero(~np.isfinite(found)))
        time = float(np.broadcast_to(t, found.shape[:-1])[tuple(at)])
        x, y, z = np.asarray(points)[tuple(at)].tolist()
        speed = np.broadcast_to(velocities, found.shape)[tuple(at)].tolist()
        passed = f", passed with {speed} m/s" if what != "velocity" else ""
        place = f"t = {time:.9g} s, x = {x:.9g}, y = {y:.9g}, z = {z:.9g} m{passed}"
        raise SimulationError(
            f"{self._source}: environment.{COMPONENTS[component]}: expected a finite {what} at {place}; got "
            f"{found[(*at, component)]:.9g}. Does it divide by zero, or leave a function's domain?"
        )
