"""The mass of fluid that bodies in space accelerate with them, driven or free.

The insets of markers on a square plate and on a sphere are such that these two have the right inertia without
viscosity (``aero/flow/surface.py``): so of these rows the other plates and the free bodies are evidence.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linkwind.runs.validate.free import flown
from linkwind.runs.validate.plate import EXACT
from linkwind.runs.validate.rows import Findings, Row
from linkwind.runs.validate.space.scenes import CALIBRATED, SPHERE, SPHERE_VOLUME, driven, plate, scene
from linkwind.runs.validate.vortex.wings import ADDED, DNV
from linkwind.scenario import loads
from linkwind.spatial import Array

SQUARE = plate(1.0, 1.0)


def accelerated(shape: str, cells: int, axis: int, side: float, steps: int) -> float:
    """Return the force over the acceleration of a body that starts to move along an axis.

    Over the first fifth of the steps the acceleration comes up; it is kept until the body has moved by half a
    cell, with practically no viscosity. The mean is over the second half, when the sound has gone.
    """
    step, cell = 1e-3, 1.0 / cells
    size, rise = cell / (steps * step) ** 2, 0.2 * steps * step

    def course(t: float) -> tuple[Array, Array]:
        s, after = min(t / rise, 1.0), max(t - rise, 0.0)
        place, twist = np.array([0.13 * cell, 0.21 * cell, 0.37 * cell, 0.0, 0.0, 0.0]), np.zeros(6)
        twist[axis] = size * (rise * (s**3 - 0.5 * s**4) + after)
        place[axis] += size * (rise**2 * (0.25 * s**4 - 0.1 * s**5) + 0.5 * rise * after + 0.5 * after**2)
        return place, twist

    text = scene(shape, cells, step, 1e-6 * cell**2 / step, (side, side, side))
    _, wrench = driven(text, course, steps)
    return -float(wrench[steps // 2 :, axis].mean()) / size


def added(short: bool) -> Findings:
    """The mass of fluid that a sphere, and plates, accelerate with them."""
    found, cells, steps, side = Findings(), 20 if short else 32, 400 if short else 800, 4.0 if short else 5.0
    sphere = accelerated(SPHERE, cells, 0, side, steps) / (0.5 * SPHERE_VOLUME)
    case = "sphere that starts to move"
    found.rows.append(Row(case, "added mass over exact", sphere, 1.0, 0.04, EXACT + CALIBRATED))
    for aspect, chord in ((1.0, 1.0), (2.0, 0.5)):
        exact = ADDED[aspect] * 0.25 * math.pi * chord**2
        value = accelerated(plate(chord, 1.0), cells, 1, side, steps) / exact
        case = f"plate of aspect ratio {aspect:g} that starts to move along its normal"
        source = DNV + CALIBRATED if aspect == 1.0 else DNV
        found.rows.append(Row(case, "added mass over the published", value, 1.0, 0.06, source))
    return found


def light(short: bool) -> Findings:
    """Bodies that a force pushes: a plate of little or no mass, and a sphere as heavy as its fluid."""
    of_plate = ADDED[1.0] * 0.25 * math.pi
    cases = [("square plate without mass", SQUARE, "fy", 0.0, of_plate)]
    if not short:
        cases.append(("square plate of a tenth of its added mass", SQUARE, "fy", 0.1 * of_plate, of_plate))
        cases.append(("sphere as heavy as its fluid", SPHERE, "fx", SPHERE_VOLUME, 0.5 * SPHERE_VOLUME))
    rows = []
    for case, shape, along, mass, with_it in cases:
        rate = _pushed(shape, along, mass, mass + with_it, 20 if short else 32)
        what = "acceleration over force / (mass + added mass)"
        rows.append(Row(f"{case}, free", what, rate, 1.0, 0.05, DNV if shape == SQUARE else EXACT))
    return Findings(rows)


def _pushed(shape: str, along: str, mass: float, moved: float, cells: int) -> float:
    """Return the acceleration of a free body by a force that comes up, over force / moved mass."""
    steps, step, cell = 400, 1e-3, 1.0 / cells
    size = 1e-6 * cell / step**2
    push = f"""
[[providers]]
name = "push"
model = "field"
[providers.field.body]
let = {{ s = "min(t / {0.2 * steps * step!r}, 1)" }}
{along} = "{size * moved!r} * s * s * (3 - 2 * s)"
"""
    inertia = max(0.1 * mass, 0.02)  # that of a sphere; of a plate no matter
    body = f"mass = {mass!r}\ninertia = [{', '.join([repr(inertia)] * 3)}, 0.0, 0.0, 0.0]"
    text = scene(
        shape, cells, step, 1e-6 * cell**2 / step, (4.0, 4.0, 4.0), end=steps * step, body=body, rest=push
    )  # fmt: skip
    path = flown(loads(text, "pushed"))
    half, speed = len(path.t) // 2, path.linear[:, 0, "xyz".index(along[1])]
    return float((speed[-1] - speed[half]) / (path.t[-1] - path.t[half])) / size


CASES: dict[str, Callable[[bool], Findings]] = {
    "added mass in space": added,
    "light bodies in space": light,
}
