"""Scenarios of one body in a flow in space, and bodies in it that are driven.

Length, speed and density are 1: of a sphere its diameter, of a wing its chord.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from linkwind import aero
from linkwind.aero.flow import Flow
from linkwind.scenario import loads
from linkwind.spatial import Array, Motion, Wrench

SPHERE = '{ type = "ellipsoid", size = [1.0, 1.0, 1.0] }'
SPHERE_VOLUME = math.pi / 6.0
SPEED = 0.08  # cells a step of the stream: a Mach number of 0.14
THREADS = 2
CALIBRATED = "; markers are calibrated on it"  # where a row is no independent evidence

Course = Callable[[float], tuple[Array, Array]]
"""Position [m] and rotation vector [rad], and twist [m/s, rad/s], at a time [s], each (6,)."""

Watch = Callable[[Flow, Wrench, int], None]
"""Sees the flow before each of its steps, with the wrench of this step, its diagnostics, and its number."""


def plate(chord: float, span: float) -> str:
    """Return the shape of a plate with its chord along x and its span along z [m]."""
    return f'{{ type = "plate", length = {chord!r}, span = {span!r} }}'


def scene(
    shape: str,
    cells: float,
    step: float,
    viscosity: float,
    window: tuple[float, float, float],
    *,
    wind: tuple[float, float, float] = (0.0, 0.0, 0.0),
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
    start_time: float = 0.0,
    end: float | None = None,
    body: str = "mass = 1.0\ninertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]",
    rest: str = "",
) -> str:
    """Return the scenario of one body in space as TOML.

    Args:
        shape: of the body.
        cells: along its longest extent.
        step: communication step [s].
        viscosity: [m²/s].
        window: width, height and depth [m].
        wind: [m/s].
        gravity: [m/s²].
        start_time: in which the wind comes up [s]; 0 is an impulsive start.
        end: of the run [s]; of a driven body nobody asks.
        body: further keys of the body.
        rest: further tables.
    """
    return f"""
[time]
end = {step if end is None else end!r}
[environment]
gravity = {list(gravity)!r}
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
threads = {THREADS}
start_time = {start_time!r}
[coupling]
step = {step!r}
timeout = 60.0
[bus]
transport = "inprocess"
{rest}
"""


def driven(text: str, course: Course, steps: int, watch: Watch | None = None) -> tuple[Array, Array]:
    """Return the middle of each step [s], and the wrench (steps, 6) on a body that goes a course."""
    case = loads(text, "validation")
    model = aero.build(case, case.providers[0])
    assert isinstance(model, Flow)
    h = case.coupling.step_ns / 1e9
    wrench, found = Wrench.zeros(1), np.empty((steps, 6))
    wrench.diagnostics = np.zeros(len(model.capabilities.diagnostics))
    model.commit(0.0, _motion(*course(0.0)))
    for k in range(steps):
        there = _motion(*course((k + 1) * h))
        model.evaluate((k + 1) * h, there, wrench)
        found[k] = np.concatenate([wrench.force[0], wrench.torque[0]])
        if watch:
            watch(model, wrench, k)
        model.commit((k + 1) * h, there)
    return np.asarray((np.arange(steps) + 0.5) * h, np.float64), found


def still(*turned: float) -> Course:
    """Return the course of a body that stays where it is, turned by a vector [rad]."""
    pose, twist = np.array([0.0, 0.0, 0.0, *(turned or (0.0, 0.0, 0.0))]), np.zeros(6)
    return lambda t: (pose, twist)


def _motion(place: Array, twist: Array) -> Motion:
    out, angle = Motion.at_rest(1), float(np.linalg.norm(place[3:]))
    out.position[0], out.linear[0], out.angular[0] = place[:3], twist[:3], twist[3:]
    out.orientation[0, 0] = math.cos(0.5 * angle)
    out.orientation[0, 1:] = place[3:] * (math.sin(0.5 * angle) / angle if angle else 0.5)
    return out
