"""Validation: cases against published and exact values, one module a theme, and what they found.

A case is a function of ``short`` that returns rows and plots; a suite says its name. ``short`` is a form for
tests: coarser or fewer, a few seconds each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from linkwind.runs.validate import balance, coupling, cylinder, free, multibody, plate, space, vortex
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row

__all__ = ["COUPLING", "FLOW", "MULTIBODY", "VORTEX", "Curve", "Findings", "Plot", "Row", "Suite"]


@dataclass(frozen=True)
class Suite:
    """The cases of a command.

    Attributes:
        title: of its table.
        cases: by name.
        long: names of those without a short form.
        remark: what a reader of the page should know.
    """

    title: str
    cases: Mapping[str, Callable[[bool], Findings]]
    long: tuple[str, ...] = ()
    remark: str = ""

    def names(self, short: bool, chosen: tuple[str, ...] = ()) -> list[str]:
        """Return the names of the cases to run: the chosen ones, or all, that have the form."""
        return [
            name
            for name in self.cases
            if name in (chosen or self.cases) and not (short and name in self.long)
        ]

    def run(self, short: bool, chosen: tuple[str, ...] = ()) -> Iterator[Findings]:
        """Run these cases one after another; yield what each found."""
        for name in self.names(short, chosen):
            yield self.cases[name](short)


FLOW = Suite(
    "flow against published and exact values",
    {**balance.CASES, **plate.CASES, **cylinder.CASES, **free.CASES, **space.CASES},
    ("plate normal to a stream", "falling plate", "sphere in a stream, convergence"),
    "In two dimensions a bluff plate at Re of 1000 and more has more drag than a real one, whose vortices "
    "break up along the span. After separation the motion of falling bodies is chaotic: means and early "
    "windows are compared, never late trajectories. In space the windows are some 10 lengths long, which "
    "adds some per cent to drag; where markers lie was fitted to some of the rows, which say so.",
)

COUPLING = Suite(
    "coupling schemes against closed forms",
    coupling.CASES,
    remark="A single body, whose fluid is a formula. Bounds are for a degree that does not adapt; an "
    "adaptive one is stable up to the bound of degree 0.",
)

MULTIBODY = Suite(
    "multibody dynamics against published and exact values",
    multibody.CASES,
    remark="Times are those of the steps of the case, in one process that also did other things.",
)

VORTEX = Suite(
    "vortex lattice against published and exact values",
    vortex.CASES,
    remark="Speed, chord and density are 1, motions are small; the wakes are free. Where nothing else is "
    "said, a plate goes the length of one ring in a step. The theories have no cores: those of the wakes are "
    "0.01 chords.",
)
