"""What a mapping is made of: elements of variables, and what each of them is."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Literal

from linkwind.fmi.host.facts import Variable

Vector3 = tuple[float, float, float]
_OF_TWIST = ("velocity", "relative_velocity", "angular_velocity", "acceleration", "angular_acceleration")


@dataclass(frozen=True)
class Link:
    """One element of a variable, and what it is.

    Attributes:
        element: its name, ``link1.r[2]`` for an element of an array.
        index: its place among all values of inputs, or of outputs.
        body: index among the provider's bodies; of one instance for each body always 0.
        frame, point: of the quantity; the point is in the body frame, from the centre of mass [m].
        gain, bias: input: FMU's value = gain · quantity + bias; output: quantity = gain · value + bias (SI).
        unit: as the FMU names it, empty without.
        by: how it was found.
    """

    element: str
    index: int
    quantity: str
    component: int
    body: int
    frame: Literal["world", "body"] = "world"
    point: Vector3 | None = None
    gain: float = 1.0
    bias: float = 0.0
    unit: str = ""
    by: Literal["name", "table"] = "name"

    @property
    def target(self) -> tuple[str, int, int]:
        """What it is, to find two that are the same."""
        return self.quantity, self.component, self.body


@dataclass(frozen=True)
class Mapping:
    """The mapping of one FMU.

    Attributes:
        per_body: whether there is one instance for each body; links then speak of body 0.
        bodies: names of the provider's bodies.
        inputs, outputs: links, in the order of the values.
        input_variables, output_variables: whose values are exchanged, in this order.
        held: inputs that keep a value from the scenario.
        unmapped: inputs that nothing is known about; none in a mapping to run with.
        ignored: outputs that are not read.
        twist_inputs: the links of inputs that depend on the twist of a body.
    """

    per_body: bool
    bodies: tuple[str, ...]
    inputs: tuple[Link, ...]
    outputs: tuple[Link, ...]
    input_variables: tuple[Variable, ...]
    output_variables: tuple[Variable, ...]
    held: tuple[str, ...]
    unmapped: tuple[str, ...]
    ignored: tuple[str, ...]

    @property
    def twist_inputs(self) -> tuple[Link, ...]:
        return tuple(link for link in self.inputs if link.quantity in _OF_TWIST)


def elements(variable: Variable) -> list[str]:
    """Return the names of the elements of a variable, in the order of its values."""
    if not variable.shape:
        return [variable.name]
    ranges = (range(1, size + 1) for size in variable.shape)
    return [f"{variable.name}[{','.join(map(str, index))}]" for index in itertools.product(*ranges)]
