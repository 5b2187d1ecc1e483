"""Thin sections in closed form, by Theodorsen, Garrick, Wagner and Sears; density, speed and chord are 1.

A motion or a force is the real part of an amplitude times exp(i omega t); k = omega / 2 is the reduced
frequency, on half the chord. Heave and lift are up, pitch and moment nose up about the middle of the chord.

T. Theodorsen, NACA report 496 (1935); I. E. Garrick, NACA report 567 (1936); W. R. Sears, J. Franklin Inst.
230(1), 1940, doi:10.1016/S0016-0032(40)90336-3, and J. Aeronaut. Sci. 8(3), 1941, doi:10.2514/8.10655.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from linkwind.spatial import Array

Complex = NDArray[np.complex128]

HALF = 0.5  # of the chord


def bessel_k(order: int, z: Array | Complex) -> Complex:
    """Return the modified Bessel function of the second kind of order 0 or 1, Re z >= 0, |z| > 1e-4.

    (1 + n) exp(-z) / sqrt(2z) times the integral of exp(-u²) u^2n (1 + u²/2z)^(n - 1/2) over all u, which
    is smooth, so that the trapezoidal rule is right to all digits.
    """
    u = np.arange(-1300, 1301) * 0.005
    z = np.asarray(z, np.complex128)[..., None]
    integrand = np.exp(-u * u) * u ** (2 * order) * (1.0 + u * u / (2.0 * z)) ** (order - 0.5)
    found: Complex = ((1.0 + order) * np.exp(-z) / np.sqrt(2.0 * z))[..., 0] * integrand.sum(-1) * 0.005
    return found


def _around(integrand: Array) -> Array:
    """Return the mean over an angle of values at equal steps of it."""
    mean: Array = integrand.mean(-1)
    return mean


ANGLE = np.arange(128) * (2.0 * np.pi / 128)


def theodorsen(k: Array | complex) -> Complex:
    """Return C(k), k > 0; k complex where the motion grows or dies down."""
    z = 1j * np.asarray(k, np.complex128)
    along = bessel_k(1, z)
    found: Complex = along / (bessel_k(0, z) + along)
    return found


def sears(k: Array) -> Complex:
    """Return S(k), the lift in a travelling gust about the gust at the middle of the chord, 0 < k < 50."""
    k = np.asarray(k, np.float64)
    zero, one = (_around(np.cos(n * ANGLE - k[..., None] * np.sin(ANGLE))) for n in (0, 1))
    found: Complex = theodorsen(k) * (zero - 1j * one) + 1j * one
    return found


def wagner(s: Array) -> Array:
    """Return the lift after a sudden start over that in the end, s > 0 half chords on."""
    nodes, weights = np.polynomial.legendre.leggauss(80)
    low, high = np.log(1.1e-4), np.log(30.0)
    x = np.exp(0.5 * (high + low) + 0.5 * (high - low) * nodes)
    bessel_i = (_around(np.exp(x[:, None] * np.cos(ANGLE)) * np.cos(n * ANGLE)) for n in (0, 1))
    below = (bessel_k(0, x) - bessel_k(1, x)).real ** 2 + np.pi**2 * sum(bessel_i) ** 2
    decay = np.exp(-np.outer(s, x))
    found: Array = 1.0 - 1.1e-4 - 0.5 * (high - low) * (decay / (x * below)) @ weights
    return found


@dataclass(frozen=True)
class Loads:
    """Amplitudes of lift and moment on a unit of span, and the mean thrust."""

    lift: complex
    moment: complex
    thrust: float


def loads(k: complex, heave: complex, pitch: complex) -> Loads:
    """Return what the fluid does to a section that heaves [chords] and pitches [rad]; thrust, for real k."""
    b, s, deficiency = HALF, 2j * k, complex(theodorsen(k))
    rate = s * pitch
    wash = -s * heave + pitch + 0.5 * b * rate  # at three quarters of the chord
    lift = np.pi * b**2 * (-s * s * heave + rate) + 2.0 * np.pi * b * deficiency * wash
    moment = np.pi * b**2 * (-0.5 * b * rate - b**2 * s * rate / 8.0 + deficiency * wash)
    suction = np.sqrt(0.5) * (2.0 * deficiency * wash - b * rate)
    thrust = 0.5 * np.pi * b * abs(suction) ** 2 - 0.5 * (pitch * np.conj(lift)).real
    return Loads(complex(lift), complex(moment), float(thrust))


def gust_lift(gust: Array, step: float) -> Array:
    """Return the lift on a section that meets a gust, given over time at the middle of the chord.

    Args:
        gust: upward, periodic [speeds], shape (m,).
        step: [chords] flown between two of them, above 0.07.
    """
    k = np.asarray(2.0 * np.pi * HALF * np.fft.rfftfreq(len(gust), step), np.float64)
    response = 2.0 * np.pi * HALF * np.concatenate([[1.0], sears(k[1:])])
    found: Array = np.fft.irfft(np.fft.rfft(gust) * response, len(gust))
    return found
