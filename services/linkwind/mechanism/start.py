"""Joint coordinates and velocities at the start, from what the scenario states in the world.

One rule for every joint: what a body states is resolved along what its joint leaves free, and refused
if something else is left over. What it does not state follows from its parent: parallel to it, at the
joint's zero, at rest relative to it. (A root's parent is the world: at the origin, at rest.) A joint
that keeps the angle between its bodies (fixed, prismatic) keeps the one that they start with.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from linkwind.errors import MechanismError
from linkwind.mechanism.quaternion import IDENTITY, about_z, from_z, inverse, product, rotate
from linkwind.mechanism.tree import Carrier
from linkwind.scenario import Body
from linkwind.spatial import Array

TOLERANCE = 1e-9  # by which a stated vector may miss what the joint allows, relative above 1
TURN_TOLERANCE = 1e-6  # rad by which a stated orientation may miss the joint's axis

# Which displacements along, and turns about, the joint frame's x, y, z a joint leaves free.
SLIDES = {
    "fixed": (False, False, False),
    "revolute": (False, False, False),
    "prismatic": (False, False, True),
    "planar": (True, True, False),
    "spherical": (False, False, False),
    "free": (True, True, True),
}
TURNS = {
    "fixed": (False, False, False),
    "revolute": (False, False, True),
    "prismatic": (False, False, False),
    "planar": (False, False, True),
    "spherical": (True, True, True),
    "free": (True, True, True),
}


@dataclass(frozen=True)
class Start:
    """A body at the start, in the world.

    Attributes:
        position: centre of mass [m], shape (3,).
        orientation: unit quaternion, body to world, shape (4,).
        angle: turn about z [rad], unwrapped; None where the body is turned in another way.
        linear: velocity of the centre of mass [m/s], shape (3,).
        angular: angular velocity [rad/s], shape (3,).
    """

    position: Array
    orientation: Array
    angle: float | None
    linear: Array
    angular: Array


@dataclass(frozen=True)
class JointStart:
    """A joint at the start.

    Attributes:
        q: joint coordinates, shape (nq of the type,).
        v: joint velocities, shape (nv of the type,).
        parent_rotation: joint frame to the parent's body frame, unit quaternion, shape (4,).
        child_rotation: joint frame to the child's body frame, unit quaternion, shape (4,).
    """

    q: Array
    v: Array
    parent_rotation: Array
    child_rotation: Array


@dataclass(frozen=True)
class _Frames:
    """The joint's frames on parent and child, in their bodies (rotation) and in the world (frame)."""

    parent_rotation: Array
    child_rotation: Array
    parent_frame: Array
    child_frame: Array


WORLD_START = Start(np.zeros(3), IDENTITY, 0.0, np.zeros(3), np.zeros(3))


Given = Mapping[int, tuple[float, float]]
"""Coordinates of a joint that motions prescribe, by number: value and rate at the start."""


def start(body: Body, carrier: Carrier, parent: Start, item: str, given: Given) -> tuple[Start, JointStart]:
    """Return a body and its joint at the start.

    Args:
        body: what the scenario states.
        carrier: the joint that carries the body.
        parent: the parent at the start.
        item: where the body stands in the scenario, for errors.
        given: what motions say about the joint.

    Raises:
        MechanismError: the body states something that its joint, or a motion of it, does not allow.
    """
    slides, turns = np.array(SLIDES[carrier.type]), np.array(TURNS[carrier.type])
    moved = {k: pair for k, pair in given.items() if k < slides.sum()}
    turned = given.get(int(slides.sum()))
    orientation, angle = _orientation(body, parent)
    frames = _frames(carrier, parent, orientation)
    turn = _turn(carrier, parent, angle, frames, item)
    if turned is not None:
        angle = _turned(body, carrier, parent, turn, turned[0], item)
        turn = np.array([turned[0]])
    if carrier.type in ("revolute", "planar") and (angle is None or turned):  # exactly about the axis
        child_frame = product(frames.parent_frame, about_z(turn[0]))
        frames = replace(frames, child_frame=child_frame)
        orientation = product(child_frame, inverse(frames.child_rotation))
    arm = rotate(orientation, carrier.child_point)

    anchor = parent.position + rotate(parent.orientation, carrier.parent_point)
    stated = anchor if body.position is None else np.array(body.position) + arm
    offset = np.where(slides, rotate(inverse(frames.parent_frame), stated - anchor), 0.0)
    offset[np.flatnonzero(slides)[list(moved)]] = [value for value, _ in moved.values()]
    joint_point = anchor + rotate(frames.parent_frame, offset)
    position = joint_point - arm
    _agree(f"{item}.position", body.position, position, carrier, "m")

    stated = parent.angular if body.angular_velocity is None else np.array(body.angular_velocity)
    rate = np.where(turns, rotate(inverse(frames.child_frame), stated - parent.angular), 0.0)
    if turned is not None:
        rate = np.array([0.0, 0.0, turned[1]])
    angular = parent.angular + rotate(frames.child_frame, rate)
    _agree(f"{item}.angular_velocity", body.angular_velocity, angular, carrier, "rad/s")

    carried = parent.linear + np.cross(parent.angular, joint_point - parent.position)
    stated = carried if body.velocity is None else np.array(body.velocity) + np.cross(angular, arm)
    speed = np.where(slides, rotate(inverse(frames.parent_frame), stated - carried), 0.0)
    speed[np.flatnonzero(slides)[list(moved)]] = [rate for _, rate in moved.values()]
    linear = carried + rotate(frames.parent_frame, speed) - np.cross(angular, arm)
    _agree(f"{item}.velocity", body.velocity, linear, carrier, "m/s")

    q = np.concatenate([offset[slides], turn])
    v = np.concatenate([speed[slides], rate[turns]])
    joint = JointStart(q, v, frames.parent_rotation, frames.child_rotation)
    return Start(position, orientation, angle, linear, angular), joint


