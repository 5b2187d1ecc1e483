"""A flow in three dimensions: a sphere and plates against exact and published values, light bodies, impulse.

Length, speed and density are 1: of the sphere its diameter.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linkwind import aero
from linkwind.runs.validate.free import flown
from linkwind.runs.validate.plate import EXACT
from linkwind.runs.validate.rows import Curve, Findings, Plot, Row, most
from linkwind.runs.validate.vortex.wings import ADDED, DNV
from linkwind.scenario import loads
from linkwind.spatial import Array, Motion, Wrench

CLIFT = "L. Schiller, A. Naumann 1933, as in R. Clift, J. R. Grace, M. E. Weber 1978, within 5 %"
STOKES = "G. G. Stokes 1851; L. D. Landau, E. M. Lifshitz, Fluid Mechanics, § 24"

SPHERE = '{ type = "ellipsoid", size = [1.0, 1.0, 1.0] }'
SPHERE_VOLUME = math.pi / 6.0

Course = Callable[[float], tuple[Array, Array]]
"""Position [m] and rotation vector [rad], and twist [m/s, rad/s] at a time [s], each (6,)."""


def text(
    shape: str,
    cells: float,
    step: float,
    viscosity: float,
    window: tuple[float, float, float],
    *,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    body: str = "mass = 1.0\ninertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]",
    rest: str = "",
) -> str:
    """Return the scenario of one body in space as TOML; the stream is there at once."""
    return f"""
