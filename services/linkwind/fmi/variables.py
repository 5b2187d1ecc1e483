"""What a variable of an FMU is; and the names by which tools find them.

Names follow the structured convention of FMI: what it belongs to, a dot, what it is. Vectors are in the
world W, at the centre of mass; units are SI. For a body ``link1``:

================= =========== ==================================================================
name              size        meaning
================= =========== ==================================================================
link1.F           3           force on the body [N]
link1.T           3           torque on the body about its centre of mass [N·m]
link1.A           6, 6        added inertia, in the body frame, force rows first: wrench −A·a
link1.r           3           position of the centre of mass [m]
link1.orientation 4           unit quaternion (w, x, y, z), body to world
link1.v, link1.w  3           velocity [m/s], angular velocity [rad/s]
link1.a           3           acceleration dv/dt [m/s²]
link1.alpha       3           angular acceleration dw/dt [rad/s²]
link1.mass        1           [kg]
link1.inertia     6           Ixx, Iyy, Izz, Ixy, Ixz, Iyz, body frame, about the centre of mass [kg·m²]
link1.length      1           chord of the plate, or mean one of the wing [m] (aero)
link1.span        1           span of it [m] (aero)
================= =========== ==================================================================

and for a joint ``hinge``:

================================ =========================================================================
name                             meaning
================================ =========================================================================
hinge.q, hinge.v                 coordinates and velocities; a revolute or prismatic joint has one of each,
                                 a spherical one a quaternion and an angular velocity
der(hinge.q), der(hinge.v)       their derivatives
hinge.F, hinge.T                 reaction of parent on child at the joint's point on the child [N, N·m]
hinge.parent_point, .child_point the joint's point on parent and child, body frame, from its centre of mass
hinge.stiffness, .damping, .rest of the joint's springs and dampers
================================ =========================================================================

Planar and free joints have coordinates of two kinds: ``q_translation`` and ``q_rotation``, likewise ``v_…``,
``stiffness_…``, ``damping_…``, ``rest_…``. The joint that carries a body without a joint of its own is called
``world_link1``; it has coordinates only. A joint that is named like a body gets ``_joint`` at its end.

A joint that closes a loop has ``.F`` and ``.T`` alone. One that may be released has room for the coordinates
of a free joint, ``q`` of 7 and ``v`` of 6 elements: its own come first until it is released, then position
and unit quaternion. An event ``separation`` has ``separation.time``, when it happened [s] or -1, and in Model
Exchange the event indicator ``separation.indicator``; one on command has the Boolean input
``separation.command``, which lets it happen when it becomes true. The stops of a joint are ``hinge.low`` and
``hinge.high``. A force element ``motor`` has ``motor.effort``, ``motor.power``, its parameters, and its
inputs by the names that the scenario gives them: ``motor.u``.

Further names: ``time``, ``gravity``, ``kinetic_energy``, ``potential_energy``, ``solver.integrator``,
``solver.substeps``, ``solver.rtol``, ``solver.atol``; in the force FMU ``density``, ``wind``, and
the wind's inputs by the names that the scenario gives them: ``environment.u``.

In FMI 2, and with scalar arrays, elements are variables of their own: ``link1.F[1]``, ``link1.A[1,6]``,
``der(hinge.v[2])``.
"""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import dataclass, replace
from typing import Literal

from linkwind.fmi.units import Quantity

Causality = Literal["independent", "parameter", "input", "output", "local"]
Variability = Literal["continuous", "discrete", "fixed", "tunable"]
Kind = Literal["dependent", "constant"]


@dataclass(frozen=True)
class Dependence:
    """That an unknown depends on a known.

    Attributes:
        on: name of the known.
        kind: ``constant`` where the known enters with a constant factor, else ``dependent``.
        elementwise: whether element i depends on element i only; both have then the same size.
    """

    on: str
    kind: Kind = "dependent"
    elementwise: bool = False


