"""The fluid inside closed outlines and surfaces, which is not there in truth.

The markers push it along with the body; the force that this takes is given back, as that of a rigid body of
the fluid's density (M. Uhlmann 2005, doi:10.1016/j.jcp.2005.03.017; Z.-G. Feng, E. E. Michaelides 2009).
"""

from __future__ import annotations

import numpy as np

from linkwind.scenario.bodies import Body
from linkwind.scenario.shapes import Ellipsoid, signed_area
from linkwind.spatial import Array, rotations, turned

OUTLINE = 2000  # points of an outline whose moments are taken


class Interior:
    """Momentum of the fluid inside the outlines of some bodies in the plane, as if it were rigid.

    Attributes:
        any: whether there is any.
    """

    def __init__(self, bodies: list[Body], density: float) -> None:
        """Compute area, its first moments and its second moment about the centre of mass; density in "
        "kg/m²."""
        moments = [_moments(body) for body in bodies]
        self._area, self._x, self._y, self._polar = density * np.array(moments).T
        self.any = bool(self._area.any())

    def inertia(self, pose: Array) -> Array:
        """Return the inertia of the inside, shape (n, 3, 3), for poses (x, y, cos, sin), shape (n, 4)."""
        x = pose[:, 2] * self._x - pose[:, 3] * self._y
        y = pose[:, 3] * self._x + pose[:, 2] * self._y
        matrix = np.zeros((len(pose), 3, 3))
        matrix[:, 0, 0] = matrix[:, 1, 1] = self._area
        matrix[:, 0, 2] = matrix[:, 2, 0] = -y
        matrix[:, 1, 2] = matrix[:, 2, 1] = x
        matrix[:, 2, 2] = self._polar
        return matrix


class InteriorInSpace:
    """Momentum of the fluid inside the surfaces of some bodies in space, as if it were rigid.

    Attributes:
        any: whether there is any.
    """

    def __init__(self, bodies: list[Body], density: float) -> None:
        """Compute volumes and their first and second moments about the centres of mass; density in kg/m³."""
        moments = [_moments_in_space(body) for body in bodies]
        self._volume = density * np.array([volume for volume, _, _ in moments])
        self._first = density * np.array([first for _, first, _ in moments])
        self._second = density * np.array([second for _, _, second in moments])
        self.any = bool(self._volume.any())

    def inertia(self, pose: Array) -> Array:
        """Return the inertia of the inside, shape (n, 6, 6), in W, for poses, shape (n, 7)."""
        found = np.zeros((len(pose), 6, 6))
        for body, turn in enumerate(rotations(pose[:, 3:])):
            of_body = found[body]
            x, y, z = turned(turn, self._first[body])
            second = turned(turn, turned(turn, self._second[body]).T)
            of_body[:3, :3] = self._volume[body] * np.eye(3)
            of_body[3:, :3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
            of_body[:3, 3:] = of_body[3:, :3].T
            of_body[3:, 3:] = np.trace(second) * np.eye(3) - second
        return found


def weakest_axis(body: Body, pose: Array, needed: Array) -> tuple[float, float]:
    """Return a body's inertia and the needed one [kg·m²] about the axis where the body's exceeds it least.

    Args:
        body: whose inertia is a number about z, if it is planar, or that in space.
        pose: as in ``inertia()``; its orientation counts for a body in space.
        needed: in W, shape (1, 1) in the plane, (3, 3) in space.
    """
    if isinstance(body.inertia, float):
        return body.inertia, float(needed[-1, -1])
    xx, yy, zz, xy, xz, yz = body.inertia
    if needed.shape == (1, 1):
        return zz, float(needed[0, 0])
    turn = rotations(pose[None, 3:])[0]
    own = turn @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ turn.T
    axis = np.linalg.eigh(own - needed)[1][:, 0]
    return float(axis @ own @ axis), float(axis @ needed @ axis)


def _moments_in_space(body: Body) -> tuple[float, Array, Array]:
    """Return volume, its first moments (3,) and its second moments (3, 3) about the centre of mass."""
    shape, second = body.shape, np.zeros((3, 3))
    if shape is None or not shape.closed:
        return 0.0, np.zeros(3), second
    if isinstance(shape, Ellipsoid):
        size = np.array(shape.size)
        volume = float(np.pi / 6.0 * size[0] * size[1] * size[2])
        return volume, np.zeros(3), np.diag(volume / 20.0 * size**2)
    area, x, y, _ = _moments(body)
    points = shape.outline(OUTLINE)
    following = np.roll(points, -1, axis=0)
    cross = points[:, 0] * following[:, 1] - following[:, 0] * points[:, 1]
    both = points + following
    for i in (0, 1):
        for j in (0, 1):
            ends = points[:, i] * points[:, j] + following[:, i] * following[:, j]
            second[i, j] = shape.span / 24.0 * float(((ends + both[:, i] * both[:, j]) * cross).sum())
    second[2, 2] = area * shape.span**3 / 12.0
    return area * shape.span, shape.span * np.array([x, y, 0.0]), second


def _moments(body: Body) -> tuple[float, float, float, float]:
    """Return area, first moments x and y, and polar moment of an outline about the centre of mass."""
    shape = body.shape
    if shape is None or not shape.closed:
        return 0.0, 0.0, 0.0, 0.0
    points = shape.outline(OUTLINE)
    (x, y), (x1, y1) = points.T, np.roll(points, -1, axis=0).T
    cross = x * y1 - x1 * y
    first_x, first_y = ((a + b) * cross for a, b in ((x, x1), (y, y1)))
    second = (x * x + x * x1 + x1 * x1 + y * y + y * y1 + y1 * y1) * cross
    return signed_area(points), float(first_x.sum()) / 6, float(first_y.sum()) / 6, float(second.sum()) / 12
