"""The fluid inside closed outlines, which is not there in truth.

The markers push it along with the body; the force that this takes is given back, as that of a rigid body of
the fluid's density (M. Uhlmann 2005, doi:10.1016/j.jcp.2005.03.017; Z.-G. Feng, E. E. Michaelides 2009).
"""

from __future__ import annotations

import numpy as np

from linkwind.scenario.bodies import Body
from linkwind.scenario.shapes import signed_area
from linkwind.spatial import Array


class Interior:
    """Momentum of the fluid inside the outlines of some bodies, as if it were rigid.

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


def _moments(body: Body) -> tuple[float, float, float, float]:
    """Return area, first moments x and y, and polar moment of an outline about the centre of mass."""
    shape = body.shape
    if shape is None or not shape.closed:
        return 0.0, 0.0, 0.0, 0.0
    points = shape.outline(2000)
    (x, y), (x1, y1) = points.T, np.roll(points, -1, axis=0).T
    cross = x * y1 - x1 * y
    first_x, first_y = ((a + b) * cross for a, b in ((x, x1), (y, y1)))
    second = (x * x + x * x1 + x1 * x1 + y * y + y * y1 + y1 * y1) * cross
    return signed_area(points), float(first_x.sum()) / 6, float(first_y.sum()) / 6, float(second.sum()) / 12
