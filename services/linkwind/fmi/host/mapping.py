"""Which variable of an FMU is which quantity of which body.

The scenario's table goes first, the names of the variables tell the rest. Every input has to be mapped or
given a value; of the outputs, those that are mapped are read, and there has to be a force or a torque.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Literal

from linkwind.errors import InputError
from linkwind.fmi.host import checks
from linkwind.fmi.host.entries import affine, read_entry
from linkwind.fmi.host.facts import Description, Unit, Variable
from linkwind.fmi.host.links import Link, Mapping, elements
from linkwind.fmi.host.names import Reading, read
from linkwind.fmi.host.quantities import INPUTS, OUTPUTS, exponents, known, to_si, unit_names
from linkwind.scenario.providers import FmuModel, FmuVariable

SHOWN = 6  # problems in one error
_LEFT = ("Clock", "Binary")  # types that keep what the FMU starts with
_GLOBAL = ("density", "wind")  # belong to no body in particular


def resolve(fmu: Description, settings: FmuModel, bodies: Sequence[str]) -> Mapping:
    """Map the variables of an FMU.

    Args:
        fmu: the FMU, with its sizes.
        settings: of the scenario.
        bodies: names of the provider's bodies.

    Raises:
        InputError: an input or the table cannot be mapped, or something is mapped twice; a line each.
    """
    mapping, problems = survey(fmu, settings, bodies)
    if problems:
        raise refusal(problems, fmu.path)
    return mapping


def refusal(problems: Sequence[str], path: object) -> InputError:
    """Return the error for what is wrong with the mapping of the FMU at a path, the first few of it."""
    more = len(problems) - SHOWN
    return InputError("\n".join([*problems[:SHOWN], *[f"{path}: and {more} more"] * (more > 0)]))


def survey(fmu: Description, settings: FmuModel, bodies: Sequence[str]) -> tuple[Mapping, list[str]]:
    """Map what can be mapped; return it with the problems that ``resolve`` would raise, a line each."""
    resolver = _Resolver(fmu, settings, tuple(bodies))
    return resolver.resolve(), resolver.problems


@dataclass
class _Side:
    """Inputs or outputs while they are being mapped."""

    causality: Literal["input", "output"]
    links: list[Link] = field(default_factory=list)
    variables: list[Variable] = field(default_factory=list)
    left: list[tuple[Variable, str]] = field(default_factory=list)
    size: int = 0


class _Resolver:
    def __init__(self, fmu: Description, settings: FmuModel, bodies: tuple[str, ...]) -> None:
        self._fmu, self._settings, self._bodies = fmu, settings, bodies
        self.problems: list[str] = []

    def resolve(self) -> Mapping:
        self._check_names()
        inputs = self._side("input")
        outputs = self._side("output")
        self._angular(inputs)
        per_body = self._per_body([*inputs.links, *outputs.links])
        sides = [self._bodies_of(side, per_body) for side in (inputs, outputs)]
        forces = [element for variable, element in inputs.left if self._is_force(variable, element)]
        if forces:
            self._problem(*checks.mechanism(forces))
        for variable, element in [] if forces else inputs.left:
            self._problem(*checks.unmapped(variable, element))
        for problem in checks.twice(sides[1]):
            self._problem(*problem)
        if not self.problems:
            bodies = self._bodies[:1] if per_body else self._bodies
            ignored = [element for _, element in outputs.left]
            for problem in checks.complete(sides[1], bodies, ignored, several=not per_body):
                self._problem(*problem)
        return Mapping(
            per_body,
            self._bodies,
            tuple(sides[0]),
            tuple(sides[1]),
            tuple(inputs.variables),
            tuple(outputs.variables),
            held=tuple(v.name for v in self._fmu.variables if self._held(v)),
            unmapped=tuple(element for _, element in inputs.left),
            ignored=tuple(element for _, element in outputs.left),
        )

    def _is_force(self, variable: Variable, element: str) -> bool:
        found = read(element, "output", self._bodies, scalar=element == variable.name)
        return found is not None and found.quantity == "force"

    def _problem(self, item: str, expected: str, got: str, advice: str) -> None:
        self.problems.append(f"{self._fmu.path}: {item}: expected {expected}; got {got}. {advice}")

    def _check_names(self) -> None:
        known_names = {
            name: variable
            for variable in self._fmu.variables
            if variable.causality in ("input", "output")
            for name in (variable.name, *elements(variable))
        }
        for name in self._settings.variables:
            if name not in known_names:
                near = get_close_matches(name, known_names, 3, 0.3) or list(known_names)[:3]
                advice = f"Nearest: {', '.join(near)}." if near else "It has none."
                self._problem("fmu.variables", "inputs and outputs of the FMU", f'"{name}"', advice)

    # --- one side at a time ---------------------------------------------------------------------------

    def _held(self, variable: Variable) -> bool:
        return variable.causality == "input" and variable.name in self._settings.start

    def _side(self, causality: Literal["input", "output"]) -> _Side:
        side = _Side(causality)
        for variable in self._fmu.variables:
            if variable.causality == causality and variable.type not in _LEFT and not self._held(variable):
                self._variable(side, variable)
        return side

    def _variable(self, side: _Side, variable: Variable) -> None:
        """Map the elements of a variable and count their values where any is mapped."""
        links, left = [], []
        for number, element in enumerate(elements(variable)):
            link = self._element(side, variable, element, number) if variable.real else None
            if link is None:
                left.append((variable, element))
            else:
                links.append(link)
        side.left += left
        if links:
            side.links += links
            side.variables.append(variable)
            side.size += variable.size

    def _element(self, side: _Side, variable: Variable, element: str, number: int) -> Link | None:
        entry = self._settings.variables.get(element) or self._settings.variables.get(variable.name)
        if entry is not None:
            if entry.quantity == "none":
                return None
            said = read_entry(side.causality, variable, number, entry, self._bodies)
            found = said if isinstance(said, Reading) else None
            if not isinstance(said, Reading):
                self._problem(f'fmu.variables."{element}"', *said)
        else:
            found = read(element, side.causality, self._bodies, scalar=not variable.shape)
            entry = FmuVariable(quantity="by name")
        if found is None:
            return None
        return self._link(side, variable, element, number, found, entry)

    def _link(
        self,
        side: _Side,
        variable: Variable,
        element: str,
        number: int,
        found: Reading,
        entry: FmuVariable,
    ) -> Link | None:
        quantity = (INPUTS if side.causality == "input" else OUTPUTS)[found.quantity]
        unit = variable.unit if entry.unit is None else known(entry.unit) or Unit(entry.unit)
        wanted = exponents(found.quantity, found.component)
        factor = to_si(unit, wanted)
        if isinstance(factor, str):
            advice = (
                f'If it is right, write unit = "{unit_names(wanted).split(",")[0]}" for it in fmu.variables.'
            )
            expected = f"a unit of {found.quantity} ({unit_names(wanted)})"
            self._problem(f"{side.causality} {element}", expected, factor, advice)
            return None
        frame = entry.frame or self._settings.frame or ("body" if found.body_frame else "world")
        point = entry.point or self._settings.point
        if entry.frame == "body" and not quantity.turns:
            self._problem(
                f'fmu.variables."{element}".frame', "world", "body", f"A {found.quantity} has no other."
            )
        gain, bias = affine(side.causality, factor, entry)
        return Link(
            element=element,
            index=side.size + number,
            quantity=found.quantity,
            component=found.component,
            body=-1 if found.body is None else found.body,
            frame=frame if quantity.turns else "world",
            point=point if point and any(point) and _moves(found.quantity) else None,
            gain=gain,
            bias=bias,
            unit=unit.name if unit else "",
            by="name" if entry.quantity == "by name" else "table",
        )

    def _angular(self, inputs: _Side) -> None:
        """Read ``a`` beside ``phi`` as an angular acceleration."""
        single = {link.element for link in inputs.links}
        if any(link.quantity == "angle" for link in inputs.links) and "s" not in single:
            inputs.links = [
                replace(link, quantity="angular_acceleration", component=2)
                if link.element == "a" and link.by == "name"
                else link
                for link in inputs.links
            ]

    # --- which body -----------------------------------------------------------------------------------

    def _per_body(self, links: list[Link]) -> bool:
        """Return whether each body gets an instance: nothing in the FMU names a body."""
        named = any(link.body >= 0 for link in links)
        return not named and len(self._bodies) > 1

    def _bodies_of(self, side: _Side, per_body: bool) -> list[Link]:
        """Return the links with the body that each belongs to."""
        links = []
        for link in side.links:
            if link.body < 0 and not per_body and len(self._bodies) > 1 and link.quantity not in _GLOBAL:
                self._problem(
                    f"{side.causality} {link.element}",
                    "the name of a body in it, because other variables have one",
                    "none",
                    f'Write "{link.element}" = "{self._bodies[0]}.{link.quantity}…" in fmu.variables.',
                )
            links.append(replace(link, body=max(link.body, 0)))
        return links


def _moves(quantity: str) -> bool:
    """Return whether the quantity depends on the point of the body that it is taken at."""
    return quantity in ("position", "velocity", "relative_velocity", "acceleration", "force")
