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
from linkwind.scenario.pictures import Box, Capsule, Mesh, Pictures
from linkwind.scenario.shapes import AnyShape, Circle, Ellipse, Ellipsoid, Plate, Rectangle
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


def triangles(outline: Array) -> list[tuple[int, int, int]]:
    """Return the triangles that fill a polygon, as indices of its points, by cutting off its ears.

    Args:
        outline: of a polygon whose sides do not cross, counter-clockwise, shape (n, 2).
    """
    left, found = list(range(len(outline))), []
    while len(left) > 3:
        corners = [(left[i - 1], left[i], left[(i + 1) % len(left)]) for i in range(len(left))]
        ear = next((ear for ear in corners if _is_ear(outline, ear, left)), corners[0])
        found.append(ear)
        left.remove(ear[1])
    return [*found, (left[0], left[1], left[2])]


def _is_ear(outline: Array, corner: tuple[int, int, int], left: list[int]) -> bool:
    """Return whether the corner sticks out and holds no other point."""
    a, b, c = (outline[i] for i in corner)
    if _side(a, b, c) <= 0.0:
        return False
    others = (outline[i] for i in left if i not in corner)
    return not any(min(_side(a, b, p), _side(b, c, p), _side(c, a, p)) >= 0.0 for p in others)


def _side(a: Array, b: Array, p: Array) -> float:
    """Return twice the area of the triangle a b p, above 0 where p is to the left of the way from a to b."""
    return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))
