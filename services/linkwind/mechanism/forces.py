"""Force elements, laid out as the core reads them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from linkwind.errors import MechanismError
from linkwind.mechanism.quaternion import rotate
from linkwind.mechanism.tree import WORLD
from linkwind.native.multibody import FORCE_TYPES, Multibody, Tables
from linkwind.scenario import Scenario
from linkwind.scenario.forces import Spring
from linkwind.spatial import Array, Motion

SHORTEST = 1e-9  # m between the ends of a spring at the start


def with_forces(tables: Tables, scenario: Scenario, q: Array, v: Array) -> Tables:
    """Return the tables of a mechanism with the scenario's force elements.

    Args:
        tables: bodies and joints.
        scenario: with the elements.
        q: joint coordinates at the start.
        v: joint velocities at the start.

    Raises:
        MechanismError: a spring out of the plane of a planar mechanism, or one without length.
    """
    if not scenario.forces:
        return tables
    multibody = Multibody(tables)
    start = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(q, v), start)
    return replace(tables, **_force_tables(scenario, start))


def _force_tables(scenario: Scenario, start: Motion) -> dict[str, Any]:
    index = {body.name: i for i, body in enumerate(scenario.bodies)} | {"world": WORLD}
    kinds, bodies, points, numbers = [], [], [], []
    for i, spring in enumerate(scenario.forces):
        ends = index[spring.parent], index[spring.child]
        item = f"{scenario.source}: forces[{i}]"
        if scenario.planar:
            _check_planar(spring, item)
        length = _length(spring, ends, start, item)
        kinds.append(FORCE_TYPES[spring.type])
        bodies.append(ends)
        points.append((spring.parent_point, spring.child_point))
        numbers.append((spring.stiffness, spring.damping, length if spring.rest is None else spring.rest))
    return {
        "force_type": np.array(kinds, np.int32),
        "force_body": np.array(bodies, np.int32).reshape(-1, 2),
        "force_point": np.array(points, np.float64).reshape(-1, 2, 3),
        "force_number": np.array(numbers, np.float64).reshape(-1, 3),
    }


def _length(spring: Spring, bodies: tuple[int, int], start: Motion, item: str) -> float:
    """Return how far apart the ends of a spring start [m]."""
    ends = [
        _place(body, point, start)
        for body, point in zip(bodies, (spring.parent_point, spring.child_point), strict=True)
    ]
    length = float(np.linalg.norm(ends[1] - ends[0]))
    if length < SHORTEST:
        raise MechanismError(
            f"{item}: expected ends apart, because {spring.name} pulls from one to the other; got "
            f"{length:.3g} m between them at the start. Move one of the points."
        )
    return length


def _place(body: int, point: tuple[float, float, float], start: Motion) -> Array:
    if body == WORLD:
        return np.array(point)
    place: Array = start.position[body] + rotate(start.orientation[body], np.array(point))
    return place


def _check_planar(spring: Spring, item: str) -> None:
    """Both ends lie in the plane that the mechanism moves in."""
    for key in ("parent_point", "child_point"):
        x, y, z = getattr(spring, key)
        if z:
            raise MechanismError(
                f"{item}.{key}: expected z = 0, because every inertia is a single number; got "
                f"[{x:g}, {y:g}, {z:g}]. Set z to 0, or give 6 numbers for the inertia of each body."
            )
