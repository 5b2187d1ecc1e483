"""The start of an imported mechanism: joints that are not at their zero."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from linkwind.errors import InputError
from linkwind.mechanism.importers.model import ORIGIN, WORLD, Model, Pose
from linkwind.scenario.problems import nearest
from linkwind.spatial import Array


def parse(arguments: Sequence[str], model: Model) -> dict[str, float]:
    """Return the coordinates that ``JOINT=VALUE`` arguments state [rad or m].

    Raises:
        InputError: there is no such joint with one coordinate, or no finite number.
    """
    known = [part.joint.name for part in model.parts if part.joint.type in ("revolute", "prismatic")]
    stated: dict[str, float] = {}
    for argument in arguments:
        name, _, value = argument.rpartition("=")
        if name not in known:
            raise InputError(f"--at {argument}: {_unknown(name or argument, known)}")
        try:
            stated[name] = float(value)
        except ValueError:
            stated[name] = math.nan
        if not math.isfinite(stated[name]):
            raise InputError(f"--at {argument}: expected a finite number; got {value}. Correct it.")
    return stated


def drop_stops(model: Model, stated: Mapping[str, float]) -> None:
    """Leave out stops that the start is not between."""
    for part in model.parts:
        joint, q = part.joint, stated.get(part.joint.name, 0.0)
        if joint.stop is None or (joint.stop[0] <= q <= joint.stop[1] and joint.stop[0] < joint.stop[1]):
            continue
        low, high = joint.stop
        item = f"{joint.name} ({low:g} to {high:g})"
        model.leave_out("joint limits", "the start is not between them; see --at", [item])
        joint.stop = None


def _unknown(name: str, known: Sequence[str]) -> str:
    near = nearest(name, known)
    return (
        f"expected JOINT=VALUE with a joint that turns or slides, one of {', '.join(known) or '(none)'}; "
        f'got "{name}". Use {near or "one of these"}.'
    )


def displacements(model: Model, stated: Mapping[str, float]) -> list[Pose]:
    """Return how each part is displaced from where it is at the joints' zero, in the world."""
    moved: list[Pose] = []
    for part in model.parts:
        before = ORIGIN if part.parent == WORLD else moved[part.parent]
        joint, q = part.joint, stated.get(part.joint.name, 0.0)
        axis = joint.axis / math.hypot(*joint.axis)
        if joint.type == "prismatic":
            own = Pose(q * axis, np.eye(3))
        elif joint.type == "revolute":
            rotation = about(axis, q)
            own = Pose(joint.point - rotation @ joint.point, rotation)
        else:
            own = ORIGIN
        moved.append(before.then(own))
    return moved


def about(axis: Array, angle: float) -> Array:
    """Return the rotation about a unit axis by an angle [rad], shape (3, 3) (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross
    return turned