def _turned(
    body: Body, carrier: Carrier, parent: Start, turn: Array, angle: float, item: str
) -> float | None:
    """Return a body's angle from that of its joint; None where it is no turn about z."""
    stated = body.angle_deg is not None or body.orientation is not None
    if stated and abs(math.remainder(turn[0] - angle, 2.0 * math.pi)) > TURN_TOLERANCE:
        raise MechanismError(
            f"{item}: expected an orientation at which {carrier.name} stands at "
            f"{math.degrees(angle):.9g}°, as its motion says; got one at {math.degrees(turn[0]):.9g}°. "
            "Leave it out."
        )
    x, y, z = carrier.axis
    if parent.angle is None or x or y:
        return None
    return parent.angle + math.copysign(1.0, z) * angle


def _orientation(body: Body, parent: Start) -> tuple[Array, float | None]:
    """Return the orientation, and the angle where it is a turn about z."""
    if body.angle_deg is not None:
        angle = math.radians(body.angle_deg)
        return about_z(angle), angle
    if body.orientation is not None:
        stated = np.array(body.orientation)
        w, x, y, z = stated
        return stated / math.hypot(*stated), None if x or y else 2.0 * math.atan2(z, w)
    return parent.orientation, parent.angle


def _frames(carrier: Carrier, parent: Start, orientation: Array) -> _Frames:
    """Return frames that coincide where the bodies are parallel.

    A joint that keeps the angle between the bodies keeps the one that they start with.
    """
    parent_rotation = from_z(carrier.axis)
    child_rotation = parent_rotation
    if not any(TURNS[carrier.type]) and orientation is not parent.orientation:
        child_rotation = product(product(inverse(orientation), parent.orientation), parent_rotation)
    return _Frames(
        parent_rotation,
        child_rotation,
        product(parent.orientation, parent_rotation),
        product(orientation, child_rotation),
    )


def _turn(carrier: Carrier, parent: Start, angle: float | None, frames: _Frames, item: str) -> Array:
    """Return the joint's turn: nothing, an angle [rad] or a quaternion."""
    turns = sum(TURNS[carrier.type])
    relative = product(inverse(frames.parent_frame), frames.child_frame)
    if turns == 3:
        return relative
    if turns == 0:
        return np.zeros(0)
    x, y, z = carrier.axis
    if angle is not None and parent.angle is not None and not x and not y:
        return np.array([math.copysign(1.0, z) * (angle - parent.angle)])
    off = 2.0 * math.asin(min(1.0, math.hypot(relative[1], relative[2])))
    if off > TURN_TOLERANCE:
        raise MechanismError(
            f"{item}: expected an orientation that differs from the parent's by a turn about the axis of "
            f"{carrier.name}; got one that is {math.degrees(off):.6g}° off. Correct it, or the joint's axis."
        )
    return np.array([math.remainder(2.0 * math.atan2(relative[3], relative[0]), 2.0 * math.pi)])


def _agree(item: str, stated: tuple[float, ...] | None, allowed: Array, carrier: Carrier, unit: str) -> None:
    if stated is None:
        return
    off = math.hypot(*(np.array(stated) - allowed))
    if off > TOLERANCE * max(1.0, math.hypot(*allowed)):
        raise MechanismError(
            f"{item}: expected {_vector(allowed)} {unit}, as {carrier.name} ({carrier.type}) demands; got "
            f"{_vector(stated)} {unit}, {off:.6g} {unit} off. Leave it out, or correct it."
        )


def _vector(values: Array | tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{round(value, 12) + 0.0:.12g}" for value in values) + "]"
