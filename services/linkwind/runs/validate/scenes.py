"""Scenarios of the cases, in which length, speed and density are 1: the viscosity is 1/Re."""

from __future__ import annotations

CIRCLE = '{ type = "circle", diameter = 1.0 }'
PLATE = '{ type = "plate", length = 1.0 }'


def scene(
    shape: str,
    *,
    cells: float,
    step: float,
    viscosity: float,
    window: tuple[float, float],
    wind: tuple[float, float] = (0.0, 0.0),
    start_time: float = 0.0,
    body: str = "mass = 1.0\ninertia = 1.0",
    rest: str = "",
) -> str:
    """Return the scenario of one body as TOML.

    Args:
        shape: of the body.
        cells: along it.
        step: communication step [s].
        viscosity: [m²/s].
        window: width and height [m].
        wind: [m/s].
        start_time: in which the wind comes up [s]; 0 is an impulsive start.
        body: further keys of the body.
        rest: further tables.
    """
    return f"""
[time]
end = {step!r}
[environment]
gravity = [0.0, 0.0, 0.0]
density = 1.0
viscosity = {viscosity!r}
wind = [{wind[0]!r}, {wind[1]!r}]
[[bodies]]
name = "body"
{body}
shape = {shape}
[aero]
model = "flow"
[aero.flow]
cells = {cells!r}
window = [{window[0]!r}, {window[1]!r}]
frames = 0
start_time = {start_time!r}
[coupling]
step = {step!r}
[bus]
transport = "inprocess"
{rest}
"""


def communication_step(speed: float, cells: float) -> float:
    """Return the step [s], whole nanoseconds, in which a speed of 1 m/s goes ``speed`` cells."""
    return round(speed / cells, 9)
