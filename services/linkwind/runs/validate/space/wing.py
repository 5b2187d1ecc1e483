"""Thin wings at large angles, and bodies so long that their middle feels a flow in the plane.

The three cells that a marker moves make a plate act as if it were some 1.6 cells thick: what it does along the
plate is too large with few cells, so that lift and drag are only reported, with how they converge.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linkwind.runs.validate import scenes as planar
from linkwind.runs.validate.driven import Driven, at_rest
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most
from linkwind.runs.validate.space.scenes import SPEED, driven, plate, scene, still
from linkwind.spatial import Array

TAIRA = (
    "W. B. Dickson's towed plate in oil, in K. Taira et al., AIAA 2007-710, as tabled in barbagroup/PetIBM"
)
PETIBM = "O. Mesnard, L. A. Barba: barbagroup/PetIBM, examples, computed"

# Lift and drag coefficient by angle [deg], aspect ratio 2, Re 100, read off a figure by those who tabled them.
MEASURED = {30: (0.758, 0.639), 45: (0.726, 0.902), 90: (0.0, 1.527)}
COMPUTED = {30: (0.7059, 0.7393)}


def _wing(angle: float, chord: int, end: float) -> tuple[Array, Array]:
    """Return times, and lift and drag coefficient (steps, 2), of a wing of aspect ratio 2, Re 100."""
    step, window = round(0.1 / chord, 9), (8.0, 6.0, 7.0)
    text = scene(plate(1.0, 2.0), 2 * chord, step, 0.01, window, wind=(1.0, 0.0, 0.0))
    t, wrench = driven(text, still(0.0, 0.0, -math.radians(angle)), round(end / step))
    return t, wrench[:, [1, 0]]


def wings(short: bool) -> Findings:
    """A wing of aspect ratio 2 at angles where its flow is separated and steady, Re 100."""
    found, curves = Findings(), []
    chord, end, within = (12, 8.0, 0.2) if short else (20, 12.0, 0.1)
    for angle in (45,) if short else (30, 45, 90):
        t, force = _wing(angle, chord, end)
        lift, drag = force[t > end - 1.0].mean(axis=0).tolist()
        s, c = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        case = f"wing of aspect ratio 2 at {angle}°, Re 100, {chord} cells a chord"
        cl, cd = MEASURED[angle]
        found.rows.append(
            Row(case, "normal force coefficient", lift * c + drag * s, cl * c + cd * s, within, TAIRA)
        )
        for values, source in ((MEASURED, TAIRA), (COMPUTED, PETIBM)):
            for name, value, right in zip(("lift", "drag"), (lift, drag), values.get(angle, ()), strict=False):
                if right:
                    found.rows.append(Row(case, f"{name} coefficient", value, right, None, source))
        curves += [Curve(f"{name}, {angle}°", t[t > 0.5], force[t > 0.5, i]) for i, name in enumerate(("lift", "drag"))]
    found.plots.append(Plot("Wing of aspect ratio 2, Re 100", "t U/c", "coefficient", tuple(curves)))
    if not short:
        found.add(_converging())
    return found


def _converging() -> Findings:
    """Lift and drag at 30 degrees with finer and finer grids, 8 chords after the start."""
    sizes = (8, 12, 16, 24)
    ends = np.array([force[t > 7.0].mean(axis=0) for t, force in (_wing(30.0, n, 8.0) for n in sizes)])
    at = 1.0 / np.array(sizes)
    curves = [Curve(name, at, ends[:, i]) for i, name in enumerate(("lift", "drag"))]
    curves.append(Curve("computed, PetIBM", np.zeros(2), np.array(COMPUTED[30]), True))
    curves.append(Curve("measured, Taira et al. 2007", np.zeros(2), np.array(MEASURED[30]), True))
    return Findings([], [Plot("Wing of aspect ratio 2 at 30°, Re 100, after 8 chords", "cell / chord", "coefficient",
                              tuple(curves))])  # fmt: skip


def long(short: bool) -> Findings:
    """Long bodies in a stream that has just come up: what more of the span adds, against the plane."""
    cells, end, rows, plots = 12, 3.0, [], []
    spans = (5.0, 8.0)
    cases = [
        ("plate at 45°", '{{ type = "plate", length = 1.0, span = {span!r} }}', 0.25 * math.pi),
        ("cylinder", '{{ type = "circle", diameter = 1.0, span = {span!r} }}', 0.0),
    ]
    for name, shape, angle in cases[: 1 if short else 2]:
        step, forces = round(SPEED / cells, 9), []
        steps = round(end / step)
        for span in spans:
            text = scene(
                shape.format(span=span), span * cells, step, 0.01, (6.0, 6.0, span + 3.0), wind=(1.0, 0.0, 0.0),
                start_time=0.5,
            )  # fmt: skip
            t, wrench = driven(text, still(0.0, 0.0, -angle), steps)
            forces.append(wrench[:, :2])
        more = (forces[1] - forces[0]) / (spans[1] - spans[0])
        flat = planar.scene(
            shape.format(span=1.0), cells=cells, step=step, viscosity=0.01, window=(10.0, 10.0), wind=(1.0, 0.0),
            start_time=0.5,
        )  # fmt: skip
        plane = Driven(flat).go(at_rest(0.0, 0.0, -angle), steps=steps).wrench[:, 0, :2]
        late = t > 1.0
        off = np.abs(more - plane)[late].max() / np.abs(plane[late]).max()
        what = "largest difference of what a chord of the span adds, over the force in the plane"
        rows.append(most(f"long {name}, Re 100, first 3 chords", what, float(off), 0.06, "flow in the plane"))
        curves = [
            Curve(f"{axis}, {label}", t[late], of[late, i])
            for of, label in ((more, "in space"), (plane, "in the plane"))
            for i, axis in enumerate("xy")
        ]
        plots.append(Plot(f"Long {name}, Re 100", "t U/c", "force on a chord of the span", tuple(curves)))
    return Findings(rows, plots)


CASES: dict[str, Callable[[bool], Findings]] = {
    "wing at large angles": wings,
    "long bodies in space": long,
}
