"""Thin wings at large angles, and bodies so long that their middle feels a flow in the plane.

The cells that a marker moves make a plate act as if it were some 1.5 cells thick in a steady shear. So the
force along a plate is too large with few cells: held to the measurement is the normal force; lift and drag
are reported beside it, with how they converge, and held to a computation once there are cells enough.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linkwind.runs.validate import scenes as planar
from linkwind.runs.validate.driven import Driven, at_rest
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row
from linkwind.runs.validate.signals import between
from linkwind.runs.validate.space.scenes import SPEED, driven, plate, scene, still
from linkwind.spatial import Array

TAIRA = (
    "W. B. Dickson's towed plate in oil, in K. Taira et al., AIAA 2007-710, as tabled in barbagroup/PetIBM"
)
PETIBM = "O. Mesnard, L. A. Barba: barbagroup/PetIBM, examples, computed"

# Lift and drag coefficient by angle [deg], aspect ratio 2, Re 100; the measured ones were read off a figure.
MEASURED = {30: (0.758, 0.639), 45: (0.726, 0.902), 90: (0.0, 1.527)}
COMPUTED = {30: (0.7059, 0.7393)}
NAMES = ("lift", "drag")

LONG = (
    ("plate at 45°", 'type = "plate", length = 1.0', 0.25 * math.pi),
    ("cylinder", 'type = "circle", diameter = 1.0', 0.0),
)
SPANS = (5.0, 8.0)  # between them only the middle differs
PLANE = "the flow in the plane, 48 cells"


def _wing(angle: float, chord: int, end: float) -> tuple[Array, Array]:
    """Return times, and lift and drag coefficient (steps, 2), of a wing of aspect ratio 2, Re 100."""
    step, window = round(0.1 / chord, 9), (8.0, 6.0, 7.0)
    text = scene(plate(1.0, 2.0), 2 * chord, step, 0.01, window, wind=(1.0, 0.0, 0.0))
    t, wrench = driven(text, still(0.0, 0.0, -math.radians(angle)), round(end / step))
    return t, wrench[:, [1, 0]]


def wings(short: bool) -> Findings:
    """A wing of aspect ratio 2 at angles where its flow is separated and steady, Re 100."""
    end, within = (
        (8.0, 0.2) if short else (12.0, 0.1)
    )  # what 12 cells, and 16 and more, make of the normal force
    grids = {45: (12,)} if short else {30: (8, 12, 16, 24), 45: (16,), 90: (16,)}
    found, curves, last = Findings(), [], {}
    for angle, sizes in grids.items():
        for chord in sizes:
            t, force = _wing(angle, chord, end)
            last[angle, chord] = force[t > end - 1.0].mean(axis=0)
        found.rows += _rows(angle, sizes[-1], last[angle, sizes[-1]], within)
        for i, name in enumerate(NAMES):
            curves.append(Curve(f"{name}, {angle}°", t[t > 0.5], force[t > 0.5, i]))
    found.plots.append(Plot("Wing of aspect ratio 2, Re 100", "t U/c", "coefficient", tuple(curves)))
    if not short:
        found.plots.append(_convergence({chord: last[30, chord] for chord in grids[30]}))
    return found


def _rows(angle: int, chord: int, coefficients: Array, within: float) -> list[Row]:
    """Return what is known about a wing at an angle [deg]; of ``coefficients`` (2,), see ``NAMES``."""
    case = f"wing of aspect ratio 2 at {angle}°, Re 100, {chord} cells a chord"
    across = np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    normal, right = float(coefficients @ across), float(across @ MEASURED[angle])
    rows = [Row(case, "normal force coefficient", normal, right, within, TAIRA)]
    for published, source, allowed in ((MEASURED, TAIRA, None), (COMPUTED, PETIBM, within)):
        for name, value, other in zip(NAMES, coefficients.tolist(), published.get(angle, ()), strict=False):
            if other and angle != 90:
                rows.append(Row(case, f"{name} coefficient", value, other, allowed, source))
    return rows


def _convergence(last: dict[int, Array]) -> Plot:
    at, values = 1.0 / np.array(list(last)), np.array(list(last.values()))
    curves = [Curve(name, at, values[:, i]) for i, name in enumerate(NAMES)]
    curves.append(Curve("computed: PetIBM", np.zeros(2), np.array(COMPUTED[30]), True))
    curves.append(Curve("measured: Taira et al. 2007", np.zeros(2), np.array(MEASURED[30]), True))
    return Plot("Wing of aspect ratio 2 at 30°, Re 100", "cell / chord", "coefficient", tuple(curves))


def long(short: bool) -> Findings:
    """Long bodies in a stream that comes up: what more of the span adds, against a fine grid in the plane."""
    found = Findings()
    cells, side, within = (12, 8.0, 0.15) if short else (16, 10.0, 0.1)
    for name, shape, angle in LONG[: 1 if short else 2]:
        t, forces = np.empty(0), []
        for span in SPANS:
            t, force = _in_space(shape, angle, cells, (side, side, span + 4.0), span)
            forces.append(force)
        more = (forces[1] - forces[0]) / (SPANS[1] - SPANS[0])
        flat_t, flat = _in_the_plane(shape, angle, 48)
        case = f"long {name}, Re 100, chords 2 to 4 after the start, {cells} cells"
        curves = []
        for i, axis in enumerate("xy" if angle else "x"):
            value, right = (
                float(between(at, of[:, i], 2.0, 4.0).mean()) for at, of in ((t, more), (flat_t, flat))
            )
            what = f"force along {axis} on a chord of the span"
            found.rows.append(Row(case, what, value, right, within, PLANE))
            curves += [
                Curve(f"{axis}, in space", t, more[:, i]),
                Curve(f"{axis}, in the plane", flat_t, flat[:, i]),
            ]
        found.plots.append(
            Plot(f"Long {name}, Re 100", "t U/c", "force on a chord of the span", tuple(curves))
        )
    return found


def _in_space(
    shape: str, angle: float, cells: int, window: tuple[float, float, float], span: float
) -> tuple[Array, Array]:
    """Return times and force (steps, 2) on a body of a span in a stream that comes up in a second."""
    step, inertia = round(SPEED / cells, 9), [span**3] * 3 + [0.0] * 3  # more than that of the fluid inside
    text = scene(
        f"{{ {shape}, span = {span!r} }}", span * cells, step, 0.01, window, wind=(1.0, 0.0, 0.0),
        start_time=1.0,
        body=f"mass = {2.0 * span!r}\ninertia = {inertia!r}",
    )  # fmt: skip
    t, wrench = driven(text, still(0.0, 0.0, -angle), round(4.0 / step))
    return t, wrench[:, :2]


def _in_the_plane(shape: str, angle: float, cells: int) -> tuple[Array, Array]:
    """Return times and force (steps, 2) on a chord of the span of a body in a flow in the plane."""
    step = round(SPEED / cells, 9)
    text = planar.scene(
        f"{{ {shape}, span = 1.0 }}", cells=cells, step=step, viscosity=0.01, window=(12.0, 12.0),
        wind=(1.0, 0.0),
        start_time=1.0, body="mass = 2.0\ninertia = 1.0",
    )  # fmt: skip
    forces = Driven(text).go(at_rest(0.0, 0.0, -angle), steps=round(4.0 / step))
    return forces.t, forces.wrench[:, 0, :2]


CASES: dict[str, Callable[[bool], Findings]] = {
    "wing at large angles": wings,
    "long bodies in space": long,
}
