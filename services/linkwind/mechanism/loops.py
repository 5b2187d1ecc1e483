"""Joints that close loops, laid out as the core reads them."""

from __future__ import annotations

from typing import Any

import numpy as np

from linkwind.errors import MechanismError
from linkwind.mechanism.quaternion import from_z, matrix, rotate
from linkwind.mechanism.start import WORLD_START, Start
from linkwind.mechanism.tree import WORLD, Loop
from linkwind.native.multibody import DISTANCE, KEEP_ROTATION, KEEP_TRANSLATION
from linkwind.spatial import Array

_X, _Y, _Z = KEEP_TRANSLATION
_TURN_X, _TURN_Y, _TURN_Z = KEEP_ROTATION
_EVERY_TURN = _TURN_X + _TURN_Y + _TURN_Z
# What each type keeps, by the axes of a frame whose z is the joint's axis.
KEPT = {
    "fixed": _X + _Y + _Z + _EVERY_TURN,
    "revolute": _X + _Y + _Z + _TURN_X + _TURN_Y,
    "prismatic": _X + _Y + _EVERY_TURN,
    "planar": _Z + _TURN_X + _TURN_Y,
    "spherical": _X + _Y + _Z,
    "distance": DISTANCE,
}
# The same in the x, y plane, where the rest cannot happen. The y axis of a prismatic one is the world's z.
KEPT_IN_PLANE = {
    "fixed": _X + _Y + _TURN_Z,
    "revolute": _X + _Y,
    "prismatic": _X + _TURN_Y,
    "distance": DISTANCE,
}
SHORTEST = 1e-9  # m that a distance may be


def closure_tables(loops: list[Loop], starts: list[Start], *, planar: bool) -> dict[str, Any]:
    """Return the ``closure_*`` tables.

    The frame of a joint on its child is where the frame on its parent lies at the start.

    Args:
        loops: the joints.
        starts: the bodies at the start.
        planar: whether the mechanism moves in the x, y plane.

    Raises:
        MechanismError: a joint that keeps nothing, has a spring, or a distance of nothing.
    """
    kept = KEPT_IN_PLANE if planar else KEPT
    for loop in loops:
        _check(loop, kept)
    frames = [_frames(loop, starts, planar=planar) for loop in loops]
    points = [(loop.joint.parent_point, loop.joint.child_point) for loop in loops]
    return {
        "closure_body": np.array([(loop.parent, loop.child) for loop in loops], np.int32).reshape(-1, 2),
        "closure_rows": np.array([kept[loop.joint.type] for loop in loops], np.int32),
        "closure_point": np.array(points, np.float64).reshape(-1, 2, 3),
        "closure_rotation": np.array(frames, np.float64).reshape(-1, 2, 3, 3),
        "closure_length": np.array([_length(loop, starts) for loop in loops], np.float64),
    }


def _start(body: int, starts: list[Start]) -> Start:
    return WORLD_START if body == WORLD else starts[body]


def _frames(loop: Loop, starts: list[Start], *, planar: bool) -> tuple[Array, Array]:
    parent = matrix(_start(loop.parent, starts).orientation)
    child = matrix(_start(loop.child, starts).orientation)
    own = matrix(from_z(np.array(loop.joint.axis)))
    if planar and loop.joint.type == "prismatic":
        z = np.array(loop.joint.axis) / np.linalg.norm(loop.joint.axis)
        up = np.array([0.0, 0.0, 1.0])
        own = np.column_stack([np.cross(up, z), up, z])
    return own, child.T @ parent @ own


def _length(loop: Loop, starts: list[Start]) -> float:
    """Return how far apart the points of a joint start [m]; 1 where that is of no use."""
    if loop.joint.type != "distance":
        return 1.0
    ends = []
    for body, point in ((loop.parent, loop.joint.parent_point), (loop.child, loop.joint.child_point)):
        start = _start(body, starts)
        ends.append(start.position + rotate(start.orientation, np.array(point)))
    length = float(np.linalg.norm(ends[1] - ends[0]))
    if length < SHORTEST:
        raise MechanismError(
            f"{loop.item}: expected two points apart, whose distance {loop.joint.name} is to keep; got "
            f"{length:.3g} m at the start. Use revolute or spherical to keep them together."
        )
    return length


def _check(loop: Loop, kept: dict[str, int]) -> None:
    joint = loop.joint
    if joint.type not in kept:
        expected = ", ".join(name for name in kept if name != "distance")
        raise MechanismError(
            f"{loop.item}.type: expected {expected} or distance, because {joint.child} is carried by another "
            f'joint, so that {joint.name} closes a loop; got "{joint.type}", which keeps nothing. Remove it.'
        )
    for key in ("stiffness", "damping", "rest"):
        value = getattr(joint, key)
        if value is not None and np.any(value):
            raise MechanismError(
                f"{loop.item}.{key}: expected none, because {joint.child} is carried by another joint, so "
                f"that {joint.name} closes a loop; got {value}. Move the spring to a joint before it in the "
                "file."
            )
