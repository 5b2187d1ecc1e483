"""Bodies that the fluid moves, each a whole run: a light plate, a cylinder on a spring, a falling plate."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from linkwind.errors import FaultError, SimulationError
from linkwind.log.reader import open_log
from linkwind.log.tables import Trajectory
from linkwind.runs.run import run
from linkwind.runs.validate.plate import ADDED_INERTIA, ADDED_MASS, EXACT
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row
from linkwind.runs.validate.scenes import PLATE, scene
from linkwind.runs.validate.signals import amplitude, frequency
from linkwind.scenario import Scenario, load, loads
from linkwind.spatial import Array

AHN = "H. T. Ahn, Y. Kallinderis 2006, doi:10.1016/j.jcp.2006.04.011"
BORAZJANI = "I. Borazjani, L. Ge, F. Sotiropoulos 2008, doi:10.1016/j.jcp.2008.04.028"
ANDERSEN = "A. Andersen, U. Pesavento, Z. J. Wang 2005, doi:10.1017/S002211200500594X"

RATIOS = (2.0, 1.0, 0.3, 0.1, 0.01, 0.0)  # mass over added mass


def flown(scenario: Scenario, to_the_end: bool = True) -> Trajectory:
    """Run a scenario; return its trajectory, up to where it failed unless it must go to the end.

    Raises:
        LinkwindError: the run ended early.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        try:
            run(scenario, out, lambda step: None)
        except (SimulationError, FaultError):
            if to_the_end:
                raise
        return open_log(out / "log.mcap").trajectory()


def light_plate(
    ratio: float, scheme: str, *, cells: int = 48, steps: int = 1000, carried: float = 0.0
) -> Scenario:
    """Return a plate at rest in the fluid that a constant force pushes along its normal.

    The force comes up over the first 200 steps, and is such that the plate shall accelerate by 1e-6 cells a
    step², so that it moves by half a cell.

    Args:
        ratio: mass over added mass; inertia over added inertia as well, but at least 1e-4.
        scheme: of the coupling.
        cells: along the plate.
        steps: of the run.
        carried: speed of the fluid, and of the plate with it, along the plate [cells/step]. Above 0.12 there
            are several lattice steps in a step.
    """
    step = 1e-3
    cell = 1.0 / cells
    force = 1e-6 * cell / step**2 * (1.0 + ratio) * ADDED_MASS
    speed = carried * cell / step
    body = f"mass = {ratio * ADDED_MASS!r}\ninertia = {max(ratio, 1e-4) * ADDED_INERTIA!r}"
    text = scene(
        PLATE, cells=cells, step=step, viscosity=1e-6 * cell**2 / step, window=(10.0, 10.0),
        wind=(speed, 0.0), body=f"{body}\nvelocity = [{speed!r}, 0.0]",
    )  # fmt: skip
    text = text.replace("[aero]", '[[providers]]\nname = "fluid"').replace("[aero.flow]", "[providers.flow]")
    return loads(
        f"""{text}
[[providers]]
name = "push"
model = "field"
[providers.field.body]
let = {{ s = "min(t / {200 * step!r}, 1)" }}
fy = "{force!r} * s * s * (3 - 2 * s)"
""",
        "light_plate",
        [f"time.end={steps * step!r}", f'coupling.scheme="{scheme}"', "coupling.timeout=60.0"],
    )


def acceleration(path: Trajectory) -> float:
    """Return the mean acceleration along y over the second half of a run [m/s²]."""
    half = len(path.t) // 2
    speed = path.linear[:, 0, 1]
    return float((speed[-1] - speed[half]) / (path.t[-1] - path.t[half]))


def fastest(path: Trajectory) -> float:
    """Return the largest speed that the plate's middle, or its turning its ends, has had [m/s]."""
    return float((np.abs(path.linear[:, 0, 1]) + 0.5 * np.abs(path.angular[:, 0, 2])).max())


def light(short: bool) -> Findings:
    """A plate of little or no mass, pushed along its normal: force over (mass + added mass)."""
    found = Findings()
    expected = 1e-6 / 48 / 1e-6
    for ratio in (0.3, 0.0) if short else RATIOS:
        value = acceleration(flown(light_plate(ratio, "pec"))) / expected
        case = f"free plate, mass {ratio:g} of the added mass"
        found.rows.append(Row(case, "acceleration over force / (mass + added mass)", value, 1.0, 0.03, EXACT))
    found.rows.append(_explicit_fails())
    return found


