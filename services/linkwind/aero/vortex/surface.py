"""From plates to rings: where the corners and the collocation points lie, and which edge trails."""

from __future__ import annotations

import math

import numpy as np

from linkwind.aero.base import body_indices, item
from linkwind.aero.wind import wind_table
from linkwind.errors import ScenarioError
from linkwind.native.vortex import SurfaceTable
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.shapes import Plate
from linkwind.spatial import Array, Motion

ACROSS = 0.1  # share of the velocity along the chord below which no edge is clearly the trailing one


def plates(scenario: Scenario, provider: Provider) -> list[Plate]:
    """Return the plates of a provider.

    Raises:
        ScenarioError: a body is none.
    """
    found = []
    for index in body_indices(scenario, provider):
        shape = scenario.bodies[index].shape
        if not isinstance(shape, Plate):
            got = f'type "{shape.type}"' if shape else "none"
            raise ScenarioError(
                f'{scenario.where("bodies", index)}.shape: expected type "plate" with length and span, for '
                f'aero model "vortex"; got {got}. Add shape = {{ type = "plate", length = …, span = … }}.'
            )
        found.append(shape)
    return found


def surfaces(scenario: Scenario, provider: Provider, sides: Array) -> SurfaceTable:
    """Return the rings of all plates.

    A ring starts a quarter of a panel behind the panel's front, and no fluid passes at three quarters of
    it: in two dimensions that gives the exact lift and moment. The rings end a quarter of their width
    before the tips (R. T. Hough, J. Aircraft 10(5), 1973, doi:10.2514/3.44365).

    Args:
        scenario: all of it.
        provider: whose bodies are meant.
        sides: 1 where the trailing edge lies towards +x of the body, -1 where towards -x, shape (n,).

    Raises:
        ScenarioError: a body is no plate.
    """
    settings, size = provider.vortex, plates(scenario, provider)
    c, s = settings.chordwise, settings.spanwise
    corner, control = np.zeros((len(size), c + 1, s + 1, 3)), np.zeros((len(size), c, s, 3))
    for i, (plate, side) in enumerate(zip(size, sides.tolist(), strict=True)):
        panel, width = plate.length / c, plate.span / (s + 0.5)
        edges = -0.5 * plate.span + width * (np.arange(s + 1) + 0.25)
        corner[i, ..., 0] = side * (panel * (np.arange(c + 1) + 0.25) - 0.5 * plate.length)[:, None]
        corner[i, ..., 2] = edges
        control[i, ..., 0] = side * (panel * (np.arange(c) + 0.75) - 0.5 * plate.length)[:, None]
        control[i, ..., 2] = edges[:-1] + 0.5 * width
    return SurfaceTable(
        corner=corner,
        control=control,
        density=scenario.environment.density,
        step=scenario.coupling.step_ns / 1e9,
        core=settings.core * min(plate.length for plate in size),
        rows=settings.wake,
        wind=wind_table(scenario.environment),
        suction=settings.suction,
    )


def trailing(scenario: Scenario, provider: Provider, motion: Motion, wind: Array) -> Array:
    """Return on which side the trailing edge of each plate lies: as stated, or downstream at the start.

    Args:
        scenario: all of it.
        provider: whose plates are meant.
        motion: of all bodies, at the start.
        wind: at each plate [m/s], shape (n, 3).

    Returns:
        1 for +x of the body, -1 for -x, shape (n,).

    Raises:
        ScenarioError: it is not stated, and the air does not come along the chord.
    """
    sides = np.zeros(len(provider.bodies))
    axes = motion.rotation()
    for i, (name, body) in enumerate(zip(provider.bodies, body_indices(scenario, provider), strict=True)):
        stated = provider.vortex.trailing_edge.get(name)
        air = wind[i] - motion.linear[body]
        along, speed = float(air @ axes[body][:, 0]), math.hypot(*air.tolist())
        if stated is None and not abs(along) > ACROSS * speed:
            raise ScenarioError(
                f"{item(scenario, provider, 'vortex', 'trailing_edge')}: expected which edge of "
                f'"{name}" trails, for at the start the air comes across it, with {air.tolist()} m/s; got '
                f'nothing. Add {name} = "+x", or "-x", in the frame of the body.'
            )
        sides[i] = np.sign(along) if stated is None else {"+x": 1.0, "-x": -1.0}[stated]
    return sides
