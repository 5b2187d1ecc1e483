"""The coefficients of a section from its table: curves around the whole circle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from linkwind.expression.curves import Curve
from linkwind.spatial import Array


def curves(rows: Sequence[Sequence[float]]) -> Array:
    """Return C_l, C_d and C_m about the middle of the chord over the angle of attack -π … π.

    The moment is carried from the quarter chord to the middle row by row. What a table leaves out of the
    circle is its mirror image, in which C_l and C_m change sign: in the normal where it ends at 90°, and in
    the chord where it begins at 0. Between rows the curves are monotone cubics with a continuous derivative.

    Args:
        rows: α [deg], C_l, C_d, C_m about the quarter chord, nose up, shape (n, 4).

    Returns:
        Each as ``expression.curves`` lays it out, shape (3, any).
    """
    alpha, lift, drag, moment = np.array(rows, dtype=np.float64).T
    # By the C library: numpy's sines differ between processors in the last bit.
    sine, cosine = np.array([(math.sin(turned), math.cos(turned)) for turned in np.radians(alpha)]).T
    moment = moment + 0.25 * (lift * cosine + drag * sine)
    if alpha[0] == 0.0:
        moment[[0, -1]] = 0.0  # so far but for round-off
    else:
        moment[-1] = moment[0]
    points = np.array([alpha, lift, drag, moment])
    if alpha[-1] == 90.0:
        points = np.hstack([points, _mirrored(points[:, :-1], 90.0)])
    if alpha[0] == 0.0:
        points = np.hstack([_mirrored(points[:, 1:], 0.0), points])
    place = np.radians(points[0]).tolist()
    each = [tuple(zip(place, values.tolist(), strict=True)) for values in points[1:]]
    return np.array([Curve(through, "cubic", periodic=True).layout() for through in each])


def _mirrored(points: Array, about: float) -> Array:
    """Return the points on the other side of an angle [deg], ascending."""
    alpha, lift, drag, moment = points[:, ::-1]
    return np.array([2.0 * about - alpha, -lift, drag, -moment])
