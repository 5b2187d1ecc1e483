"""Long runs: what happens to energy and loops without anything that feeds or brakes."""

from __future__ import annotations

import numpy as np

from linkwind.runs.validate.multibody.moving import RK4, Moving
from linkwind.runs.validate.multibody.scenes import chain
from linkwind.runs.validate.rows import Curve, Findings, Plot, most
from linkwind.scenario import Scenario, load


def _keeps(name: str, scenario: Scenario, end: float, step: float, bound: float) -> tuple[Findings, Curve]:
    """Return the drift of the energy, in parts of its largest kinetic energy, and the gap of the joints."""
    moving = Moving(scenario)
    before, size, gap, drift = moving.energy, 0.0, 0.0, []
    times = np.linspace(0.0, end, round(10 * end) + 1)[1:]
    for _ in times:
        moving.go(0.1, step, **RK4)
        size = max(size, moving.multibody.energy(moving.state)[0])
        drift.append(abs(moving.energy - before))
        gap = max(gap, moving.gap)
    case = f"{name}, rk4 at {1e3 * step:g} ms, {end:g} s"
    rows = [
        most(case, "energy drift over the largest kinetic energy", max(drift) / size, bound),
        most(case, "largest gap of a joint [m]", gap, 1e-13),
    ]
    curve = Curve(name, times, np.maximum(np.array(drift) / size, 1e-17))
    return Findings(rows, seconds=moving.seconds), curve


def energies(short: bool) -> Findings:
    """Mechanisms under gravity alone."""
    end = 10.0 if short else 100.0
    cases = (
        ("two four-bars", load("four_bar"), 1e-3, 1e-9),
        ("Bricard's mechanism", load("bricard"), 1e-3, 1e-9),
        ("chain of five rods", chain(5), 2.5e-4, 1e-8),
    )
    found, curves = Findings(), []
    for name, scenario, step, bound in cases:
        one, curve = _keeps(name, scenario, end, step, bound)
        found.add(one)
        curves.append(curve)
    title = "Energy drift, over the largest kinetic energy"
    found.plots.append(Plot(title, "t [s]", "drift [1]", tuple(curves), "log"))
    return found


CASES = {"long runs": energies}
