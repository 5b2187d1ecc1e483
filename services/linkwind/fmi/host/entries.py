"""What an entry of the scenario's table says, and what could be written into one."""

from __future__ import annotations

import re
from collections.abc import Sequence

from linkwind.fmi.host.facts import Variable
from linkwind.fmi.host.names import Reading, likeness
from linkwind.fmi.host.quantities import INPUTS, OUTPUTS, exponents, to_si
from linkwind.scenario.providers import FmuVariable


def read_entry(
    causality: str, variable: Variable, number: int, entry: FmuVariable, bodies: Sequence[str]
) -> Reading | tuple[str, str, str]:
    """Return what ``[body.]quantity[.component]`` says of an element, or what is wrong with it.

    Args:
        causality: ``input`` or ``output``.
        variable: of the FMU.
        number: of the element among those of the variable.
        entry: of the table.
        bodies: names of the provider's bodies.

    Returns:
        What it is; or expected, got and advice for an error.
    """
    quantities = INPUTS if causality == "input" else OUTPUTS
    parts = entry.quantity.split(".")
    body = bodies.index(parts[0]) if parts[0] in bodies else None
    parts = parts[body is not None :]
    if not parts or parts[0] not in quantities or len(parts) > 2:
        expected = f"[body.]quantity[.component] with one of {', '.join(quantities)}"
        return expected, f'"{entry.quantity}"', f"Bodies: {', '.join(bodies)}."
    components = quantities[parts[0]].components
    if len(parts) == 2:
        if parts[1] in components:
            return Reading(parts[0], components.index(parts[1]), body)
    elif len(components) == 1:
        return Reading(parts[0], 0, body)
    elif variable.shape:
        row, component = divmod(number, len(components))
        if variable.size == len(components):
            return Reading(parts[0], component, body)
        if variable.size == len(components) * len(bodies) and body is None:
            return Reading(parts[0], component, row)
    got = f'"{entry.quantity}" for {variable.size} value{"s" * (variable.size > 1)}'
    return f"one of the components {', '.join(components)}", got, "Add it after a dot."


def affine(causality: str, unit: tuple[float, float], entry: FmuVariable) -> tuple[float, float]:
    """Return gain and bias of unit, scale and offset together; exact where there is nothing to convert."""
    factor, shift = unit
    if causality == "input":
        return entry.scale / factor, (entry.offset - shift) / factor
    return entry.scale * factor, entry.scale * shift + entry.offset


def candidates(variable: Variable, element: str) -> list[str]:
    """Return the quantities whose words and unit are nearest to a variable that is not understood."""
    alike = likeness(element, variable.causality)
    quantities = INPUTS if variable.causality == "input" else OUTPUTS
    if variable.unit is not None:
        for name in alike:
            if not isinstance(to_si(variable.unit, exponents(name, 0)), str):
                alike[name] += 1.0
    found = re.search(r"[._\[]?([xyz123])\]?$", element)
    letter = found[1].translate(str.maketrans("123", "xyz")) if found else ""
    near = []
    for name in sorted(alike, key=lambda name: -alike[name])[:3]:
        components = quantities[name].components
        component = letter if letter in components else components[0]
        near.append(f"{name}.{component}" if component else name)
    return near
