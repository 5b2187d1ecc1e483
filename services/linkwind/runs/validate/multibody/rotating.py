"""Bodies that turn in space, against Jacobi's solutions: free (tennis racket), and on a pivot."""

from __future__ import annotations

import math

import numpy as np

from linkwind.mechanism.quaternion import rotate
from linkwind.runs.validate.multibody.elliptic import jacobi
from linkwind.runs.validate.multibody.moving import TIGHT, Moving
from linkwind.runs.validate.multibody.scenes import joint, racket, scene
from linkwind.runs.validate.rows import Curve, Findings, Plot, most
from linkwind.spatial import Array

LANDAU = "exact: L. D. Landau, E. M. Lifshitz, Mechanics, § 37"
WHITTAKER = "exact: E. T. Whittaker, Analytical Dynamics, § 55"
INERTIA = np.array([1.0, 2.0, 2.9])


def racket_rates(t: float, w1: float, w3: float) -> Array:
    """Return the angular velocity in the body's frame of one that starts at (w1, 0, w3)."""
    i1, i2, i3 = INERTIA
    energy2, momentum2 = i1 * w1**2 + i3 * w3**2, (i1 * w1) ** 2 + (i3 * w3) ** 2
    rate = math.sqrt((i3 - i2) * (momentum2 - energy2 * i1) / (i1 * i2 * i3))
    m = (i2 - i1) * (energy2 * i3 - momentum2) / ((i3 - i2) * (momentum2 - energy2 * i1))
    w2 = math.sqrt((energy2 * i3 - momentum2) / (i2 * (i3 - i2)))
    sn, cn, dn = jacobi(rate * t, m)
    return np.array([w1 * cn, w2 * sn, w3 * dn])


def free_body(short: bool) -> Findings:
    """A free body close to the separatrix: angular velocity, and angular momentum in W."""
    end = 20.0 if short else 100.0
    case = f"free rigid body, dopri5 at 1e-12, {end:g} s"
    moving = Moving(racket())
    momentum = INERTIA * [2.0, 0.0, 1.25]
    times = np.arange(0.25, end + 0.1, 0.25)
    off, turned, rates = [], [], []
    for t in times:
        moving.go(0.25, 0.25, **TIGHT)
        w = moving.state[10:13]
        rates.append(w[1])
        off.append(np.abs(w - racket_rates(float(t), 2.0, 1.25)).max())
        turned.append(np.abs(rotate(moving.state[3:7], INERTIA * w) - momentum).max())
    rows = [
        most(case, "error of angular velocity [rad/s]", float(max(off)), 1e-8, LANDAU),
        most(case, "drift of angular momentum in W [kg·m²/s]", float(max(turned)), 1e-8),
    ]
    exact = np.array([racket_rates(float(t), 2.0, 1.25)[1] for t in times])
    curves = (Curve("linkwind", times, np.array(rates)), Curve("Jacobi", times, exact, True))
    plot = Plot("Free rigid body: rate about its middle axis", "t [s]", "ω₂ [rad/s]", curves)
    return Findings(rows, [plot] if short else [], moving.seconds)


MASS, LENGTH, ACROSS = 1.5, 0.8, 0.07
TILT, SWING = 0.4, 4.5  # from straight down [rad]; about the vertical [rad/s]


def pendulum_height(t: float) -> float:
    """Return the height of the centre of mass over the pivot, in lengths: between two roots of a cubic."""
    inertia = ACROSS + MASS * LENGTH**2
    lowest, about = -math.cos(TILT), SWING * math.sin(TILT) ** 2
    a = 2.0 * MASS * 9.81 * LENGTH / inertia
    c = SWING**2 * math.sin(TILT) ** 2 + a * lowest
    low, high, beyond = np.sort(np.roots([a, -c, -a, c - about**2]).real)
    sn = jacobi(0.5 * math.sqrt(a * (beyond - low)) * t, float((high - low) / (beyond - low)))[0]
    return float(low + (high - low) * sn**2)


def spherical_pendulum(short: bool) -> Findings:
    """A rod on a ball joint, started at its lowest, sideways."""
    end = 10.0 if short else 100.0
    case = f"spherical pendulum, dopri5 at 1e-12, {end:g} s"
    along = np.array([0.0, math.sin(TILT), -math.cos(TILT)])
    spin = np.array([0.0, 0.0, SWING])
    rod = {
        "name": "rod", "mass": MASS, "inertia": [ACROSS, ACROSS, 0.03, 0.0, 0.0, 0.0],
        "orientation": [math.cos(TILT / 2), math.sin(TILT / 2), 0.0, 0.0],
        "angular_velocity": (spin - along * (along @ spin)).tolist(),
    }  # fmt: skip
    pivot = joint("pivot", "world", "rod", [0.0, 0.0, 0.0], [0.0, 0.0, LENGTH], "spherical")
    moving = Moving(scene([rod], [pivot], (0.0, 0.0, -9.81)))
    energy, off, drift = moving.energy, 0.0, 0.0
    for k in range(1, round(end / 0.1) + 1):
        moving.go(0.1, 0.1, **TIGHT)
        height = moving.motion.position[0, 2]
        off = max(off, abs(height - LENGTH * pendulum_height(0.1 * k)))
        drift = max(drift, abs(moving.energy - energy))
    rows = [
        most(case, "error of the height [m]", off, 1e-8, WHITTAKER),
        most(case, "energy drift over the energy", drift / abs(energy), 1e-9),
    ]
    return Findings(rows, seconds=moving.seconds)


CASES = {"free rigid body": free_body, "spherical pendulum": spherical_pendulum}
