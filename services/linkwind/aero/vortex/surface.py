"""From wings to rings: where the corners and the collocation points lie, and which edge trails."""

from __future__ import annotations

import math

import numpy as np

from linkwind.aero.base import body_indices, item
from linkwind.aero.planform import Thin, chord, ends, mean_chord, middle, thin
from linkwind.errors import ScenarioError
from linkwind.native.vortex import SurfaceTable
from linkwind.scenario import Provider, Scenario
from linkwind.spatial import Array, Motion
from linkwind.wind import wind_table

ACROSS = 0.1  # share of the velocity along the chord below which no edge is clearly the trailing one


def surfaces(scenario: Scenario, provider: Provider, sides: Array) -> SurfaceTable:
    """Return the rings of all wings.

    A ring starts a quarter of a panel behind the panel's front, and no fluid passes at three quarters of
    it: in two dimensions that gives the exact lift and moment. The rings end a quarter of their width
    before the tips (R. T. Hough, J. Aircraft 10(5), 1973, doi:10.2514/3.44365), so those of a pointed wing
    have a chord there too.

    Args:
        scenario: all of it.
        provider: whose bodies are meant.
        sides: 1 where the trailing edge lies towards +x of the body, -1 where towards -x, shape (n,).

    Raises:
        ScenarioError: a body is neither plate nor wing.
    """
    settings, wings = provider.vortex, thin(scenario, provider)
    c, s = settings.chordwise, settings.spanwise
    corner, control = np.zeros((len(wings), c + 1, s + 1, 3)), np.zeros((len(wings), c, s, 3))
    for i, (wing, side) in enumerate(zip(wings, sides.tolist(), strict=True)):
        width = wing.span / (s + 0.5)
        edges = np.asarray(ends(wing)[0] + width * (np.arange(s + 1) + 0.25), np.float64)
        ahead, chords = _chords(wing, side, edges)
        panel = chords / c
        corner[i, ..., 0] = side * (panel * (np.arange(c + 1) + 0.25)[:, None] - ahead)
        corner[i, ..., 2] = edges
        behind = side * (panel * (np.arange(c) + 0.75)[:, None] - ahead)
        control[i, ..., 0] = 0.5 * (behind[:, :-1] + behind[:, 1:])
        control[i, ..., 2] = edges[:-1] + 0.5 * width
    return SurfaceTable(
        corner=corner,
        control=control,
        density=scenario.environment.density,
        step=scenario.coupling.step_ns / 1e9,
        core=settings.core * min(map(mean_chord, wings)),
        rows=settings.wake,
        wind=wind_table(scenario.environment, scenario.source),
        suction=settings.suction,
    )


def _chords(wing: Thin, side: float, z: Array) -> tuple[Array, Array]:
    """Return how far ahead of the centre of mass the leading edge lies, and the chord [m], each as z."""
    low, high = np.array([chord(wing, at) for at in z.tolist()]).T
    return -low if side > 0.0 else high, high - low


def middles(wings: list[Thin], axes: Array) -> Array:
    """Return the centres of area of wings from their centres of mass [m], shape (n, 3), in W.

    Args:
        wings: n of them.
        axes: x, y and z of each body as columns, shape (n, 3, 3).
    """
    places = np.array([middle(wing) for wing in wings])
    found: Array = places[:, :1] * axes[:, :, 0] + places[:, 1:] * axes[:, :, 2]
    return found


def trailing(scenario: Scenario, provider: Provider, motion: Motion, arms: Array, wind: Array) -> Array:
    """Return on which side the trailing edge of each wing lies: as stated, or downstream at the start.

    Args:
        scenario: all of it.
        provider: whose wings are meant.
        motion: of all bodies, at the start.
        arms: centres of area, see ``middles`` [m], shape (n, 3).
        wind: there [m/s], shape (n, 3).

    Returns:
        1 for +x of the body, -1 for -x, shape (n,).

    Raises:
        ScenarioError: it is not stated, and the air does not come along the chord.
    """
    sides = np.zeros(len(provider.bodies))
    axes = motion.rotation()
    for i, (name, body) in enumerate(zip(provider.bodies, body_indices(scenario, provider), strict=True)):
        stated = provider.vortex.trailing_edge.get(name)
        air = wind[i] - motion.linear[body] - np.cross(motion.angular[body], arms[i])
        along, speed = float(air @ axes[body][:, 0]), math.hypot(*air.tolist())
        if stated is None and not abs(along) > ACROSS * speed:
            raise ScenarioError(
                f"{item(scenario, provider, 'vortex', 'trailing_edge')}: expected which edge of "
                f'"{name}" trails, for at the start the air comes across it, with {air.tolist()} m/s; got '
                f'nothing. Add {name} = "+x", or "-x", in the frame of the body.'
            )
        sides[i] = np.sign(along) if stated is None else {"+x": 1.0, "-x": -1.0}[stated]
    return sides
