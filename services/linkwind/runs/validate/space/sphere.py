"""A sphere: in a stream, oscillating in a fluid at rest, and settling under its weight."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linkwind.runs.validate.free import flown
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most, near
from linkwind.runs.validate.signals import between
from linkwind.runs.validate.space.scenes import (
    CALIBRATED,
    SPEED,
    SPHERE,
    SPHERE_VOLUME,
    driven,
    scene,
    still,
)
from linkwind.scenario import loads
from linkwind.spatial import Array

CLIFT = "L. Schiller, A. Naumann 1933, as in R. Clift, J. R. Grace, M. E. Weber 1978, within 5 %"
STOKES = "G. G. Stokes 1851; L. D. Landau, E. M. Lifshitz, Fluid Mechanics, § 24"


def law(re: float) -> float:
    """Return the drag coefficient of a sphere by its Reynolds number, below 800."""
    return 24.0 / re * (1.0 + 0.15 * math.pow(re, 0.687))


def _stream(
    re: float, cells: float, window: tuple[float, float, float], end: float
) -> tuple[Array, Array, Array]:
    """Return times, drag coefficient, and the wrench on a sphere in a stream."""
    step = round(SPEED / cells, 9)
    text = scene(SPHERE, cells, step, 1.0 / re, window, wind=(1.0, 0.0, 0.0))
    t, wrench = driven(text, still(), round(end / step))
    return t, 8.0 / math.pi * wrench[:, 0], wrench


def stream(short: bool) -> Findings:
    """The drag of a sphere that stands in a stream, in a window of 12 by 8 by 8 diameters."""
    rows, curves = [], []
    cells, window, end = (8, (12.0, 8.0, 8.0), 8.0) if short else (12, (12.0, 8.0, 8.0), 12.0)
    for re in (100,) if short else (20, 100, 200):
        t, drag, wrench = _stream(re, cells, window, end)
        case, late = f"sphere in a stream, Re {re}", t > end - 1.0
        # 20: what a sheared layer wider than the window lacks; 8 cells: they are coarse
        within = 0.1 if short or re < 50 else 0.06
        rows.append(Row(case, "drag coefficient", float(drag[late].mean()), law(re), within, CLIFT))
        across = np.abs(wrench[late][:, 1:]).max() / wrench[late][:, 0].mean()
        rows.append(most(case, "any other component over the drag", float(across), 5e-3))
        curves.append(Curve(f"Re {re}", t[t > 0.5], drag[t > 0.5]))
    return Findings(rows, [Plot("Sphere in a stream", "t U/D", "drag coefficient", tuple(curves))])


def converging(short: bool) -> Findings:
    """The drag of a sphere at Re 100 on finer and finer grids, and in larger and larger windows."""
    del short
    sizes, middle = (8, 12, 16, 20), (8.0, 6.0, 6.0)  # all whole numbers of 16 × 8 × 8 cells
    windows = ((4.0, 4.0, 4.0), middle, (12.0, 8.0, 8.0))
    drags = np.array([_last(_stream(100.0, n, middle, 8.0)) for n in sizes])
    wide = [float(drags[1]) if side == middle else _last(_stream(100.0, 12, side, 8.0)) for side in windows]
    case = "sphere in a stream, Re 100"
    change = float(abs(drags[-1] / drags[1] - 1.0))
    rows = [most(f"{case}, convergence", "change of drag from 12 to 20 cells", change, 0.01, "itself")]
    for side, drag in zip(windows, wide, strict=True):
        size = " × ".join(f"{length:g}" for length in side)
        rows.append(Row(f"{case}, window {size}", "drag coefficient", drag, law(100.0), None, CLIFT))
    lengths = np.array([side[0] for side in windows])
    right = Curve("drag law", lengths, np.full(len(lengths), law(100.0)), True)
    curves = (Curve("linkwind", lengths, np.array(wide)), right)
    title, drag_of = "Sphere, Re 100", "drag coefficient"
    grid = (Curve("linkwind, window of 8 × 6 × 6", np.array(sizes, float), drags),)
    plots = [
        Plot(f"{title}: grid", "cells across", drag_of, grid),
        Plot(f"{title}: window, 12 cells across", "length of the window / D", drag_of, curves),
    ]
    return Findings(rows, plots)


def _last(history: tuple[Array, Array, Array]) -> float:
    """Return the mean drag over the last length of a history."""
    t, drag, _ = history
    return float(drag[t > t[-1] - 1.0].mean())


def oscillating(short: bool) -> Findings:
    """A sphere that oscillates in a fluid at rest: Stokes' force, amplitude and phase."""
    rows, within = [], 0.06  # the thinnest layer is 1.25 cells thick
    cells = 12 if short else 20
    for ratio in (4.0,) if short else (2.0, 4.0, 8.0):
        a, rate, size = 0.5, 2.0 * math.pi, 0.01
        viscosity, step = 0.5 * rate * (a / ratio) ** 2, round(1.0 / (40 * cells), 9)

        def course(t: float, size: float = size, rate: float = rate) -> tuple[Array, Array]:
            s, c, zero = math.sin(rate * t), math.cos(rate * t), np.zeros(5)
            return np.append(-size * c, zero), np.append(size * rate * s, zero)

        t, wrench = driven(scene(SPHERE, cells, step, viscosity, (6.0, 6.0, 6.0)), course, 80 * cells)
        late = t > 1.0
        seen = 2.0 * np.mean(wrench[late, 0] * np.exp(-1j * rate * t[late]))
        speed = -1j * size * rate  # of the sine, as the part along exp(i rate t)
        drag = 6.0 * math.pi * viscosity * a * (1.0 + ratio)
        mass = SPHERE_VOLUME * (0.5 + 2.25 / ratio)
        force = -(drag + 1j * rate * mass) * speed
        case = f"sphere that oscillates, radius {ratio:g} times the sheared layer"
        before, exact = (math.degrees(np.angle(-f / speed)) for f in (seen, force))
        rows.append(Row(case, "amplitude of the force", abs(seen), abs(force), within, STOKES + CALIBRATED))
        rows.append(near(case, "force before the speed [deg]", before, exact, 3.0, STOKES + CALIBRATED))
    return Findings(rows)


