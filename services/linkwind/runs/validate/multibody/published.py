"""Benchmark mechanisms whose motion is published, or exact: IFToMM A01, A02, A04, and Andrews' squeezer."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np

from linkwind.log.reader import open_log
from linkwind.runs.run import run
from linkwind.runs.validate.multibody.elliptic import amplitude, jacobi, quarter
from linkwind.runs.validate.multibody.moving import RADAU5, RK4, TIGHT, Moving
from linkwind.runs.validate.multibody.scenes import four_bars, governor, pendulum
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most, near
from linkwind.scenario import load
from linkwind.spatial import Array

LIBRARY = "IFToMM benchmark library, M. González et al. 2010, doi:10.1007/s11044-010-9210-0"
COMPUTED = f"{LIBRARY}; value computed separately to 1e-9"
EXACT = "exact, by elliptic functions"
SCHIEHLEN = (
    "W. Schiehlen 1990, doi:10.1007/978-3-642-50995-7; reference solution of the test set for IVP solvers, "
    "F. Mazzia, C. Magherini (deTestSet)"
)
G = 9.81


def _components(
    case: str, names: str, got: Array, reference: Array, tolerance: float, source: str
) -> list[Row]:
    return [
        near(case, name, float(a), float(b), tolerance, source)
        for name, a, b in zip(names.split("; "), got, reference, strict=True)
    ]


# ---- A01


def pendulum_position(t: float) -> Array:
    """Return x, y of a point that swings on 1 m from (-1, 0), at rest."""
    swing = jacobi(math.sqrt(G) * t + quarter(0.5), 0.5)[0]
    angle = -2.0 * math.asin(math.sqrt(0.5) * swing)
    return np.array([math.sin(angle), -math.cos(angle)])


def simple_pendulum(short: bool) -> Findings:
    """A point on a massless rod, released level."""
    del short
    case = "A01 simple pendulum, rk4 at 1 ms, t = 9.99 s"
    moving = Moving(pendulum()).go(9.99, 1e-3, **RK4)
    got = moving.motion.position[0, :2]
    published = np.array([-0.3164364699, -0.9486137046])
    rows = _components(case, "x [m]; y [m]", got, published, 1e-9, COMPUTED)
    off = float(np.abs(got - pendulum_position(9.99)).max())
    return Findings([*rows, most(case, "error [m]", off, 1e-9, EXACT)], seconds=moving.seconds)


# ---- A02


def crank(count: int, t: float) -> tuple[float, float]:
    """Return the angle of the cranks of ``count`` four-bars [rad] and its rate [rad/s].

    All cranks turn alike, and the couplers stay level: a pendulum that goes round.
    """
    square = ((count + 1) / 2 + count) * G / ((count + 1) / 3 + count)
    m = 2.0 * square / (0.5 + 2.0 * square)
    rate = math.sqrt(square / m)
    u = quarter(m) - rate * t
    return 2.0 * amplitude(u, m) - math.pi / 2.0, -2.0 * rate * jacobi(u, m)[2]


def _tip(moving: Moving) -> tuple[Array, Array]:
    place, velocity = moving.point("crank0", (0.5, 0.0, 0.0))
    return place[:2], velocity[:2]


def _off(moving: Moving, count: int, t: float) -> float:
    angle, _ = crank(count, t)
    return float(np.hypot(*(_tip(moving)[0] - [math.cos(angle), math.sin(angle)])))


def _row_of_bars(count: int, end: float) -> tuple[Findings, Curve]:
    case = f"A02 {count} four-bar{'s' * (count > 1)}, rk4 at 1 ms, {end:g} s"
    moving = Moving(load("four_bar") if count == 2 else four_bars(count))
    times, errors, gaps = np.linspace(0.0, end, round(20 * end) + 1)[1:], [], []
    for t in times:
        moving.go(0.05, 1e-3, **RK4)
        errors.append(_off(moving, count, float(t)))
        gaps.append(moving.gap)
    rows = []
    if count == 2 and end == 10.0:
        place, velocity = _tip(moving)
        rows += _components(
            case, "B0 x [m]; B0 y [m]", place, np.array([0.3284581115, 0.9445185382]), 1e-9, COMPUTED
        )
        rates = np.array([1.423051470, -0.494868845])
        rows += _components(case, "B0 velocity x [m/s]; B0 velocity y [m/s]", velocity, rates, 1e-8, COMPUTED)
    rows += [
        most(case, "largest error of B0 [m]", max(errors), 1e-9, EXACT),
        most(case, "largest gap of a joint [m]", max(gaps), 1e-13),
    ]
    return Findings(rows, seconds=moving.seconds), Curve(f"N = {count}", times, np.maximum(errors, 1e-17))


def bars(short: bool) -> Findings:
    """Four-bars in a row, through positions in which they are singular."""
    found, curves = Findings(), []
    for count in (2, 10) if short else (1, 2, 10, 40):
        one, curve = _row_of_bars(count, 10.0 if count < 10 or not short else 2.0)
        found.add(one)
        curves.append(curve)
    title = "A02, four-bars in a row: error of B0 (rk4 at 1 ms)"
    found.plots.append(Plot(title, "t [s]", "error [m]", tuple(curves), scale="log"))
    return found


# ---- A04


def bricard(short: bool) -> Findings:
    """Six hinges in a loop, 30 equations for 30 coordinates of rank 29."""
    case = "A04 Bricard's mechanism, rk4 at 1 ms"
    moving = Moving(load("bricard")).go(1.0, 1e-3, **RK4)
    place, _ = moving.point("rod3", (0.0, 0.0, 0.5))
    published = np.array([0.51050146, -1.64916760, 0.14012311])
    rows = _components(case, "P3 x at 1 s [m]; y [m]; z [m]", place, published, 1e-8, COMPUTED)
    start, gap = Moving(load("bricard")).energy, moving.gap
    for _ in range(0 if short else 9):
        gap = max(gap, moving.go(1.0, 1e-3, **RK4).gap)
    span = "1 s" if short else "10 s"
    rows += [
        most(case, f"energy drift over {span} [J]", abs(moving.energy - start), 1e-8),
        most(case, "largest gap of a joint [m]", gap, 1e-13),
    ]
    return Findings(rows, seconds=moving.seconds)


# ---- A05


GOVERNOR = {0.1: 0.523836476, 0.5: 0.743249425, 1.0: 0.501420922}  # t [s]: s [m]


def flyball(short: bool) -> Findings:
    """A governor with springs of 8e5 N/m and 4e4 N·s/m: dopri5 is held to 70 µs, radau5 is not."""
    del short
    found = Findings()
    for name, step, how in (
        ("dopri5 at 1e-10", 1.0, TIGHT | {"rtol": 1e-10, "atol": 1e-12}),
        ("radau5 at 5 ms", 5e-3, RADAU5),
    ):
        moving, t, rows = Moving(governor()), 0.0, []
        for end, published in GOVERNOR.items():
            moving.go(end - t, step, **how)
            height = float(moving.point("slider", (0.0, 0.0, 0.0))[0][2])
            case = f"A05 flyball governor, {name}"
            rows.append(near(case, f"s at {end:g} s [m]", height, published, 1e-8, COMPUTED))
            t = end
        found.add(Findings(rows, seconds=moving.seconds))
    return found


# ---- Andrews


ANDREWS = {  # the angles of the test set, from those of the bodies
    "β": 15.81077119629904, "θ": -15.75637105984298, "γ": 0.04082224013073101, "φ": -0.5347301163226948,
    "δ": 0.5244099658805304, "Ω": 0.5347301163226948, "ε": 1.048080741042263,
}  # fmt: skip


def squeezer(short: bool) -> Findings:
    """Andrews' squeezing mechanism as a whole run: its motor is the aero side."""
    del short
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        outcome = run(load("andrews", ["bus.transport=inprocess"]), out, lambda step: None)
        path = open_log(outcome.log).trajectory()
    w, z = path.orientation[:, :, 0], path.orientation[:, :, 3]
    k1, k2, k3, k4, k5, k6, k7 = np.unwrap(2.0 * np.arctan2(z, w), axis=0)[-1]
    got = np.array([k1, k2 - k1, k3, k4 - k5, k5, k6 - k7, k7])
    case = "Andrews' squeezer, t = 0.03 s, a run in steps of 10 µs"
    names = "; ".join(f"{name} [rad]" for name in ANDREWS)
    rows = _components(case, names, got, np.array([*ANDREWS.values()]), 1e-7, SCHIEHLEN)
    rows.append(most(case, "largest gap of a joint [m]", outcome.result.joint_gap_max_m or 0.0, 1e-13))
    return Findings(rows, seconds=outcome.result.wall_s)


CASES = {
    "simple pendulum": simple_pendulum,
    "four-bars": bars,
    "bricard": bricard,
    "flyball governor": flyball,
    "andrews": squeezer,
}
