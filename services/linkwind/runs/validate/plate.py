"""A thin plate: normal to a stream, and what it takes to accelerate it in a fluid at rest."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from linkwind.runs.validate.driven import Driven, Path
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row
from linkwind.runs.validate.scenes import CIRCLE, PLATE, communication_step, scene
from linkwind.runs.validate.signals import between, fit, frequency, whole_periods
from linkwind.spatial import Array

GOKTEPELI = "I. Göktepeli 2025"
EXACT = "exact, potential flow: H. Lamb 1932, Hydrodynamics, §71"
STOKES = "exact: G. G. Stokes 1851"

ADDED_MASS = np.pi / 4.0  # of a plate of length 1 in a fluid of density 1
ADDED_INERTIA = np.pi / 128.0


def normal(short: bool) -> Findings:
    """Mean drag and Strouhal number of a plate normal to a stream, Re 100; on a coarser grid as well."""
    del short
    found, case = Findings(), "plate normal to the stream, Re 100"
    for cells, within in ((32, 0.05), (24, None)):
        drag, beat, curve = _street(cells, 90.0, (36.0, 30.0))
        which = case if within else f"{case}, {cells} cells"
        found.rows.append(Row(which, "mean drag coefficient", drag, 2.42, within, GOKTEPELI))
        found.rows.append(Row(which, "Strouhal number", beat, 0.181, within, GOKTEPELI))
        if within:
            level = Curve("Göktepeli 2025: mean", np.array([90.0]), np.array([2.42]), True)
            found.plots.append(
                Plot("Plate normal to the stream, Re 100", "t U/c", "coefficient", (curve, level))
            )
    return found


def _street(cells: int, end: float, window: tuple[float, float]) -> tuple[float, float, Curve]:
    """Return mean drag coefficient and Strouhal number of the last 40 lengths, and the drag over time."""
    text = scene(
        PLATE,
        cells=cells,
        step=communication_step(0.08, cells),
        viscosity=0.01,
        window=window,
        wind=(1.0, 0.0),
        start_time=1.0,
    )
    driven = Driven(text)
    forces = driven.go(_kicked(0.3 / cells), steps=round(end / driven.h))
    t = forces.t[forces.t > end - 40.0]
    force = 2.0 * forces.wrench[-len(t) :, 0]
    first, last, _ = whole_periods(t, force[:, 1])
    # A plate without thickness has no force along itself: its street is seen in the torque.
    beat = frequency(t, forces.wrench[-len(t) :, 0, 2])
    mean = float(between(t, force[:, 0], first, last).mean())
    return mean, beat, Curve("drag", forces.t, 2.0 * forces.wrench[:, 0, 0])


def _kicked(aside: float) -> Path:
    """Return the path of an upright plate that is turned and turned back once: the street comes up early."""

    def path(t: float) -> tuple[Array, Array]:
        pose, twist = np.array([0.0, aside, 0.5 * np.pi]), np.zeros(3)
        s = (t - 4.0) / 4.0
        if 0.0 < s < 1.0:
            pose[2] += 0.2 * np.sin(np.pi * s) ** 2
            twist[2] = 0.2 * np.pi / 4.0 * np.sin(2.0 * np.pi * s)
        return pose, twist

    return path


def accelerated(
    cells: int, axis: int, *, shape: str = PLATE, side: float = 10.0, steps: int = 1000, angle: float = 0.0
) -> float:
    """Return force or torque over acceleration, density and length 1, of a body that starts to move.

    Over the first 200 steps the acceleration comes up; it is kept until the body has moved by half a cell,
    with practically no viscosity. The mean is over the second half, when the sound has gone.

    Args:
        cells: along the body.
        axis: 0, 1: along x, y; 2: about z.
        shape: of the body.
        side: of the window.
        steps: in all.
        angle: of the body [rad].
    """
    step, cell = 1e-3, 1.0 / cells
    text = scene(shape, cells=cells, step=step, viscosity=1e-6 * cell**2 / step, window=(side, side))
    size, rise = 1e-6 * cell / step**2 * (2.0 if axis == 2 else 1.0), 200 * step

    def path(t: float) -> tuple[Array, Array]:
        s, after = min(t / rise, 1.0), max(t - rise, 0.0)
        speed = size * (rise * (s**3 - 0.5 * s**4) + after)
        way = size * (rise**2 * (0.25 * s**4 - 0.1 * s**5) + 0.5 * rise * after + 0.5 * after**2)
        pose, twist = np.array([0.13 * cell, 0.21 * cell, angle]), np.zeros(3)
        pose[axis] += way
        twist[axis] = speed
        return pose, twist

    wrench = Driven(text).go(path, steps=steps).wrench[:, 0, axis]
    return -float(wrench[steps // 2 :].mean()) / size


def added(short: bool) -> Findings:
    """Added mass and added inertia of a thin plate."""
    found = Findings()
    sizes = (64,) if short else (16, 32, 64, 128)
    named = ((1, "added mass", ADDED_MASS), (2, "added inertia", ADDED_INERTIA))
    for axis, name, exact in named:
        values = np.array([accelerated(n, axis) / exact for n in sizes])
        at = sizes.index(64)
        found.rows.append(
            Row("thin plate, 64 cells", f"{name} over the exact one", values[at], 1.0, 0.03, EXACT)
        )
        if len(sizes) > 1:
            ones = Curve("exact", np.array(sizes, float), np.ones(len(sizes)))
            curves = (Curve("linkwind", np.array(sizes, float), values), ones)
            found.plots.append(Plot(f"Thin plate: {name}", "cells along the plate", "over exact", curves))
    return found


def stokes(short: bool) -> Findings:
    """A circle that oscillates by a fraction of a cell in a viscous fluid at rest."""
    found = Findings()
    for viscosity in (1e-3,) if short else (1e-4, 1e-3, 1e-2, 1e-1):
        got, exact = _small_oscillation(32, 2000, viscosity)
        case = f"circle oscillating, viscosity {viscosity:g} cells²/step"
        found.rows.append(Row(case, "force in phase with the acceleration", got[0], exact[0], 0.03, STOKES))
        # Against the velocity the force is the smaller part: counted by the whole.
        off = float(abs(got[1] - exact[1]) / np.hypot(*exact))
        what = "error in phase with the velocity, over the whole"
        found.rows.append(Row(case, what, off, 0.05, 0.0, STOKES, "most"))
    return found


def _small_oscillation(cells: int, period: int, viscosity: float) -> tuple[Array, tuple[float, float]]:
    """Return the force per displaced mass and acceleration, in phase with acceleration and velocity.

    As computed, and the exact one.
    """
    step, cell = 1e-3, 1.0 / cells
    text = scene(CIRCLE, cells=cells, step=step, viscosity=viscosity * cell**2 / step, window=(12.0, 12.0))
    rate, size = 2.0 * np.pi / (period * step), 0.3 * cell

    def path(t: float) -> tuple[Array, Array]:
        way = size * (1.0 - np.cos(rate * t))
        return np.array([0.13 * cell, 0.21 * cell + way, 0.0]), np.array(
            [0.0, size * rate * np.sin(rate * t), 0.0]
        )

    forces = Driven(text).go(path, steps=5 * period // 2)
    t, force = forces.t, forces.wrench[:, 0, 1]
    late = t > 1.5 * period * step
    unit = -size * rate**2 * ADDED_MASS
    got = fit(force[late], *(unit * wave(rate * t[late]) for wave in (np.cos, np.sin)))
    return got, stokes_force(0.5 * cells * np.sqrt(2.0 * np.pi / (period * viscosity)))


def stokes_force(radius: float) -> tuple[float, float]:
    """Return the force in phase with acceleration and velocity, per displaced mass and acceleration.

    It is 1 + 4 K₁(λ)/(λ K₀(λ)), λ = radius · √i.

    Args:
        radius: times √(rate / viscosity), without dimension.
    """
    z = radius * np.exp(0.25j * np.pi)
    value = 1.0 + 4.0 * _bessel_ratio(z) / z
    return float(value.real), -float(value.imag)


def _bessel_ratio(z: complex) -> complex:
    """Return K₁(z)/K₀(z) from K_ν(z) = ∫₀^∞ exp(-z cosh u) cosh(νu) du, with exp(-z) taken out."""
    u = np.linspace(0.0, 12.0 / np.sqrt(abs(z)) ** 0.5, 200001)
    weight = np.exp(-z * (np.cosh(u) - 1.0))
    weight[0] *= 0.5
    return complex((weight * np.cosh(u)).sum() / weight.sum())


CASES: dict[str, Callable[[bool], Findings]] = {
    "plate normal to a stream": normal,
    "added mass": added,
    "circle in a viscous fluid": stokes,
}
