"""Coupling schemes on a single body whose fluid is a formula: orders, bounds of stability, responses.

What is exact is worked out here apart from the schemes: motions in closed form, bounds from the eigenvalues
of one step.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from numpy.polynomial import Polynomial

from linkwind.runs.validate import partners
from linkwind.runs.validate.line import Body, Says, Seen
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, near
from linkwind.spatial import Array

EXACT = "exact"
ORDERS = {
    "explicit": ("explicit", 0, 1.0), "pec 0": ("pec", 0, 2.0), "pec 1": ("pec", 1, 2.0),
    "pec 2": ("pec", 2, 3.0), "pec 3": ("pec", 3, 4.0), "implicit 1": ("implicit", 1, 2.0),
}  # fmt: skip


def orders(_short: bool) -> Findings:
    """A damped oscillator that is pushed, all of its forces coupled, against its closed form."""
    c, k, push, rate, end = 0.6, 9.0, 2.0, 2.3, 2.0
    finest = 800

    def fluid(seen: Seen) -> Says:
        x, v = seen.now
        return Says(push * np.cos(rate * seen.t) - c * v - k * x)

    found, curves, start = Findings(), [], time.perf_counter()
    for name, (scheme, order, expected) in ORDERS.items():
        counts = np.array([finest // 4, finest // 2, finest])
        errors = []
        for steps in counts.tolist():
            _, v = Body().fly(fluid, end / steps, steps, scheme, order)
            t = end / steps * np.arange(steps + 1)
            errors.append(float(np.abs(v - _pushed(t, c, k, push, rate)).max()))
        curves.append(Curve(name, end / counts, np.array(errors)))
        observed = float(np.log2(errors[-2] / errors[-1]))
        found.rows.append(
            near(f"{name}: order", "observed at the finest step", observed, expected, 0.2, EXACT)
        )
    found.plots.append(
        Plot("Error of the velocity", "step [s]", "largest error [m/s]", tuple(curves), "loglog")
    )
    return Findings(found.rows, found.plots, time.perf_counter() - start)


def _pushed(t: Array, c: float, k: float, push: float, rate: float) -> Array:
    """Return the rate of x'' = push cos(rate t) - c x' - k x from x = 0, x' = 1 on."""
    forced = push / (k - rate**2 + 1j * c * rate)
    damping, own = 0.5 * c, np.sqrt(k - 0.25 * c * c)
    a = -forced.real
    b = (1.0 + damping * a + rate * forced.imag) / own
    free = np.exp(-damping * t) * (
        (b * own - damping * a) * np.cos(own * t) - (a * own + damping * b) * np.sin(own * t)
    )
    return np.asarray(free + (1j * rate * forced * np.exp(1j * rate * t)).real)


def bounds(short: bool) -> Findings:
    """How strong a fluid may be that a scheme without iterations meets in one exchange a step."""
    found, start = Findings(), time.perf_counter()
    cases = (
        ("a fluid that damps", "largest c h/m", lambda r, before, now: -r * now),
        (
            "added mass hidden in the force",
            "largest part of the mass",
            lambda r, before, now: r * (before - now),
        ),
    )
    for case, quantity, force in cases:
        for order in range(2 if short else 4):
            exact = _bisected(lambda r: _radius(order, r, force) > 1.0)  # noqa: B023
            measured = _bisected(lambda r: _grows(order, r, force))  # noqa: B023
            found.rows.append(
                Row(f"{case}: pec {order}", quantity, measured, exact, 0.02, "eigenvalues of one step")
            )
    return Findings(found.rows, [], time.perf_counter() - start)


Force = Callable[[float, float, float], float]


def _bisected(unstable: Callable[[float], bool]) -> float:
    low, high = 0.0, 1.5
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if unstable(middle) else (middle, high)
    return low


def _grows(order: int, r: float, force: Force) -> bool:
    """Tell whether, after a kick, the speed of a body of mass 1 changes more and more, in steps of 1 s."""

    def fluid(seen: Seen) -> Says:
        return Says(force(r, seen.before[1], seen.now[1]) + (0.1 if seen.t == 0.0 else 0.0))

    changes = np.abs(np.diff(Body().fly(fluid, 1.0, 300, "pec", order)[1]))
    return bool(changes[-60:].max() > changes[120:180].max())


def _radius(order: int, r: float, force: Force) -> float:
    """Return the spectral radius of a step of (v, F of the last points): predict, ask, correct."""
    reach = max(1, order)
    ahead, through = _weights(-np.arange(order + 1.0)), _weights(1.0 - np.arange(reach + 1.0))

    def step(z: Array) -> Array:
        v, forces = z[0], z[1:]
        asked = force(r, v, v + ahead @ forces[: order + 1])
        forces = np.concatenate([[asked], forces[:-1]])
        return np.concatenate([[v + through @ forces[: reach + 1]], forces])

    size = reach + 2
    matrix = np.array([step(unit) for unit in np.eye(size)]).T
    return float(np.abs(np.linalg.eigvals(matrix)).max())


def _weights(nodes: Array) -> Array:
    """Return how values at the nodes count in the integral from 0 to 1 of the polynomial through them."""
    weights = []
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        basis = Polynomial.fromroots(others) / np.prod(node - others) if len(others) else Polynomial([1.0])
        weights.append(basis.integ()(1.0))
    return np.array(weights)


def responses(short: bool) -> Findings:
    """A fluid that says how its force depends on the motion: added mass as A, damping as G."""
    found, start = Findings(), time.perf_counter()
    for scheme in ("pec", "implicit") if not short else ("pec",):
        for mass, added in ((1.0, 0.5), (1.0, 50.0), (0.0, 2.0)):
            k, step, steps = 4.0, 0.02, 200
            x, _ = Body(mass, k, (1.0, 0.0)).fly(lambda seen: Says(0.0, added), step, steps, scheme, 3)  # noqa: B023
            exact = np.cos(np.sqrt(k / (mass + added)) * step * np.arange(steps + 1))
            case = f"mass {mass:g} in {added:g} of added mass, {scheme}: oscillation"
            found.rows.append(_most(case, "largest error of x [m]", float(np.abs(x - exact).max()), 1e-7))
    for stiff in (0.1, 10.0, 1e3, 1e6):
        _, v = Body().fly(lambda seen: Says(-stiff * seen.now[1], None, stiff), 1.0, 200, "pec", 3)  # noqa: B023
        case = f"c h/m = {stiff:g} with its response: decay"
        found.rows.append(_most(case, "largest speed over that at the start", float(np.abs(v).max()), 1.0))
        found.rows.append(_most(case, "speed at the end over that", float(abs(v[-1])), 1e-6))
    return Findings(found.rows, [], time.perf_counter() - start)


def _most(case: str, quantity: str, value: float, bound: float) -> Row:
    return Row(case, quantity, value, bound, 0.0, EXACT, "most")


CASES = {"order": orders, "bound of stability": bounds, "response": responses, **partners.CASES}
