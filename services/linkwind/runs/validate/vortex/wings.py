"""Wings of finite span: steady lift and drag, added mass, and the impulse of the wake."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from linkwind.aero.vortex import Vortex
from linkwind.runs.validate.driven import Driven
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most
from linkwind.runs.validate.vortex import surface
from linkwind.runs.validate.vortex.scenes import SPAN, WIDTH, wing
from linkwind.spatial import Array

TUCK = "E. O. Tuck, J. Austral. Math. Soc. B 35(2), 1993"
OWN = "a lattice written apart, spaced by cosines"
DNV = "DNV-RP-C205, rectangular plates"
HORSESHOES = "horseshoe vortices, written apart"
JONES = "R. T. Jones, NACA Report 835, 1946, exact as it goes to 0"
EXACT = "exact"

SLOPES = {1.0: 1.4602, 2.0: 2.4744}  # of the lift coefficient [1/rad], published
INCIDENCE = 0.02  # rad
COARSE = {1.0: (8, 16), 2.0: (8, 16), 4.0: (8, 24), 8.0: (8, 32), 20.0: (6, 48)}  # rings, by aspect ratio
SWEPT = (  # leading and trailing edge at root and tip [root chords], half the span, rings
    ("swept and tapered wing of aspect ratio 6", (0.0, 1.6), (1.0, 2.2), 2.4, (6, 24)),
    ("delta of aspect ratio 2", (0.0, 1.0), (1.0, 1.0), 0.5, (8, 16)),
)
ADDED = {1.0: 0.579, 2.0: 0.757}  # over pi/4 times density, chord² and span, by span over chord
REST = 8  # steps before a plate is moved


def steady(short: bool) -> Findings:
    """Rectangular wings in a stream, long after the start: slope of the lift, and induced drag."""
    start, rows, curve = time.perf_counter(), [], []
    for aspect, rings in COARSE.items():
        if short and aspect not in (1.0, 8.0):
            continue
        slope, drag = _steady(aspect, rings)
        right, factor = surface.wing(aspect)
        case = f"wing of aspect ratio {aspect:g}, {rings[0]} × {rings[1]} rings"
        curve.append((aspect, slope, drag, right, factor))
        for published in [SLOPES[aspect]] if aspect in SLOPES else []:
            rows.append(Row(case, "slope of the lift [1/rad]", slope, published, 0.005, TUCK))
        rows += [
            Row(case, "slope of the lift [1/rad]", slope, right, 0.005, OWN),
            Row(case, "induced drag over that of an elliptic lift", drag, factor, 0.005, OWN),
        ]
    aspects, slopes, drags, right, factors = np.array(curve).T
    plots = (
        _plot("slope of the lift [1/rad]", aspects, slopes, right),
        _plot("induced drag over that of an elliptic lift", aspects, drags, factors),
    )
    return Findings(rows, [] if short else list(plots), time.perf_counter() - start)


def _plot(what: str, aspects: Array, found: Array, right: Array) -> Plot:
    curves = (Curve("linkwind", aspects, found), Curve("a lattice written apart", aspects, right, True))
    return Plot("Rectangular wings", "aspect ratio", what, curves)


def _steady(aspect: float, rings: tuple[int, int]) -> tuple[float, float]:
    """Return slope of the lift and drag over that of an elliptic one, 30 spans after the start."""
    steps, pose = 30, np.array([0.0, 0.0, -INCIDENCE])
    driven = Driven(wing(aspect, rings=rings, step=aspect, rows=steps + 1))
    drag, lift, _ = driven.go(lambda t: (pose, np.zeros(3)), steps).wrench[-1, 0] / (0.5 * aspect)
    return float(lift / INCIDENCE), float(drag * np.pi * aspect / lift**2)


def planforms(short: bool) -> Findings:
    """A swept and tapered wing and deltas, long after the start: slope of the lift, and where it acts."""
    start, rows = time.perf_counter(), []
    for name, leading, trailing, half, rings in SWEPT:
        slope, place = _swept(leading, trailing, half, rings)
        right, there = surface.swept(np.array(leading), np.array(trailing), half)
        case = f"{name}, {rings[0]} × {rings[1]} rings"
        rows += [
            Row(case, "slope of the lift [1/rad]", slope, right, 0.005, HORSESHOES),
            Row(case, "lift behind the foremost point [root chords]", place, there, 0.005, HORSESHOES),
        ]
    slender, thinner = (
        _swept((0.0, 1.0), (1.0, 1.0), 0.25 * aspect, (8, 32))[0] / (0.5 * np.pi * aspect)
        for aspect in (0.1, 0.05)
    )
    case, what = (
        "deltas of aspect ratio 0.1 and 0.05, carried to 0",
        "slope of the lift over π/2 aspect ratio",
    )
    rows.append(Row(case, what, 2.0 * thinner - slender, 1.0, 0.01, JONES))
    return Findings(rows, [], time.perf_counter() - start)


def _swept(
    leading: tuple[float, float], trailing: tuple[float, float], half: float, rings: tuple[int, int]
) -> tuple[float, float]:
    """Return slope of the lift, and x where it acts, of a wing whose edges run straight from root to tip."""
    (root, tip), (behind, last), steps = leading, trailing, 30
    corner = np.array(
        [[root, 0.0], [tip, half], [last, half], [behind, 0.0], [last, -half], [tip, -half]], np.float64
    )
    if tip == last:
        corner = corner[[0, 1, 3, 5]] if behind != last else corner[[0, 1, 5]]
    driven = Driven(wing(0.0, rings=rings, step=max(1.0, half), rows=steps + 1, planform=corner))
    pose = np.array([0.0, 0.0, -INCIDENCE])
    _, lift, moment = driven.go(lambda t: (pose, np.zeros(3)), steps).wrench[-1, 0]
    area = half * (behind - root + last - tip)
    return float(2.0 * lift / (area * INCIDENCE)), float(moment / lift)


def added(short: bool) -> Findings:
    """A plate that is suddenly moved along its normal: the impulse that it takes."""
    start, rows = time.perf_counter(), []
    for aspect, published, source in ((1.0, ADDED[1.0], DNV), (2.0, ADDED[2.0], DNV), (SPAN, 1.0, EXACT)):
        count = 12 if short else 16
        shape = "in two dimensions" if aspect == SPAN else f"with a span of {aspect:g} chords"
        case = f"plate {shape}, moved along its normal, {count} rings along the chord"
        value = _added(aspect, count)
        rows.append(Row(case, "added mass over π/4 ρ chord² span", value, published, 0.01, source))
    return Findings(rows, [], time.perf_counter() - start)


def _added(aspect: float, chordwise: int) -> float:
    spanwise, speed = (1 if aspect == SPAN else round(chordwise * aspect)), 1.0
    driven = Driven(wing(aspect, rings=(chordwise, spanwise), step=1e-3, rows=REST + 1, wind=0.0))

    def path(t: float) -> tuple[Array, Array]:
        moving = t > (REST + 0.5) * driven.h
        return np.zeros(3), np.array([0.0, speed * moving, 0.0])

    impulse = -driven.go(path, REST + 1).wrench[-1, 0, 1] * driven.h / speed
    return float(impulse / (0.25 * np.pi * (WIDTH if aspect == SPAN else aspect)))


def impulse(short: bool) -> Findings:
    """A wing that turns and beats in air at rest: its force against what the impulse of all rings loses.

    What is left does not fall with the rings: corners that are carried on one by one do not keep the impulse
    of a wake that rolls up.
    """
    start, found, errors = time.perf_counter(), Findings(), []
    counts = (4, 8) if short else (4, 8, 16)
    for count in counts:
        t, force, lost = _impulse(count, 3.0)
        error = float(np.abs(force - lost).max() / np.abs(force).max())
        errors.append(error)
    case = f"wing that turns and beats, {counts[-1]} rings along the chord"
    found.rows.append(
        most(case, "force and loss of impulse: difference over the largest", errors[-1], 0.02, EXACT)
    )
    curves = (Curve("force along y", t, force[:, 1]), Curve("loss of impulse", t, lost[:, 1], True))
    found.plots = [
        Plot("A wing that turns and beats", "chords", "force", curves),
        Plot(
            "Force and loss of impulse", "rings along the chord", "largest difference",
            (Curve("linkwind", np.array(counts), np.array(errors)),), "loglog",
        ),
    ]  # fmt: skip
    return Findings(found.rows, found.plots, time.perf_counter() - start)


def _impulse(chordwise: int, chords: float) -> tuple[Array, Array, Array]:
    """Return t, the force of each step and the rate at which the rings lose impulse, (steps, 2)."""
    step = 1.0 / chordwise
    steps = round(chords / step)
    driven = Driven(wing(2.0, rings=(chordwise, 2 * chordwise), step=step, rows=steps + 1, wind=0.0))
    bend, beat, rate, swing = 0.25, 0.2, 2.0, 0.3  # 1/chords of the way, chords, 1/chords, rad

    def path(t: float) -> tuple[Array, Array]:
        turn = bend * t
        along = np.array([-np.sin(turn), -(1.0 - np.cos(turn))]) / bend
        normal, tangent = np.array([-np.sin(turn), np.cos(turn)]), np.array([-np.cos(turn), -np.sin(turn)])
        y, v = beat * (1.0 - np.cos(rate * t)), beat * rate * np.sin(rate * t)
        angle, spin = turn - swing * np.sin(rate * t), bend - swing * rate * np.cos(rate * t)
        place, speed = along + y * normal, tangent * (1.0 + bend * y) + v * normal
        return np.array([*place, angle]), np.array([*speed, spin])

    kept: list[Array] = []
    forces = driven.go(path, steps, lambda driven, k: kept.append(_momentum(driven)))
    lost = -np.diff(np.array(kept), axis=0) / driven.h
    return forces.t[1:], forces.wrench[1:, 0, :2], lost


def _momentum(driven: Driven) -> Array:
    """Return the impulse of all rings as evaluated last, in the plane."""
    assert isinstance(driven.model, Vortex)
    lattice = driven.model.lattice
    corners, strengths = lattice.wake
    on_wing = (_areas(lattice.surface[0]) * lattice.trial_strength[0][..., None]).sum((0, 1))
    behind = np.concatenate([lattice.surface[0, -1:], corners[:, 0]])
    in_wake = (_areas(behind) * strengths[:, 0][..., None]).sum((0, 1))
    found: Array = (on_wing + in_wake)[:2]
    return found


def _areas(corner: Array) -> Array:
    """Return the area vectors of rings between corners (m + 1, s + 1, 3)."""
    found: Array = 0.5 * np.cross(corner[1:, 1:] - corner[:-1, :-1], corner[1:, :-1] - corner[:-1, 1:])
    return found


CASES: dict[str, Callable[[bool], Findings]] = {
    "steady wings": steady,
    "planforms": planforms,
    "added mass": added,
    "impulse": impulse,
}
