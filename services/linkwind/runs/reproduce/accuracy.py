"""Fig. 7: the velocities of both links under a given field, the paper's scheme against the exact solution."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwind.log.reader import open_log
from linkwind.log.tables import Trajectory
from linkwind.runs.reproduce.claims import Claim
from linkwind.runs.reproduce.equations import EXACT, ODE45, Equations
from linkwind.runs.run import run
from linkwind.scenario import Scenario, load
from linkwind.spatial import Array

CHANNELS = ("Vx", "Vy", "omega")
# Mean errors of Vx, Vy, ω of link 1, then of link 2 [%]: Fig. 7 and the text to it.
PAPER = np.array([1.46, 0.84, 1.87, 1.15, 0.82, 0.43])
STEP = 1e-3  # s
INCREMENTAL = ("coupling.scheme=explicit", "dynamics.integrator=euler")
PREDICTED = ("coupling.scheme=pec", "coupling.order=3")


@dataclass(frozen=True)
class Velocities:
    """Velocities of both links at the communication points.

    Attributes:
        t: [s], shape (k,).
        by: Vx, Vy [m/s], ω [rad/s] of link 1, then of link 2, shape (k, 6), by how they were computed.
        errors: mean errors against the exact ones [%], shape (6,), likewise.
        smallest: step of ode45 [s].
    """

    t: Array
    by: dict[str, Array]
    errors: dict[str, Array]
    smallest: float


def velocities(name: str, folder: Path, step: float = STEP) -> Velocities:
    """Fly a built-in scenario of two links in a field: exactly, by ode45, incrementally, by ``pec``."""
    flown = {
        scheme: _flown(
            name, (*how, f"coupling.step={step!r}"), folder / f"{name}-{scheme}-{step * 1e6:.0f}us"
        )
        for scheme, how in (("incremental", INCREMENTAL), ("pec", PREDICTED))
    }
    scenario, path = flown["pec"]
    equations, t = Equations(scenario, path), path.t
    exact, _ = equations.solve(t, **EXACT)
    rough, steps = equations.solve(t, **ODE45)
    by = {"exact": exact, "ode45": rough} | {scheme: _six(path) for scheme, (_, path) in flown.items()}
    errors = {scheme: mean_error(found, exact) for scheme, found in by.items() if scheme != "exact"}
    return Velocities(t, by, errors, float(steps[1:-1].min()))  # the first is a guess, the last is cut


def mean_error(found: Array, exact: Array) -> Array:
    """Return the mean error of each channel [%]: the sum of all differences over the sum of all values."""
    return np.asarray(100.0 * np.abs(found - exact).sum(axis=0) / np.abs(exact).sum(axis=0))


def _flown(name: str, overrides: tuple[str, ...], out: Path) -> tuple[Scenario, Trajectory]:
    scenario = load(name, [*overrides, 'bus.transport="inprocess"'])
    return scenario, open_log(run(scenario, out, lambda step: None).log).trajectory()


def _six(path: Trajectory) -> Array:
    """Return the velocities of both links, shape (k, 6)."""
    return np.dstack([path.linear[:, :, :2], path.angular[:, :, 2:]]).reshape(-1, 6)


def claims(field: Velocities, gust: Velocities, folder: Path) -> list[Claim]:
    """Judge what the paper says about accuracy and steps."""
    worst = float((field.errors["incremental"] / PAPER).max())
    better = float((field.errors["incremental"] / field.errors["pec"]).min())
    as_ode45 = velocities("two_link_field", folder, _dividing(float(field.t[-1]), field.smallest))
    ratio = float((as_ode45.errors["incremental"] / PAPER).max())
    milliseconds = f"{1e3 * field.smallest:.2f}"
    return [
        Claim(
            "The incremental scheme follows the exact solution to 0.43 … 1.87 % in six velocities (Fig. 7).",
            f"largest error over the paper's, field F0 at {1e3 * STEP:g} ms; holds up to 1",
            worst, worst <= 1.0,
        ),
        Claim(
            "A step as small as the smallest that ode45 takes is small enough.",
            f"the same at that step, {milliseconds} ms; holds up to 1", ratio, ratio <= 1.0,
        ),
        Claim(
            "ode45 is the exact solution to compare with.",
            "its largest error against DOP853 at 1e-12, fields F0 and F1 [%]; holds below 0.1",
            *_of_ode45(field, gust),
        ),
        Claim(
            "The error of a step comes from forces that are one step old.",
            "by how much pec, with as many exchanges, is better, least of six; holds from 10 on",
            better, better >= 10.0,
        ),
    ]  # fmt: skip


def _dividing(end: float, most: float) -> float:
    """Return the longest step up to ``most`` [s], in whole nanoseconds, that divides the time to ``end``."""
    end_ns, steps = round(1e9 * end), math.ceil(end / most)
    while end_ns % steps:
        steps += 1
    return end_ns // steps / 1e9


def _of_ode45(field: Velocities, gust: Velocities) -> tuple[float, bool]:
    largest = float(max(each.errors["ode45"].max() for each in (field, gust)))
    return largest, largest < 0.1
