"""What must hold of a mapping: every input known, no output twice, a force or a torque on every body.

A problem is what it is about, expected, got, and advice.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from linkwind.fmi.host.entries import candidates
from linkwind.fmi.host.facts import Variable
from linkwind.fmi.host.links import Link
from linkwind.fmi.host.quantities import OUTPUTS

Problem = tuple[str, str, str, str]


def unmapped(variable: Variable, element: str) -> Problem:
    """Say what to do about an input that nothing is known about."""
    kind = variable.type if not variable.unit else f"{variable.type} [{variable.unit.name}]"
    start = "a value in fmu.start"
    if not variable.real:
        expected = f"{start}, because it is no Float64"
        return f"input {element}", expected, f"none, for a {kind}", f'Write start."{variable.name}" = …'
    near = candidates(variable, element)
    return (
        f"input {element}",
        f"a name that tells what it is, an entry in fmu.variables, or {start}",
        f"none of them, for a {kind}",
        f'Nearest: {", ".join(near)}. Write "{element}" = "{near[0]}" under fmu.variables.',
    )


def mechanism(forces: Sequence[str]) -> Problem:
    """Say what to do about an FMU that takes forces, as that of a mechanism does."""
    return (
        f"inputs {', '.join(forces[:4])}",
        "the motion of bodies, because a force model takes motion and gives forces",
        "forces, so that this is the FMU of a mechanism",
        "Give that of a force model, such as: linkwind fmu export SCENARIO --part aero.",
    )


def twice(outputs: Sequence[Link]) -> Iterator[Problem]:
    """Find outputs that are the same quantity of the same body."""
    first: dict[tuple[str, int, int], Link] = {}
    for link in outputs:
        other = first.setdefault(link.target, link)
        if other is not link:
            label = OUTPUTS[link.quantity].label(link.component)
            yield (
                f"output {link.element}",
                "a quantity of its own",
                f"{link.quantity}{label} of the same body as {other.element}",
                f'Write "{link.element}" = "none" under fmu.variables, or what it is.',
            )


def complete(
    outputs: Sequence[Link], bodies: Sequence[str], ignored: Sequence[str], *, several: bool
) -> Iterator[Problem]:
    """Find bodies without a force or a torque.

    Args:
        outputs: mapped.
        bodies: that outputs are needed for.
        ignored: names of outputs without a meaning.
        several: whether one instance is for several bodies.
    """
    acted = {link.body for link in outputs if link.quantity in ("force", "torque")}
    for index, name in enumerate(bodies):
        if index not in acted:
            yield (
                "outputs",
                "an output with a force or a torque" + (f" on {name}" if several else ""),
                f"none (outputs without a meaning: {', '.join(ignored[:8]) or 'none'})",
                "Map one under fmu.variables, or leave the body to another provider.",
            )