def settling(short: bool) -> Findings:
    """A sphere twice as heavy as its fluid falls, free in all six coordinates: its speed in the end."""
    cells, side, end, within = (8, 9.0, 14.0, 0.1) if short else (12, 11.0, 20.0, 0.05)
    re = 100.0
    step, ratio = round(SPEED / cells, 9), 2.0
    # so heavy that the law's drag at the speed 1 carries it
    weight = 0.125 * math.pi * law(re) / ((ratio - 1.0) * SPHERE_VOLUME)
    mass, inertia = ratio * SPHERE_VOLUME, 0.1 * ratio * SPHERE_VOLUME
    body = f"mass = {mass!r}\ninertia = [{', '.join([repr(inertia)] * 3)}, 0.0, 0.0, 0.0]"
    gravity = np.array([-2.0, -1.0, 2.0]) / 3.0 * weight * (ratio - 1.0) / ratio  # less the buoyancy
    x, y, z = gravity.tolist()
    text = scene(
        SPHERE, cells, step, 1.0 / re, (side, side, side), gravity=(x, y, z), end=round(end / step) * step,
        body=body,
    )  # fmt: skip
    path = flown(loads(text, "settling"))
    down = path.linear[:, 0] @ gravity / np.linalg.norm(gravity)
    aside = np.linalg.norm(path.linear[:, 0] - down[:, None] * gravity / np.linalg.norm(gravity), axis=1)
    case = f"sphere of twice its fluid's density that settles askew to the grid, Re {re:g}"
    last = float(between(path.t, down, end - 1.0, end).mean())
    rows = [
        Row(case, "speed over that of the drag law", last, 1.0, within, CLIFT),
        most(case, "speed aside over speed", float(aside[-1] / down[-1]), 0.04),
        most(case, "speed of its surface by turning, over speed",
             float(0.5 * np.linalg.norm(path.angular[-1, 0]) / down[-1]), 0.04),
    ]  # fmt: skip
    curves = (Curve("linkwind", path.t, down), Curve("drag law", path.t[-1:], np.ones(1), True))
    return Findings(rows, [Plot("Settling sphere", "t U/D", "speed", curves)])


CASES: dict[str, Callable[[bool], Findings]] = {
    "sphere in a stream": stream,
    "sphere in a stream, convergence": converging,
    "oscillating sphere": oscillating,
    "settling sphere": settling,
}
