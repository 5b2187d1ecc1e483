"""Validation: cases against published and exact values, one module a theme, and what they found.

A case is a function of ``short`` that returns rows and plots; the registry below says its name. ``short``
is a form for tests: coarser or fewer, a few seconds each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from linkwind.runs.validate import balance, cylinder, free, plate
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row

FLOW: dict[str, Callable[[bool], Findings]] = {
    **balance.CASES,
    **plate.CASES,
    **cylinder.CASES,
    **free.CASES,
}

LONG = ("plate normal to a stream", "falling plate")  # cases without a short form

__all__ = ["FLOW", "LONG", "Curve", "Findings", "Plot", "Row", "flow"]


def flow(short: bool, chosen: tuple[str, ...] = ()) -> Iterator[tuple[str, Findings]]:
    """Run the cases of the flow model one after another; yield the name and what each found.

    Args:
        short: whether to run the short form.
        chosen: names of cases; all if empty.
    """
    for name, case in FLOW.items():
        if name in (chosen or FLOW) and not (short and name in LONG):
            yield name, case(short)
