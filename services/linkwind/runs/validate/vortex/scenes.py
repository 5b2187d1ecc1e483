"""Plates in the flow of vortex rings, in which the chord, the stream and the density are 1."""

from __future__ import annotations

from linkwind.spatial import Array

SPAN = 1e4  # of a plate in two dimensions: a single ring, whose ends are felt by 1e-4 of the span alone
WIDTH = SPAN / 1.5  # of that ring


def wing(
    span: float,
    *,
    rings: tuple[int, int],
    step: float,
    rows: int,
    wind: float = 1.0,
    core: float = 0.01,
    gust: str = "",
    planform: Array | None = None,
) -> str:
    """Return the scenario of one plate as TOML.

    Args:
        span: of the plate, in chords.
        rings: along the chord and the span.
        step: communication step, in chords that the stream goes.
        rows: of the wake.
        wind: along x; 0 where the plate goes through air at rest.
        core: radius of the wake's cores; small, for it is no part of the theories.
        gust: keys of a gust.
        planform: corners (x, z) of a wing in place of the plate, shape (corners, 2).
    """
    shape = f'type = "plate", length = 1.0, span = {span!r}'
    if planform is not None:
        shape = f'type = "wing", points = {planform.tolist()}'
    return f"""
[time]
end = {step!r}
[environment]
gravity = [0.0, 0.0, 0.0]
density = 1.0
wind = [{wind!r}, 0.0]
{f"[[environment.gusts]]{chr(10)}{gust}" if gust else ""}
[[bodies]]
name = "wing"
mass = 1.0
inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
position = [0.0, 0.0, 0.0]
shape = {{ {shape} }}
[aero]
model = "vortex"
[aero.vortex]
chordwise = {rings[0]}
spanwise = {rings[1]}
wake = {rows}
core = {core!r}
trailing_edge = {{ wing = "+x" }}
[coupling]
step = {step!r}
[bus]
transport = "inprocess"
"""


def communication_step(length: float) -> float:
    """Return the step, whole nanoseconds, in which the stream goes this far [chords]."""
    return round(length, 9)