[time]
end = {step!r}
[environment]
gravity = [0.0, 0.0, 0.0]
density = 1.0
viscosity = {viscosity!r}
wind = {list(wind)!r}
[[bodies]]
name = "body"
{body}
shape = {shape}
[[providers]]
name = "fluid"
model = "flow"
[providers.flow]
dimensions = 3
cells = {cells!r}
window = {list(window)!r}
frames = 0
start_time = 0.0
[coupling]
step = {step!r}
timeout = 60.0
[bus]
transport = "inprocess"
{rest}
"""


def driven(scenario: str, course: Course, steps: int) -> tuple[Array, Array]:
    """Return the middle of each step [s], and the wrench (steps, 6) on a body that goes a course."""
    case = loads(scenario, "validation")
    model = aero.build(case, case.providers[0])
    h = case.coupling.step_ns / 1e9
    wrench, found = Wrench.zeros(1), np.empty((steps, 6))
    model.commit(0.0, _motion(*course(0.0)))
    for k in range(1, steps + 1):
        there = _motion(*course(k * h))
        model.evaluate(k * h, there, wrench)
        model.commit(k * h, there)
        found[k - 1] = np.concatenate([wrench.force[0], wrench.torque[0]])
    return np.asarray((np.arange(steps) + 0.5) * h, np.float64), found


def _motion(place: Array, twist: Array) -> Motion:
    out, angle = Motion.at_rest(1), float(np.linalg.norm(place[3:]))
    out.position[0], out.linear[0], out.angular[0] = place[:3], twist[:3], twist[3:]
    out.orientation[0, 0] = math.cos(0.5 * angle)
    out.orientation[0, 1:] = place[3:] * (math.sin(0.5 * angle) / angle if angle else 0.5)
    return out


def _still(t: float) -> tuple[Array, Array]:
    return np.zeros(6), np.zeros(6)


def sphere(short: bool) -> Findings:
    """The drag of a sphere that stands in a stream."""
    rows, curves = [], []
    cells, window = (12, (7.0, 6.0, 6.0)) if short else (20, (10.0, 8.0, 8.0))
    for re in (100,) if short else (20, 100, 200):
        step = round(0.08 / cells, 9)
        scenario = text(SPHERE, cells, step, 1.0 / re, window, wind=(1.0, 0.0, 0.0))
        t, wrench = driven(scenario, _still, round((8.0 if short else 12.0) / step))
        drag = wrench[:, 0] / (0.125 * math.pi)
        law = 24.0 / re * (1.0 + 0.15 * re**0.687)
        case = f"sphere in a stream, Re {re}"
        late = t > 0.85 * t[-1]
        rows.append(Row(case, "drag coefficient", float(drag[late].mean()), law, 0.06, CLIFT))
        across = np.abs(wrench[late][:, 1:]).max() / wrench[late][:, 0].mean()
        rows.append(most(case, "any other component over the drag", float(across), 1e-3))
        curves.append(Curve(f"Re {re}", t[t > 0.5], drag[t > 0.5]))
    return Findings(rows, [Plot("Sphere in a stream", "t U/D", "drag coefficient", tuple(curves))])


def oscillating(short: bool) -> Findings:
    """A sphere that oscillates in a fluid at rest: Stokes' force, amplitude and phase."""
    rows = []
    cells = 16 if short else 24
    for womersley in (4.0,) if short else (2.0, 4.0, 8.0):  # radius over the depth of the layer
        a, rate = 0.5, 2.0 * math.pi
        depth = a / womersley
        viscosity = 0.5 * rate * depth**2
        size, steps = 0.01, 40 * cells
        step = round(1.0 / steps, 9)

        def course(t: float, size: float = size, rate: float = rate) -> tuple[Array, Array]:
            s, c, zero = math.sin(rate * t), math.cos(rate * t), np.zeros(5)
            return np.append(-size * c, zero), np.append(size * rate * s, zero)

        window = (6.0, 6.0, 6.0)
        t, wrench = driven(text(SPHERE, cells, step, viscosity, window), course, 2 * steps)
        late = t > 1.0
        seen = 2.0 * np.mean(wrench[late, 0] * np.exp(-1j * rate * t[late]))
        speed = -1j * size * rate  # of sin, as the part along exp(i rate t)
        drag = 6.0 * math.pi * viscosity * a * (1.0 + womersley)
        mass = SPHERE_VOLUME * (0.5 + 2.25 / womersley)
        force = -(drag + 1j * rate * mass) * speed
        case = f"sphere that oscillates, radius {womersley:g} times the sheared layer"
        rows.append(Row(case, "amplitude of the force", abs(seen), abs(force), 0.04, STOKES))
        rows.append(
            Row(
                case, "phase of the force before the speed [deg]",
                math.degrees(np.angle(-seen / speed)), math.degrees(np.angle(-force / speed)), 0.06, STOKES,
            )
        )  # fmt: skip
    return Findings(rows)


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

    scenario = text(shape, cells, step, 1e-6 * cell**2 / step, (side, side, side))
    _, wrench = driven(scenario, course, steps)
    return -float(wrench[steps // 2 :, axis].mean()) / size


def added(short: bool) -> Findings:
    """The mass of fluid that a sphere, and plates, accelerate with them."""
    found, cells, steps = Findings(), 20 if short else 32, 400 if short else 800
    sphere = accelerated(SPHERE, cells, 0, 5.0, steps) / (0.5 * SPHERE_VOLUME)
    found.rows.append(Row("sphere that starts to move", "added mass over exact", sphere, 1.0, 0.04, EXACT))
    for aspect, chord in ((1.0, 1.0), (2.0, 0.5)):
        shape = f'{{ type = "plate", length = {chord!r}, span = 1.0 }}'
        exact = ADDED[aspect] * 0.25 * math.pi * chord**2
        value = accelerated(shape, cells, 1, 5.0, steps) / exact
        case = f"plate of aspect ratio {aspect:g} that starts to move along its normal"
        found.rows.append(Row(case, "added mass over the published", value, 1.0, 0.06, DNV))
    return found


def light(short: bool) -> Findings:
    """Bodies that a force pushes: a plate of little or no mass, and a sphere as heavy as its fluid."""
    square = '{ type = "plate", length = 1.0, span = 1.0 }'
    plate = ADDED[1.0] * 0.25 * math.pi
    cases = [("square plate without mass", square, "fy", 0.0, plate)]
    if not short:
        cases.append(("square plate of a tenth of its added mass", square, "fy", 0.1 * plate, plate))
        cases.append(("sphere as heavy as its fluid", SPHERE, "fx", SPHERE_VOLUME, 0.5 * SPHERE_VOLUME))
    rows = []
    for case, shape, along, mass, added_mass in cases:
        rate = _pushed(shape, along, mass, mass + added_mass)
        what = "acceleration over force / (mass + added mass)"
        rows.append(Row(f"{case}, free", what, rate, 1.0, 0.05, DNV if shape == square else EXACT))
    return Findings(rows)


def _pushed(shape: str, along: str, mass: float, moved: float) -> float:
    """Return the acceleration of a free body by a force that comes up, over force / moved mass."""
    cells, steps, step = 32, 500, 1e-3
    cell = 1.0 / cells
    size = 1e-6 * cell / step**2
    push = f"""
[[providers]]
name = "push"
model = "field"
[providers.field.body]
let = {{ s = "min(t / {200 * step!r}, 1)" }}
{along} = "{size * moved!r} * s * s * (3 - 2 * s)"
"""
    inertia = ", ".join(["0.02"] * 3 + ["0.0"] * 3)
    body = f"mass = {mass!r}\ninertia = [{inertia}]"
    viscosity = 1e-6 * cell**2 / step
    scenario = text(shape, cells, step, viscosity, (4.0, 4.0, 4.0), body=body, rest=push)
    path = flown(loads(scenario, "pushed", [f"time.end={steps * step!r}"]))
    half, speed = len(path.t) // 2, path.linear[:, 0, "xyz".index(along[1])]
    return float((speed[-1] - speed[half]) / (path.t[-1] - path.t[half])) / size


CASES: dict[str, Callable[[bool], Findings]] = {
    "sphere in a stream": sphere,
    "oscillating sphere": oscillating,
    "added mass in space": added,
    "light bodies in space": light,
}
