"""Coupling schemes beside what others publish: preCICE's oscillator, hidden added mass, a lagging spring."""

from __future__ import annotations

import time

import numpy as np

from linkwind.runs.validate.line import Body, Flown, Says, Seen, fly
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most, near
from linkwind.spatial import Array

# Two masses of 1 kg on springs to the ground, with a spring between them whose force is what is exchanged.
GROUND, BETWEEN = 4.0 * np.pi**2, 16.0 * np.pi**2
PRECICE = "preCICE, partitioned oscillator, doi:10.12688/openreseurope.14445.2"
WINDOW = 0.01  # s
PARALLEL = 0.293, 0.404  # largest errors of both masses by its parallel explicit scheme [m]
IMPLICIT, ITERATIONS = 1.2e-7, 3.7  # error by its serial implicit one, cubic in time, and iterations a window


def oscillator(_short: bool) -> Findings:
    """Two masses to t = 1 s against their closed form, and what preCICE reaches with as many exchanges."""
    start, found, curves = time.perf_counter(), Findings(), []
    held, smooth = (_errors(scheme, WINDOW) for scheme in ("explicit", "pec"))
    for mass, error, published in zip(("left", "right"), held, PARALLEL, strict=True):
        case = "two masses, explicit, 10 ms"
        found.rows.append(near(case, f"largest error of the {mass} [m]", error, published, 6e-4, PRECICE))
    worst = max(PARALLEL)
    case = "two masses, pec 3, 10 ms, as many exchanges"
    found.rows.append(most(case, "largest error [m]", max(smooth), worst / 4000.0, f"1/4000 of {PRECICE}"))
    case, value = "two masses, pec 3, 4 exchanges in 10 ms", max(_errors("pec", 0.25 * WINDOW))
    source = f"serial implicit, {ITERATIONS:g} iterations: {PRECICE}"
    found.rows.append(most(case, "largest error [m]", value, IMPLICIT, source))
    for scheme in ("explicit", "pec"):
        steps: Array = 0.02 / 2.0 ** np.arange(5.0)
        errors = np.array([max(_errors(scheme, h)) for h in steps.tolist()])
        curves.append(Curve(scheme, 1.0 / steps, errors))
    curves.append(Curve("preCICE, parallel explicit", np.array([100.0]), np.array([worst]), published=True))
    curves.append(
        Curve(
            "preCICE, serial implicit", np.array([100.0 * ITERATIONS]), np.array([IMPLICIT]), published=True
        )
    )
    plot = Plot("Two masses", "exchanges a second", "largest error [m]", tuple(curves), "loglog")
    return Findings(found.rows, [plot], time.perf_counter() - start)


def _errors(scheme: str, h: float) -> tuple[float, float]:
    """Return the largest errors of the left and the right mass [m]."""
    bodies = [Body(1.0, GROUND + BETWEEN, (1.0, 0.0)), Body(1.0, GROUND + BETWEEN, (0.0, 0.0))]

    def spring(seen: Seen) -> Says:
        return Says(BETWEEN * seen.now[0][::-1])

    steps = round(1.0 / h)
    x = fly(bodies, spring, h, steps, scheme, 3).x
    t = h * np.arange(steps + 1)
    slow, fast = np.cos(2.0 * np.pi * t), np.cos(6.0 * np.pi * t)
    left, right = np.abs(x - 0.5 * np.column_stack([slow + fast, slow - fast])).max(axis=0).tolist()
    return left, right


def iterations(short: bool) -> Findings:
    """Added mass that a provider hides in the mean force over a step: how many exchanges `implicit` takes."""
    start, found, steps = time.perf_counter(), Findings(), 100 if short else 300
    for acceleration in ("aitken", "iqn_ils"):
        worst = 0.0
        for ratio in (0.5, 2.0, 10.0, 50.0):
            flown = _hidden(ratio, acceleration, steps)
            case = f"added mass of {ratio:g} times the mass, hidden, {acceleration}"
            asked = flown.exchanges / steps
            found.rows.append(most(case, "exchanges a step", asked, 5.0, "preCICE: about 3"))
            exact = np.cos(np.sqrt(4.0 / (1.0 + ratio)) * 0.02 * np.arange(steps + 1))
            worst = max(worst, float(np.abs(flown.x[:, 0] - exact).max()))
        case = f"added mass hidden, {acceleration}"
        found.rows.append(most(case, "largest error of x of these [m]", worst, 1e-3))
    return Findings(found.rows, [], time.perf_counter() - start)


def _hidden(ratio: float, acceleration: str, steps: int) -> Flown:
    h = 0.02

    def fluid(seen: Seen) -> Says:
        return Says(-ratio * (seen.now[1] - seen.before[1]) / h)

    settings = {"held": True, "acceleration": acceleration, "tolerance": 1e-8}
    return fly([Body(1.0, 4.0, (1.0, 0.0))], fluid, h, steps, "implicit", 3, **settings)


def lag(_short: bool) -> Findings:
    """A spring that `explicit` holds over a step lags by half of it: it drives the oscillation."""
    start, found = time.perf_counter(), Findings()
    stiffness, h = 4.0 * np.pi**2, 0.001
    steps = round(10.0 / h)
    for share in (0.25, 0.5, 1.0):
        coupled = share * stiffness

        def fluid(seen: Seen) -> Says:
            return Says(-coupled * seen.now[0])  # noqa: B023

        flown = fly([Body(1.0, stiffness - coupled, (1.0, 0.0))], fluid, h, steps, "explicit", 0)
        expected = -share * 2.0 * np.pi * h / 4.0
        case = f"{share:g} of a spring in the provider, explicit"
        found.rows.append(
            Row(case, "damping ratio", _damping(flown, 2.0 * np.pi), expected, 0.02, "-(k_a/k) omega h / 4")
        )
    return Findings(found.rows, [], time.perf_counter() - start)


def _damping(flown: Flown, omega: float) -> float:
    """Return the damping ratio, from the amplitude over ten periods."""
    amplitude: Array = np.hypot(flown.x[:, 0], flown.v[:, 0] / omega)
    return float(-np.log(amplitude[-1] / amplitude[0]) / (10.0 * 2.0 * np.pi))


CASES = {"beside preCICE": oscillator, "iterations": iterations, "lag": lag}
