"""Bodies as triangles over their surfaces, for pictures in perspective and their cuts with a plane."""

from __future__ import annotations

import numpy as np

from linkwind.mechanism.quaternion import matrix
from linkwind.report.data import Run
from linkwind.scenario.ears import triangles
from linkwind.scenario.shapes import AnyShape, Ellipsoid, Wing, shape_of
from linkwind.spatial import Array

ROUND = 48  # points around an ellipsoid
PIECES = 8  # that a body's longest extent is cut into, so that what is nearer to the eye covers it


def body_faces(run: Run, state: int) -> list[Array]:
    """Return the triangles of every body that has a shape at one time.

    Args:
        run: to draw.
        state: index of the time.

    Returns:
        corners [m], counterclockwise as seen from outside, a plate or a wing as one sheet, each shape
        (m, 3, 3), in W.
    """
    path, found = run.trajectory, []
    for body, each in enumerate(run.scenario["bodies"]):
        shape = shape_of(each.get("shape"))
        if shape is not None:
            turn = matrix(path.orientation[state, body])
            found.append(faces(shape) @ turn.T + path.position[state, body])
    return found


def faces(shape: AnyShape) -> Array:
    """Return triangles over a shape's surface in the body frame [m], like :func:`body_faces`."""
    if isinstance(shape, Ellipsoid):
        return 0.5 * np.array(shape.size) * _ball(ROUND)
    most = max(shape.reference_length, shape.span) / PIECES
    if isinstance(shape, Wing):
        planform = np.insert(shape.planform, 1, 0.0, axis=1)
        return _divided(planform[np.array(triangles(shape.planform))], most)
    outline, half = shape.outline(), np.array([0.0, 0.0, 0.5 * shape.span])
    flat = np.pad(outline, ((0, 0), (0, 1)))
    ahead = np.roll(flat, -1, axis=0) if shape.closed else flat[1:]
    behind = flat if shape.closed else flat[:-1]
    sides = _quads(behind - half, ahead - half, ahead + half, behind + half)
    if not shape.closed:
        return _divided(sides, most)
    cap = flat[np.array(triangles(outline))]
    return _divided(np.concatenate([sides, cap + half, cap[:, ::-1] - half]), most)


def cut(triangles: Array, axis: int, at: float) -> Array:
    """Return where triangles cross a plane across an axis of W.

    Args:
        triangles: corners [m], shape (m, 3, 3).
        axis: 0 to 2.
        at: place of the plane on it [m].

    Returns:
        ends of the pieces of the cut [m], all the same way around a closed surface, shape (k, 2, 3).
    """
    off = triangles[..., axis] - at
    above = off > 0.0
    crossing = triangles[above.any(axis=1) & ~above.all(axis=1)]
    found = []
    for triangle in crossing:
        a = triangle[:, axis] - at
        sides = [(i, j) for i, j in ((0, 1), (1, 2), (2, 0)) if (a[i] > 0.0) != (a[j] > 0.0)]
        pairs = sorted(
            sides, key=lambda side: a[side[0]] > 0.0
        )  # from where it goes up to where it goes down
        found.append([triangle[i] + a[i] / (a[i] - a[j]) * (triangle[j] - triangle[i]) for i, j in pairs])
    return np.array(found).reshape(-1, 2, 3)


def _quads(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Return two triangles of each quadrilateral, whose corners have shape (n, 3)."""
    return np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])


def _ball(n: int) -> Array:
    """Return triangles over the unit ball, ``n`` points around it, half as many from pole to pole."""
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    height = np.linspace(-0.5 * np.pi, 0.5 * np.pi, n // 2 + 1)
    across, up = np.cos(height)[:, None], np.broadcast_to(np.sin(height)[:, None], (len(height), n))
    point = np.stack([across * np.cos(angle), across * np.sin(angle), up], axis=-1)
    beside = np.roll(point, -1, axis=1)
    corners = (point[:-1], beside[:-1], beside[1:], point[1:])
    return _quads(*(each.reshape(-1, 3) for each in corners))


def _divided(triangles: Array, most: float) -> Array:
    """Return triangles cut in halves until no side is longer than ``most`` [m]."""
    while True:
        side = np.linalg.norm(np.roll(triangles, -1, axis=1) - triangles, axis=-1)
        long = side.max(axis=1) > most
        if not long.any():
            return triangles
        order = (side[long].argmax(axis=1)[:, None] + np.arange(3)) % 3  # the longest side first
        a, b, c = np.moveaxis(np.take_along_axis(triangles[long], order[..., None], axis=1), 1, 0)
        half = 0.5 * (a + b)
        pieces = [np.stack([a, half, c], axis=1), np.stack([half, b, c], axis=1)]
        triangles = np.concatenate([triangles[~long], *pieces])