def _explicit_fails() -> Row:
    """The plain scheme on the same plate: how far its speed goes beyond what it should be."""
    path = flown(light_plate(0.3, "explicit"), to_the_end=False)
    right = 1e-6 / 48 / 1e-6 * path.t[-1]
    beyond = fastest(path) / right
    return Row(
        "free plate, mass 0.3 of the added mass, scheme explicit",
        "blows up: right over largest speed", 1.0 / beyond, 0.01, 0.0,
        "unstable where the added mass is more than the mass", "most",
    )  # fmt: skip


def vibrating(short: bool) -> Findings:
    """A cylinder that is free to move across the stream, Re 150, reduced mass 2, reduced velocity 4."""
    settings = ["bus.transport=inprocess", "coupling.timeout=60.0", "aero.flow.frames=0"]
    if not short:
        settings += ["aero.flow.window=[36.0, 30.0]", "time.end=120.0"]
    path = flown(load("vortex_induced_vibration", settings))
    y = path.position[:, 0, 1]
    late = path.t > 0.75 * path.t[-1]
    size = amplitude(y[late])
    case = "cylinder free to move across the stream, Re 150"
    rows = [
        Row(case, "amplitude over diameter", size, 0.5616, 0.05, AHN),
        Row(case, "amplitude over diameter, the other reference", size, 0.5286, None, BORAZJANI),
        Row(case, "frequency over the natural one", 4.0 * frequency(path.t[late], y[late]), 1.0, None, AHN),
    ]
    end = np.full(2, path.t[-1])
    curves = (
        Curve("linkwind", path.t, y),
        Curve("Ahn & Kallinderis 2006", end, np.array([0.5616, -0.5616]), True),
        Curve("Borazjani et al. 2008", end, np.array([0.5286, -0.5286]), True),
    )
    return Findings(rows, [Plot("Cylinder free to move across the stream, Re 150", "t U/D", "y/D", curves)])


def falling(short: bool) -> Findings:
    """An ellipse of 1/8 that falls in water: it tumbles. Chaotic, so that its means are only reported."""
    settings = ["bus.transport=inprocess", "coupling.timeout=60.0", "aero.flow.frames=0"]
    del short
    path = flown(load("falling_plate", settings))
    late = path.t > 0.5 * path.t[-1]  # it flutters at first
    w, z = path.orientation[:, 0, 0], path.orientation[:, 0, 3]
    turned = np.unwrap(2.0 * np.arctan2(z, w))[late]
    span = float(np.ptp(path.t[late]))
    way = 100.0 * (path.position[-1, 0] - path.position[late][0, 0])
    rate = float(abs(turned[-1] - turned[0])) / span
    case = "falling plate, ellipse 1:8, density 2.7"
    rows = [
        Row(case, "mean horizontal speed [cm/s]", float(abs(way[0])) / span, 15.1, None, ANDERSEN),
        Row(case, "mean vertical velocity [cm/s]", float(way[1]) / span, -11.8, None, ANDERSEN),
        Row(case, "mean turn rate [rad/s]", rate, 15.0, None, ANDERSEN),
        Row(case, "turns on (1) or to and fro (0)", float(_tumbles(turned)), 1.0, None, ANDERSEN),
    ]
    curve = Curve("linkwind", 100 * path.position[:, 0, 0], 100 * path.position[:, 0, 1])
    return Findings(rows, [Plot("Falling plate: way of its centre", "x [cm]", "y [cm]", (curve,))])


def _tumbles(angle: Array) -> bool:
    """Return whether a plate turns on, at least half a turn, rather than to and fro."""
    way = angle[-1] - angle[0]
    on = angle if way > 0.0 else -angle
    return bool(abs(way) > np.pi and (np.maximum.accumulate(on) - on).max() < 0.5)


def hinged(short: bool) -> Findings:
    """The joint force on one link against that on the other, each from the momentum of its link."""
    scenario = load(
        "two_link_flow",
        ["bus.transport=inprocess", "coupling.timeout=60.0", "aero.flow.frames=0", "time.end=0.05"],
    )
    path = flown(scenario)
    mass = np.array([body.mass for body in scenario.bodies])[:, None]
    weight = mass * np.array(scenario.environment.gravity)
    gained = mass * np.diff(path.linear, axis=0) / np.diff(path.t)[:, None, None]
    pull = gained - weight - path.wrench[1:, :, :3]
    off = float(np.abs(pull.sum(axis=1)).max() / np.abs(pull).max())
    case = "two links on a hinge in a flow"
    row = Row(case, "sum of the hinge's forces over the largest", off, 0.01, 0.0, "exact: 0", "most")
    return Findings([row])


CASES: dict[str, Callable[[bool], Findings]] = {
    "light plate": light,
    "two links on a hinge": hinged,
    "vortex-induced vibration": vibrating,
    "falling plate": falling,
}
