"""Mechanisms of the cases that are not built-in scenarios, as scenarios."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

from linkwind.scenario import Scenario, from_json

Table = dict[str, Any]


def scene(
    bodies: Sequence[Table],
    joints: Sequence[Table] = (),
    gravity: Sequence[float] = (0, -9.81, 0),
    forces: Sequence[Table] = (),
) -> Scenario:
    """Return a mechanism that nothing but gravity and forces between its bodies act on."""
    return from_json(
        json.dumps(
            {
                "name": "validation",
                "time": {"end": 1.0},
                "environment": {"gravity": list(gravity)},
                "bodies": list(bodies),
                "joints": list(joints),
                "forces": list(forces),
            }
        )
    )


def joint(
    name: str, parent: str, child: str, parent_point: Sequence[float], child_point: Sequence[float],
    kind: str = "revolute", **more: Any,
) -> Table:  # fmt: skip
    """Return a joint."""
    points = {"parent_point": list(parent_point), "child_point": list(child_point)}
    return {"name": name, "type": kind, "parent": parent, "child": child, **points, **more}


def pendulum() -> Scenario:
    """Return a point mass of 1 kg on a massless rod of 1 m, released level: IFToMM A01."""
    bob = {"name": "bob", "mass": 1.0, "inertia": [0.0] * 6, "position": [-1.0, 0.0], "angle_deg": 0.0}
    return scene([bob], [joint("pivot", "world", "bob", [0.0, 0.0], [1.0, 0.0])])


ROD: Table = {"mass": 1.0, "inertia": 1.0 / 12.0}


def four_bars(count: int) -> Scenario:
    """Return ``count`` four-bars in a row, rods of 1 m and 1 kg, started at 1 m/s: IFToMM A02."""
    cranks = [
        {"name": f"crank{i}", "angle_deg": 90.0, "angular_velocity": -1.0, **ROD} for i in range(count + 1)
    ]
    couplers = [
        {"name": f"coupler{i}", "angle_deg": 0.0, "angular_velocity": 0.0, **ROD} for i in range(count)
    ]
    near, far = [0.5, 0.0], [-0.5, 0.0]
    joints = [joint(f"base{i}", "world", f"crank{i}", [i, 0.0], far) for i in range(count + 1)]
    joints += [joint(f"near{i}", f"crank{i}", f"coupler{i}", near, far) for i in range(count)]
    joints += [joint(f"far{i}", f"coupler{i}", f"crank{i + 1}", near, near) for i in range(count)]
    return scene(cranks + couplers, joints)


def chain(count: int) -> Scenario:
    """Return ``count`` rods of 1 m and 1 kg in a row on hinges, the first on the world, released level."""
    bodies = [{"name": f"rod{i}", "angle_deg": 0.0, **ROD} for i in range(count)]
    joints = [
        joint(f"hinge{i}", f"rod{i - 1}" if i else "world", f"rod{i}", [0.5 if i else 0.0, 0.0], [-0.5, 0.0])
        for i in range(count)
    ]
    return scene(bodies, joints)


def racket() -> Scenario:
    """Return a free body that turns almost about its middle axis."""
    body = {
        "name": "racket", "mass": 1.3, "inertia": [1.0, 2.0, 2.9, 0.0, 0.0, 0.0],
        "position": [0.0, 0.0, 0.0], "orientation": [1.0, 0.0, 0.0, 0.0],
        "velocity": [0.1, 0.2, 0.3], "angular_velocity": [2.0, 0.0, 1.25],
    }  # fmt: skip
    return scene([body], gravity=(0.0, 0.0, 0.0))


def governor() -> Scenario:
    """Return a flyball governor whose couplers are stiff springs: IFToMM A05.

    z is up. The balls, points of 5 kg at the ends of rods of 0.3 kg and 1 m, are part of the rods.
    """
    mass, middle = 5.3, 5.15 / 5.3  # of a rod with its ball; its centre of mass from the pivot
    across = 0.3 / 12 * (1.0 + 1e-4) + 0.3 * (middle - 0.5) ** 2 + 5.0 * (1.0 - middle) ** 2
    along = 0.3 / 6 * 1e-4
    shaft = _bar("shaft", 0.3, [0.025, 0.025, 0.3 / 6 * 1e-4]) | {
        "orientation": [1.0, 0.0, 0.0, 0.0], "angular_velocity": [0.0, 0.0, 2.0 * math.pi],
    }  # fmt: skip
    bodies = [shaft, _bar("slider", 3.0, [0.005] * 3)]
    joints = [
        joint("bearing", "world", "shaft", [0.0, 0.0, 0.0], [0.0, 0.0, -0.5]),
        joint("guide", "shaft", "slider", [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], "prismatic"),
    ]
    springs = []
    for name, side in (("right", 1.0), ("left", -1.0)):  # hangs down by 30°
        half = math.radians(15.0)
        start = {"orientation": [math.cos(half), 0.0, side * math.sin(half), 0.0]}
        bodies.append(_bar(name, mass, [along, across, across]) | start)
        pivot = [-side * middle, 0.0, 0.0]
        joints.append(
            joint(f"{name}_pivot", "shaft", name, [side * 0.05, 0.0, 0.5], pivot, axis=[0.0, 1.0, 0.0])
        )
        points = [side * 0.05, 0.0, 0.0], [side * (0.5 - middle), 0.0, 0.0]
        springs.append(
            joint(f"{name}_spring", "slider", name, *points, "spring", stiffness=8e5, damping=4e4, rest=0.5)
        )
    return scene(bodies, joints, (0.0, 0.0, -9.81), springs)


def _bar(name: str, mass: float, moments: list[float]) -> Table:
    return {"name": name, "mass": mass, "inertia": [*moments, 0.0, 0.0, 0.0]}
