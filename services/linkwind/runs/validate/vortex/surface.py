"""Rectangular wings by a lattice that is written apart, with the steady wake of the linear theory.

Vortices and points where the flow is tangential are spaced by cosines along the chord, which is exact in two
dimensions (C. E. Lan, J. Aircraft 11(9), 1974, doi:10.2514/3.60381), and along the span, which is exact for a
lifting line.
"""

from __future__ import annotations

import numpy as np


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
