"""The order of every integrator, seen from its errors at three steps: on trees and on loops."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from linkwind.native.multibody import Integrator
from linkwind.runs.validate.multibody.closed import random_closed
from linkwind.runs.validate.multibody.moving import RK4, Moving
from linkwind.runs.validate.multibody.published import crank
from linkwind.runs.validate.multibody.scenes import chain, four_bars
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row
from linkwind.spatial import Array

ORDERS = dict(zip(Integrator, (1, 1, 4, 5, 5), strict=True))
THEORY = "its order in theory"
SPAN = 0.5  # s


def _fine(moving: Moving) -> Array:
    """Return the end by fixed steps so small that round-off rules."""
    return moving.go(SPAN, SPAN / 4096, **RK4).state[:-1]


def _four_bar(moving: Moving) -> Array:
    angle, rate = crank(1, SPAN)
    return np.array([angle, angle, -angle, rate, rate, -rate])


# made by, its state at the end, steps that the error of orders 1, 4 and 5 is measured from
CASES_OF: dict[str, tuple[Callable[[], Moving], Callable[[Moving], Array], dict[int, int]]] = {
    "tree: three rods on hinges": (lambda: Moving(chain(3)), _fine, {1: 400, 4: 80, 5: 40}),
    "loop: a four-bar": (lambda: Moving(four_bars(1)), _four_bar, {1: 400, 4: 20, 5: 20}),
    "loops in space: random": (
        lambda: Moving(random_closed(1, ("spherical", "distance"))),
        _fine,
        {1: 400, 4: 40, 5: 40},
    ),
}


def orders(short: bool) -> Findings:
    """Every integrator on every mechanism."""
    del short
    found = Findings()
    for name, (make, exact, first) in CASES_OF.items():
        end, curves = exact(make()), []
        for integrator, order in ORDERS.items():
            steps = first[order] * 2 ** np.arange(3)
            errors, seconds = [], 0.0
            for count in steps:
                moving = make()
                for _ in range(count):
                    moving.go(SPAN / count, SPAN / count, integrator=integrator, rtol=1e9, atol=1e9)
                errors.append(float(np.abs(moving.state[:-1] - end).max()))
                seconds += moving.seconds
            seen = float(np.log2(errors[-2] / errors[-1]))
            method = integrator.name.lower()
            row = Row(name, f"order of {method}", seen, float(order), 0.2, THEORY, "near")
            found.add(Findings([row], seconds=seconds))
            curves.append(Curve(f"{method}, {seen:.2f}", SPAN / steps, np.array(errors)))
        found.plots.append(
            Plot(name, "step [s]", f"error after {SPAN:g} s [rad, rad/s]", tuple(curves), "loglog")
        )
    return found


CASES = {"orders": orders}
