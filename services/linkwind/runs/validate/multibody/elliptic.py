"""Jacobi's elliptic functions by the arithmetic-geometric mean (Abramowitz & Stegun 16.4, 17.6).

To round-off; with them come the exact solutions: of pendulums, and of a free rigid body.
"""

from __future__ import annotations

import math


def _means(m: float) -> tuple[list[float], list[float]]:
    """Return the a and c of the descending scale from 1, sqrt(1 - m), sqrt(m)."""
    a, b, c = [1.0], math.sqrt(1.0 - m), [math.sqrt(m)]
    while abs(c[-1]) > 1e-15:
        c.append((a[-1] - b) / 2.0)
        a, b = [*a, (a[-1] + b) / 2.0], math.sqrt(a[-1] * b)
    return a, c


def quarter(m: float) -> float:
    """Return the complete integral K(m), a quarter of the period of sn."""
    return math.pi / (2.0 * _means(m)[0][-1])


def amplitude(u: float, m: float) -> float:
    """Return am(u | m) for 0 ≤ m < 1."""
    a, c = _means(m)
    phi = 2.0 ** (len(a) - 1) * a[-1] * u
    for a_n, c_n in zip(a[:0:-1], c[:0:-1], strict=True):
        phi = (phi + math.asin(c_n / a_n * math.sin(phi))) / 2.0
    return phi


def jacobi(u: float, m: float) -> tuple[float, float, float]:
    """Return sn, cn, dn of u for 0 ≤ m < 1."""
    phi = amplitude(u, m)
    sn = math.sin(phi)
    return sn, math.cos(phi), math.sqrt(1.0 - m * sn * sn)
