"""Pictures of a run for Foxglove: transforms of the bodies and a scene with shapes, joints and forces.

Every update holds the whole scene, because after a jump in time Foxglove shows the latest message of a
topic only. Frames are few: at most 60 a second of simulation time and about 1000 a run, chosen by
counting steps.
"""

from __future__ import annotations

import math
from typing import Any

from foxglove.messages import (
    ArrowPrimitive,
    Color,
    FrameTransform,
    FrameTransforms,
    Pose,
    Quaternion,
    SceneEntity,
    SceneUpdate,
    SpherePrimitive,
    Timestamp,
    Vector3,
)

from linkwind.log.solids import drawn, solid
from linkwind.scenario.pictures import Pictures, pictures_of
from linkwind.scenario.shapes import AnyShape, shape_of
from linkwind.spatial import Array, Motion

FRAMES_PER_SECOND = 60.0
FRAMES_PER_RUN = 1000
STANDARD_GRAVITY = 9.80665  # m/s²

LINK = Color(r=0.27, g=0.51, b=0.71, a=1.0)
JOINT = Color(r=0.90, g=0.60, b=0.00, a=1.0)
STILL = Color(r=0.60, g=0.62, b=0.65, a=1.0)
FORCE = Color(r=0.80, g=0.25, b=0.20, a=1.0)


class Scene:
    """The picture of one scenario's bodies.

    A body is its pictures, or else the solid of its shape, or else a ball; a joint is a small sphere at its
    point on the child; a force is an arrow from the centre of mass, as long as the longest extent for the
    weight of the heaviest body; what stands still are the pictures of the environment.

    Args:
        scenario: the resolved scenario as parsed JSON.

    Attributes:
        stride: steps from one frame to the next.
    """

    def __init__(self, scenario: dict[str, Any]) -> None:
        bodies, step = scenario["bodies"], scenario["coupling"]["step"]
        steps = round(scenario["time"]["end"] / step)
        self.stride = max(1, math.ceil(1.0 / (FRAMES_PER_SECOND * step)), math.ceil(steps / FRAMES_PER_RUN))
        self._names = [body["name"] for body in bodies]
        shapes = [shape_of(body.get("shape")) for body in bodies]
        pictures = [pictures_of(body) for body in bodies]
        self._still: dict[str, Any] = drawn(pictures_of(scenario["environment"]), STILL)
        self._length = _length(shapes, pictures, scenario["joints"])
        weight = max(body["mass"] for body in bodies) * STANDARD_GRAVITY
        self._metres_per_newton = self._length / weight if weight > 0.0 else self._length
        self._solids: list[dict[str, Any]] = []
        for shape, drawn_ones in zip(shapes, pictures, strict=True):
            if drawn_ones or shape is None:
                self._solids.append(drawn(drawn_ones, LINK))
            else:
                self._solids.append({"spheres": [], **solid(shape, 0.02 * self._length, LINK)})
            if shape is None and not drawn_ones:
                self._solids[-1]["spheres"].append(self._ball((0.0, 0.0, 0.0), 0.2, LINK))
        for joint in scenario["joints"]:
            child = self._names.index(joint["child"])
            self._solids[child]["spheres"].append(self._ball(joint["child_point"], 0.06, JOINT))

    def _ball(self, point: Any, diameter: float, color: Color) -> SpherePrimitive:
        x, y, z = point
        d = diameter * self._length
        pose = Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))
        return SpherePrimitive(pose=pose, size=Vector3(x=d, y=d, z=d), color=color)

    def transforms(self, time_ns: int, motion: Motion) -> FrameTransforms:
        """Return the frame of every body, named as the body, in the frame ``world``."""
        stamp, frames = timestamp(time_ns), []
        poses = zip(self._names, motion.position.tolist(), motion.orientation.tolist(), strict=True)
        for name, (x, y, z), (qw, qx, qy, qz) in poses:
            frames.append(
                FrameTransform(
                    timestamp=stamp,
                    parent_frame_id="world",
                    child_frame_id=name,
                    translation=Vector3(x=x, y=y, z=z),
                    rotation=Quaternion(x=qx, y=qy, z=qz, w=qw),
                )
            )
        return FrameTransforms(transforms=frames)

    def update(self, time_ns: int, motion: Motion, force: Array) -> SceneUpdate:
        """Return the whole scene at one time; ``force`` [N] is the total on bodies, shape (n, 3), in W."""
        stamp, entities = timestamp(time_ns), []
        states = zip(motion.position.tolist(), force.tolist(), strict=True)
        for i, (position, newtons) in enumerate(states):
            name = self._names[i]
            entities.append(
                SceneEntity(timestamp=stamp, frame_id=name, id=name, frame_locked=True, **self._solids[i])
            )
            arrows = self._arrows(position, newtons)
            entities.append(SceneEntity(timestamp=stamp, frame_id="world", id=f"{name} force", arrows=arrows))
        if any(self._still.values()):
            entities.append(SceneEntity(timestamp=stamp, frame_id="world", id="environment", **self._still))
        return SceneUpdate(entities=entities)

    def _arrows(self, position: list[float], force: list[float]) -> list[ArrowPrimitive]:
        newtons = math.hypot(*force)
        if not 0.0 < newtons < math.inf:
            return []
        length, thickness = newtons * self._metres_per_newton, 0.02 * self._length
        head = min(0.1 * self._length, 0.5 * length)
        x, y, z = position
        return [
            ArrowPrimitive(
                pose=Pose(position=Vector3(x=x, y=y, z=z), orientation=along(*force)),
                shaft_length=length - head, shaft_diameter=thickness,
                head_length=head, head_diameter=2.0 * thickness, color=FORCE,
            )
        ]  # fmt: skip


def _length(shapes: list[AnyShape | None], pictures: list[Pictures], joints: list[dict[str, Any]]) -> float:
    """Return the longest extent of what is drawn [m], by which balls and arrows are sized."""
    extents = [shape.reference_length for shape in shapes if shape]
    extents += [picture.extent for of_body in pictures for picture in of_body]
    longest = max(extents, default=0.0) or max((math.hypot(*j["child_point"]) for j in joints), default=0.0)
    return longest or 1.0


def along(x: float, y: float, z: float) -> Quaternion:
    """Return the shortest rotation that turns the x axis, along which arrows lie, to (x, y, z)."""
    length = math.hypot(x, y, z)
    if x < 0.0 and math.hypot(y, z) < 1e-12 * length:
        return Quaternion(x=0.0, y=0.0, z=1.0, w=0.0)
    w = length + x  # half-angle formula: (1 + e·d, e × d), normalised
    norm = math.hypot(w, y, z)
    return Quaternion(x=0.0, y=-z / norm, z=y / norm, w=w / norm)


def timestamp(time_ns: int) -> Timestamp:
    """Return simulation time as Foxglove's seconds and nanoseconds."""
    return Timestamp(sec=time_ns // 1_000_000_000, nsec=time_ns % 1_000_000_000)