@dataclass(frozen=True)
class Variable:
    """A variable of the FMU: a piece of one section of its values.

    Attributes:
        name: see the module.
        section: of the values, as in ``lw_fmu.h``; empty for time.
        offset: first element within the section.
        dimensions: shape, row by row in memory; empty for a scalar.
        causality, variability, initial: of FMI; ``initial`` is empty where FMI has none.
        quantity: what it measures.
        description: for people.
        start: values at the start, as many as it has elements; empty for none.
        derivative_of: name of the state that this is the derivative of; empty for none.
        depends: knowns that it depends on while simulating; of outputs and derivatives.
        initially: knowns that it depends on at initialisation besides those.
        elements: quantity of each element, where they differ.
        limits: least and largest value allowed; of integers, which only have this.
        boolean: whether it is true or false; its start is then 1 or 0.
    """

    name: str
    section: str
    offset: int
    dimensions: tuple[int, ...]
    causality: Causality
    variability: Variability
    initial: Literal["", "exact", "calculated"]
    quantity: Quantity
    description: str
    start: tuple[float, ...] = ()
    derivative_of: str = ""
    depends: tuple[Dependence, ...] = ()
    initially: tuple[Dependence, ...] = ()
    elements: tuple[Quantity, ...] = ()
    limits: tuple[int, int] | None = None
    boolean: bool = False

    @property
    def size(self) -> int:
        """Number of elements."""
        return math.prod(self.dimensions)

    @property
    def integer(self) -> bool:
        """Whether it is an Int32."""
        return self.limits is not None

    @property
    def type(self) -> Literal["Float64", "Int32", "Boolean"]:
        """Its type in FMI 3."""
        return "Int32" if self.integer else "Boolean" if self.boolean else "Float64"


def scalars(variables: list[Variable]) -> list[Variable]:
    """Return the elements of all variables, each as a variable of its own."""
    expansion = _Expansion(variables)
    return [_element(variable, index, expansion) for variable in variables for index in range(variable.size)]


def element_names(variable: Variable) -> list[str]:
    """Return the names of the elements: ``link1.F[1]``, ``der(hinge.v[2])``; of a scalar its own."""
    if not variable.dimensions:
        return [variable.name]
    inner = re.fullmatch(r"der\((.*)\)", variable.name)
    stem, ending = (f"der({inner[1]}", ")") if inner else (variable.name, "")
    ranges = (range(1, length + 1) for length in variable.dimensions)
    return [f"{stem}[{','.join(map(str, indices))}]{ending}" for indices in itertools.product(*ranges)]


class _Expansion:
    """Dependences on arrays, as dependences on their elements.

    Large mechanisms have long lists, which many unknowns share: each is expanded once.
    """

    def __init__(self, variables: list[Variable]) -> None:
        self.names = {variable.name: element_names(variable) for variable in variables}
        self._known: dict[int, tuple[Dependence, ...]] = {}

    def of(self, dependences: tuple[Dependence, ...], index: int) -> tuple[Dependence, ...]:
        """Return what element ``index`` depends on; the tuples given must live as long as this."""
        if any(dependence.elementwise for dependence in dependences):
            return self._expand(dependences, slice(index, index + 1))
        key = id(dependences)
        if key not in self._known:
            self._known[key] = self._expand(dependences, slice(0))
        return self._known[key]

    def _expand(self, dependences: tuple[Dependence, ...], own: slice) -> tuple[Dependence, ...]:
        return tuple(
            Dependence(name, each.kind)
            for each in dependences
            for name in (self.names[each.on][own] if each.elementwise else self.names[each.on])
        )


def _element(variable: Variable, index: int, expansion: _Expansion) -> Variable:
    state = variable.derivative_of
    return replace(
        variable,
        name=expansion.names[variable.name][index],
        offset=variable.offset + index,
        dimensions=(),
        quantity=variable.elements[index] if variable.elements else variable.quantity,
        start=variable.start[index : index + 1],
        derivative_of=expansion.names[state][index] if state else "",
        depends=expansion.of(variable.depends, index),
        initially=expansion.of(variable.initially, index),
        elements=(),
    )
