"""Wings by lattices that are written apart, with the steady wake of the linear theory.

On rectangles, vortices and points where the flow is tangential are spaced by cosines along the chord, which
is exact in two dimensions (C. E. Lan, J. Aircraft 11(9), 1974, doi:10.2514/3.60381), and along the span,
which is exact for a lifting line.
"""

from __future__ import annotations

import numpy as np

from linkwind.spatial import Array


def wing(aspect: float, along: int = 10, across: int = 40) -> tuple[float, float]:
    """Return the slope of the lift [1/rad], and the induced drag over that of an elliptic lift."""
    n, m, k = along, across, np.arange(1, along + 1)
    angle = (k - 0.5) * np.pi / n
    bound, weight = 0.5 * (1.0 - np.cos(angle)), 0.5 * np.pi / n * np.sin(angle)
    station = (np.arange(m) + 0.5) * np.pi / m
    edge, middle = -0.5 * aspect * np.cos(np.arange(m + 1) * np.pi / m), -0.5 * aspect * np.cos(station)
    ahead = (0.5 * (1.0 - np.cos(k * np.pi / n))[:, None] - bound)[:, None, :, None]
    aside = (middle[:, None] - edge)[None, :, None, :]
    legs = (1.0 + np.hypot(ahead, aside) / ahead) / aside
    wash = (legs[..., 1:] - legs[..., :-1]) / (4.0 * np.pi) * weight[:, None]
    sheet = np.linalg.solve(wash.reshape(n * m, n * m), -np.ones(n * m)).reshape(n, m)
    circulation = weight @ sheet
    series = np.arange(1, m + 1)
    fourier = np.sin(np.outer(series, station)) @ circulation
    return (
        float(2.0 * circulation @ np.diff(edge) / aspect),
        float((series * fourier**2).sum() / fourier[0] ** 2),
    )


def swept(
    leading: Array, trailing: Array, half: float, along: int = 6, across: int = 20
) -> tuple[float, float]:
    """Return the slope of the lift [1/rad] of a swept or pointed wing, and x of the lift's centre [m].

    Horseshoe vortices lie at a quarter of each panel, and their legs go downstream from there. The lattice is
    denser towards the tips, and its error, of the first order in the panels of the span, is taken away by
    another of twice as many.

    Args:
        leading: x of the leading edge in the middle and at the tip [m], straight between, shape (2,).
        trailing: of the trailing edge, likewise.
        half: of the span [m].
        along: panels of the chord.
        across: panels of the span, even.
    """
    coarse, fine = (_horseshoes(leading, trailing, half, along, count) for count in (across, 2 * across))
    lift, place = 2.0 * fine - coarse
    return float(lift), float(place)


def _horseshoes(leading: Array, trailing: Array, half: float, along: int, across: int) -> Array:
    edge = half * np.sin(np.linspace(-0.5 * np.pi, 0.5 * np.pi, across + 1))
    side = np.abs(edge) / half
    front = leading[0] + (leading[1] - leading[0]) * side
    chord = trailing[0] + (trailing[1] - trailing[0]) * side - front
    bound = front + chord * ((np.arange(along) + 0.25) / along)[:, None]
    behind = front + chord * ((np.arange(along) + 0.75) / along)[:, None]
    x = (0.5 * (behind[:, 1:] + behind[:, :-1])).ravel()[:, None]
    z = np.tile(0.5 * (edge[1:] + edge[:-1]), along)[:, None]
    ends = [
        (bound[:, :-1].ravel(), np.tile(edge[:-1], along)),
        (bound[:, 1:].ravel(), np.tile(edge[1:], along)),
    ]
    (xa, za), (xb, zb) = ends
    first, last = (np.hypot(x - xe, z - ze) for xe, ze in ends)
    dx, dz = xb - xa, zb - za
    across_it = (z - za) * (x - xb) - (x - xa) * (z - zb)
    wash = ((dx * (x - xa) + dz * (z - za)) / first - (dx * (x - xb) + dz * (z - zb)) / last) / across_it
    for (xe, ze), away, turn in ((ends[0], first, 1.0), (ends[1], last, -1.0)):
        wash += turn * (1.0 + (x - xe) / away) / (z - ze)
    lift = np.linalg.solve(wash / (4.0 * np.pi), np.ones(len(x))) * dz
    area = half * float(chord[across // 2] + chord[0])
    found: Array = np.array([2.0 * lift.sum() / area, lift @ (0.5 * (xa + xb)) / lift.sum()])
    return found
