"""A force field given as expressions of time and of each body's motion."""

from __future__ import annotations

import math

import numpy as np

from linkwind.aero.base import Capabilities, body_indices, item
from linkwind.errors import ProtocolError, SimulationError
from linkwind.expression import Program, compile_program
from linkwind.native.forces import COMPONENTS, VARIABLES, Field, FieldTable
from linkwind.scenario import FieldExpressions, Provider, Scenario
from linkwind.scenario.topology import carries
from linkwind.spatial import Array, Motion, Wrench


def field_table(scenario: Scenario, provider: Provider) -> FieldTable:
    """Return the programs of a provider's bodies; a body without a table has an empty one.

    Raises:
        ExpressionError: an expression is wrong.
    """
    programs = []
    for name in provider.bodies:
        expressions = provider.field.get(name)
        where = item(scenario, provider, "field", name)
        programs.append(_program(expressions, where) if expressions else Program((), ()))
    return _join(programs, body_indices(scenario, provider))


def _program(expressions: FieldExpressions, where: str) -> Program:
    results = {component: getattr(expressions, component) for component in COMPONENTS}
    return compile_program(expressions.let, results, where, variables=VARIABLES, components=COMPONENTS)


def _join(programs: list[Program], bodies: list[int]) -> FieldTable:
    """Return one table of all programs, each program's constants shifted behind those before it."""
    start, code, constants = [0], list[tuple[int, int]](), list[float]()
    for program in programs:
        code += program.shifted(len(constants))
        constants += program.constants
        start.append(len(code))
    return FieldTable(
        body=np.array(bodies, dtype=np.int32),
        start=np.array(start, dtype=np.int32),
        code=np.array(code, dtype=np.int32).reshape(-1, 2),
        constants=np.array(constants, dtype=np.float64),
    )


def initial_angles(scenario: Scenario, provider: Provider) -> Array:
    """Return about which angles [rad] the first ones are unwrapped, shape (n,).

    A body without an angle of its own starts near its parent's; one given by a quaternion near zero.
    """
    bodies = {body.name: body for body in scenario.bodies}
    carrying = carries((joint.type, joint.parent, joint.child) for joint in scenario.joints)
    joints = zip(scenario.joints, carrying, strict=True)
    parents = {joint.child: joint.parent for joint, free in joints if free}

    def angle(name: str) -> float:
        body = bodies.get(name)  # none for the world
        if body is None or body.orientation is not None:
            return 0.0
        if body.angle_deg is not None:
            return math.radians(body.angle_deg)
        return angle(parents.get(name, "world"))

    return np.array([angle(name) for name in provider.bodies])


class ForceField:
    """Forces that expressions state; its memory is the number of turns that each body has made.

    The wrench [N, N·m] is in W at the centre of mass. ``theta`` is the angle from the world's x axis to the
    body's, about z, and stays continuous as long as a body turns by less than half a turn in a step.
    """

    capabilities = Capabilities()

    def __init__(self, scenario: Scenario, provider: Provider) -> None:
        self.forces = Field(field_table(scenario, provider), initial_angles(scenario, provider))
        self._items = [item(scenario, provider, "field", name) for name in provider.bodies]

    def commit(self, t: float, motion: Motion) -> None:
        """Unwrap angles against this state from now on."""
        self.forces.commit(motion)

    def evaluate(self, t: float, motion: Motion, wrench: Wrench) -> None:
        """Write the values of the expressions for the state at time t [s].

        Raises:
            SimulationError: a value is not finite.
        """
        status = self.forces.evaluate(t, motion, wrench)
        if status:
            raise self._not_finite(*divmod(status - 1, 6), t, motion, wrench)

    def _not_finite(
        self, i: int, component: int, t: float, motion: Motion, wrench: Wrench
    ) -> SimulationError:
        value = (*wrench.force[i], *wrench.torque[i])[component]
        variables = self.forces.variables(i, t, motion).items()
        state = ", ".join(f"{name} = {x:.9g}" for name, x in variables if name != "t")
        return SimulationError(
            f"{self._items[i]}.{COMPONENTS[component]}: expected a finite number at t = {t:.9g} s; got "
            f"{value:.9g} at {state}. Does it divide by zero, or leave a function's domain?"
        )

    def save(self) -> bytes:
        """Return the angles of the last accepted state, as little-endian float64."""
        return self.forces.theta.astype("<f8").tobytes()

    def restore(self, blob: bytes) -> None:
        """Take back the angles that ``save`` returned.

        Raises:
            ProtocolError: the blob has another size.
        """
        theta = self.forces.theta
        if len(blob) != theta.nbytes:
            raise ProtocolError(
                f"model field: expected a checkpoint of {theta.nbytes} bytes; got {len(blob)}."
            )
        theta[:] = np.frombuffer(blob, dtype="<f8")
