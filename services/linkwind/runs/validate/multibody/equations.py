"""Eqs. 6-9 of Rahmati & Karimi 2021, written here from the paper, on random states."""

from __future__ import annotations

import time

import numpy as np

from linkwind.runs.validate.multibody.moving import Moving
from linkwind.runs.validate.rows import Findings, most
from linkwind.scenario import load
from linkwind.spatial import Array

PAPER = "A. Rahmati, H. R. Karimi 2021, doi:10.3390/app11031136, Eqs. 6-9"
MASS, INERTIA, ARM, G = 2.0, 1.4, 0.25, 9.81


def residuals(theta: Array, omega: Array, loads: Array, acceleration: Array) -> tuple[Array, Array, float]:
    """Return the residuals [N, N·m], shape (4,), the joint force on the first body [N], shape (2,), and the
    largest term.

    Args:
        theta: angles of both bodies [rad], shape (2,).
        omega: their rates [rad/s], shape (2,).
        loads: Rx, Ry [N], τ [N·m] on both, shape (2, 3).
        acceleration: Ẍ, Ÿ of the first [m/s²], and both angular ones [rad/s²], shape (4,).
    """
    x, y, alpha = acceleration[0], acceleration[1], acceleration[2:]
    (r1x, r1y, t1), (r2x, r2y, t2) = loads
    f = alpha * np.sin(theta) + omega**2 * np.cos(theta)
    h = alpha * np.cos(theta) - omega**2 * np.sin(theta)
    q1 = r2x - MASS * (x + ARM * f[0] - ARM * f[1])
    q2 = r2y - MASS * (y - ARM * h[0] + ARM * h[1] + G)
    sin, cos = np.sin(theta), np.cos(theta)
    left = np.array(
        [
            r1x + q1 - MASS * x,
            r1y + q2 - MASS * G - MASS * y,
            (q1 * sin[0] - q2 * cos[0]) * ARM + t1 - INERTIA * alpha[0],
            (-q1 * sin[1] + q2 * cos[1]) * ARM + t2 - INERTIA * alpha[1],
        ]
    )
    terms = np.concatenate(
        [loads.ravel(), MASS * np.array([G, x, y]), MASS * ARM * f, MASS * ARM * h, INERTIA * alpha]
    )
    return left, np.array([q1, q2]), float(np.abs(terms).max())


def paper(short: bool) -> Findings:
    """Accelerations and joint force of the two links."""
    rng = np.random.default_rng(6)
    moving, start = Moving(load("two_link_field")), time.perf_counter()
    worst, joint, count = 0.0, 0.0, 200 if short else 5000
    for _ in range(count):
        theta, omega = rng.uniform(-20.0, 20.0, 2), rng.uniform(-30.0, 30.0, 2)
        loads = rng.uniform(-100.0, 100.0, (2, 3))
        q = np.array([*rng.normal(size=2), theta[0], theta[1] - theta[0]])
        v = np.array([*rng.normal(size=2), omega[0], omega[1] - omega[0]])
        wrench = np.zeros((2, 6))
        wrench[:, [0, 1, 5]] = loads
        result = moving.multibody.evaluate(moving.multibody.initial_state(q, v), wrench)
        a = result.acceleration
        left, force, size = residuals(theta, omega, loads, np.array([*a[0, :2], *a[:, 5]]))
        worst = max(worst, float(np.abs(left).max()) / size)
        joint = max(joint, float(np.abs(result.reaction[1, :2] + force).max()) / size)
    case = f"the paper's equations, {count} random states"
    rows = [
        most(case, "residual over the largest term", worst, 1e-12, PAPER),
        most(case, "joint force off the paper's, over the largest term", joint, 1e-12, PAPER),
    ]
    return Findings(rows, seconds=time.perf_counter() - start)


CASES = {"equations of the paper": paper}
