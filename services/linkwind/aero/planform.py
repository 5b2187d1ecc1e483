"""Planforms of thin wings: which part of one lies where, seen along the body's y axis.

Places are (x, z) in the frame of the body from its centre of mass [m]: the chord lies along x, the span along
z. A plate is a rectangle about the centre of mass, a wing any polygon that no line along x meets twice.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from linkwind.aero.base import body_indices
from linkwind.errors import ScenarioError
from linkwind.scenario import Provider, Scenario
from linkwind.scenario.shapes import Plate, Wing
from linkwind.spatial import Array

Thin = Plate | Wing

NODE = 0.28867513459481287  # of Gauss' rule with two points, from the middle, over the interval: 1/sqrt(12)
CLOSE = 1e-9  # of a strip's width: corners as near as this to its ends lie on them


def thin(scenario: Scenario, provider: Provider) -> list[Thin]:
    """Return the shapes of a provider's bodies.

    Raises:
        ScenarioError: one is neither plate nor wing.
    """
    found: list[Thin] = []
    for index in body_indices(scenario, provider):
        shape = scenario.bodies[index].shape
        if not isinstance(shape, Plate | Wing):
            got = f'type "{shape.type}"' if shape else "none"
            raise ScenarioError(
                f'{scenario.where("bodies", index)}.shape: expected type "plate" or "wing", for aero model '
                f'"{provider.model}"; got {got}. Add shape = {{ type = "plate", length = …, span = … }}.'
            )
        found.append(shape)
    return found


def ends(shape: Thin) -> tuple[float, float]:
    """Return the least and the largest z."""
    if isinstance(shape, Plate):
        return -0.5 * shape.span, 0.5 * shape.span
    along = [z for _, z in shape.points]
    return min(along), max(along)


def chord(shape: Thin, z: float) -> tuple[float, float]:
    """Return the least and the largest x of the chord at z, between both ends."""
    if isinstance(shape, Plate):
        return -0.5 * shape.length, 0.5 * shape.length
    found = shape.chord(z)
    assert found is not None, f"one chord at z = {z}"
    return found


def strips(shape: Thin, count: int) -> Array:
    """Return mean chord and centre of area (x, z) of equal strips of the span, from -z on, (count, 3)."""
    if isinstance(shape, Plate):
        return np.array([(shape.length, 0.0, z) for z in _evenly(shape.span, count)])
    low, high = ends(shape)
    inner = [low + (high - low) * k / count for k in range(1, count)]
    return np.array([_strip(shape, a, b) for a, b in pairwise([low, *inner, high])])


def relative(shapes: Sequence[Thin], count: int) -> Array:
    """Return the strips of shapes as ``native.forces.PlateTable`` has them, shape (n, count, 3).

    Over mean chord and span, so that they stay what they are where an FMU's user scales these.

    Returns:
        Chord, x of the centre, and by how much z of it is more than that of a plate's strip; (0, 0, 3) where
        all are plates.
    """
    if all(isinstance(shape, Plate) for shape in shapes):
        return np.zeros((0, 0, 3))
    found = np.zeros((len(shapes), count, 3))
    for rows, shape in zip(found, shapes, strict=True):
        chord, x, z = strips(shape, count).T
        mean = mean_chord(shape)
        rows[:] = np.column_stack([chord / mean, x / mean, (z - _evenly(shape.span, count)) / shape.span])
    return found


def mean_chord(shape: Thin) -> float:
    """Return area over span [m]."""
    return float(strips(shape, 1)[0, 0])


def middle(shape: Thin) -> Array:
    """Return the centre of area, shape (2,)."""
    return np.asarray(strips(shape, 1)[0, 1:])


def ends_and_middle(shape: Thin) -> Array:
    """Return the middles of one tip, of the chord halfway, and of the other tip, shape (3, 2)."""
    low, high = ends(shape)
    halfway = 0.5 * (low + high)
    return np.array([_tip(shape, low), (0.5 * sum(chord(shape, halfway)), halfway), _tip(shape, high)])


def _evenly(span: float, count: int) -> list[float]:
    return [span * (2 * k + 1 - count) / (2 * count) for k in range(count)]


def _tip(shape: Thin, z: float) -> tuple[float, float]:
    if isinstance(shape, Plate):
        return 0.0, z
    there = [x for x, at in shape.points if at == z]
    return 0.5 * (min(there) + max(there)), z


def _strip(wing: Wing, a: float, b: float) -> tuple[float, float, float]:
    """Between corners the chord is linear in z, and Gauss' rule exact."""
    near = CLOSE * (b - a)
    corners = {z for _, z in wing.points if a + near < z < b - near}
    area, x, z = 0.0, 0.0, 0.0  # over the width
    for low, high in pairwise(sorted({a, b, *corners})):
        for side in (-NODE, NODE):
            at = 0.5 * (low + high) + side * (high - low)
            front, back = chord(wing, at)
            share = 0.5 * ((high - low) / (b - a)) * (back - front)
            area, x, z = area + share, x + share * (0.5 * (front + back)), z + share * at
    return area, x / area, z / area
