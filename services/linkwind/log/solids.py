"""Solids for Foxglove: of a shape, a box, a cylinder, a ball or triangles over any outline; and pictures."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from foxglove.messages import (
    Color,
    CubePrimitive,
    CylinderPrimitive,
    ModelPrimitive,
    Point3,
    Pose,
    Quaternion,
    SpherePrimitive,
    TriangleListPrimitive,
    Vector3,
)

from linkwind.scenario import pictures as drawings
from linkwind.scenario.ears import triangles
from linkwind.scenario.pictures import Box, Capsule, Mesh, Pictures
from linkwind.scenario.shapes import AnyShape, Circle, Ellipse, Ellipsoid, Plate, Rectangle, Wing
from linkwind.spatial import Array

ORIGIN = Pose(position=Vector3(x=0.0, y=0.0, z=0.0), orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0))


def solid(shape: AnyShape, thickness: float, color: Color) -> dict[str, Any]:
    """Return the primitives of a ``SceneEntity`` in the body frame, by the entity's keys.

    Args:
        shape: what to draw.
        thickness: of a plate [m], which has none of its own.
        color: of the whole.
    """
    if isinstance(shape, Plate):
        return {"cubes": [_cube(shape.length, thickness, shape.span, color)]}
    if isinstance(shape, Rectangle) and not shape.radius:
        return {"cubes": [_cube(shape.length, shape.width, shape.span, color)]}
    if isinstance(shape, Circle | Ellipse):
        x, y = np.ptp(shape.outline(4), axis=0).tolist()
        size = Vector3(x=x, y=y, z=shape.span)
        cylinder = CylinderPrimitive(pose=ORIGIN, size=size, bottom_scale=1.0, top_scale=1.0, color=color)
        return {"cylinders": [cylinder]}
    if isinstance(shape, Ellipsoid):
        return {"spheres": [SpherePrimitive(pose=ORIGIN, size=_size(*shape.size), color=color)]}
    if isinstance(shape, Wing):
        return {"triangles": [_sheet(shape.planform, color)]}
    return {"triangles": [_prism(shape.outline(), shape.span, color)]}


def drawn(pictures: Pictures, color: Color) -> dict[str, list[Any]]:
    """Return the primitives of a ``SceneEntity`` in the body frame, by the entity's keys."""
    found: dict[str, list[Any]] = {"cubes": [], "spheres": [], "cylinders": [], "models": []}
    for picture in pictures:
        pose = _pose(picture.position, picture.orientation)
        if isinstance(picture, Box):
            found["cubes"].append(CubePrimitive(pose=pose, size=_size(*picture.size), color=color))
        elif isinstance(picture, drawings.Ellipsoid):
            found["spheres"].append(SpherePrimitive(pose=pose, size=_size(*picture.size), color=color))
        elif isinstance(picture, Mesh):
            scale = _size(*picture.scale)
            model = ModelPrimitive(
                pose=pose, scale=scale, color=color, override_color=False, url=picture.file
            )
            found["models"].append(model)
        else:
            d = picture.diameter
            found["cylinders"].append(
                CylinderPrimitive(
                    pose=pose, size=_size(d, d, picture.length), bottom_scale=1.0, top_scale=1.0, color=color
                )
            )
            for end in (-0.5, 0.5) if isinstance(picture, Capsule) else ():
                at = np.array(picture.position) + end * picture.length * np.array(picture.axis)
                ball = _pose(at.tolist(), (1.0, 0.0, 0.0, 0.0))
                found["spheres"].append(SpherePrimitive(pose=ball, size=_size(d, d, d), color=color))
    return found


def _pose(position: Sequence[float], orientation: Sequence[float]) -> Pose:
    (x, y, z), (qw, qx, qy, qz) = position, orientation
    return Pose(position=Vector3(x=x, y=y, z=z), orientation=Quaternion(x=qx, y=qy, z=qz, w=qw))


def _size(x: float, y: float, z: float) -> Vector3:
    return Vector3(x=x, y=y, z=z)


def _cube(x: float, y: float, z: float, color: Color) -> CubePrimitive:
    return CubePrimitive(pose=ORIGIN, size=Vector3(x=x, y=y, z=z), color=color)


def _sheet(planform: Array, color: Color) -> TriangleListPrimitive:
    """Return a flat wing, seen from both sides."""
    points = [Point3(x=x, y=0.0, z=z) for x, z in planform.tolist()]
    indices = [i for a, b, c in triangles(planform) for i in (a, c, b, a, b, c)]
    return TriangleListPrimitive(pose=ORIGIN, points=points, indices=indices, color=color)


def _prism(outline: Array, span: float, color: Color) -> TriangleListPrimitive:
    """Return the two faces and the sides between them; the points of the far face follow the near one's."""
    n = len(outline)
    points = [Point3(x=x, y=y, z=z) for z in (-0.5 * span, 0.5 * span) for x, y in outline.tolist()]
    indices = []
    for a, b, c in triangles(outline):
        indices += [a, c, b, n + a, n + b, n + c]
    for i in range(n):
        j = (i + 1) % n
        indices += [i, j, n + j, i, n + j, n + i]
    return TriangleListPrimitive(pose=ORIGIN, points=points, indices=indices, color=color)
