"""The paper's two-link mechanism, Eqs. 6–9, written down once more and by other means than the library's.

Rahmati & Karimi 2021, doi:10.3390/app11031136. State z = (X1, Y1, θ1, θ2 and their rates); forces F = (R1x,
R1y, τ1, R2x, R2y, τ2) at the centres of mass. The equations are linear in the accelerations: the matrix is
found by putting unit accelerations into them.
"""

from __future__ import annotations

from math import cos, hypot, pi, sin

import numpy as np
from scipy.integrate import solve_ivp

from linkwind.coupling import Answer

MASS, INERTIA, ARM, GRAVITY = 2.0, 1.4, 0.25, 9.81
START = np.array([0.0, 0.0, pi - 0.3, 0.3, -0.5, 0.2, 0.6, -0.4])
END = 1.2
WEIGHT = np.array([[1 / MASS] * 3 + [1 / INERTIA] * 3] * 2)


def acceleration(z, F):
    """Solve Eqs. 6–9 for (Ẍ1, Ÿ1, θ̈1, θ̈2).

    With f_i = θ̈_i sin θ_i + θ̇_i² cos θ_i and h_i = θ̈_i cos θ_i − θ̇_i² sin θ_i the joint force is
    q = R2 − m2 (Ẍ1 + l (f1 − f2), Ÿ1 − l (h1 − h2) + g), and the four equations are those of body 1, and the
    moments about both centres of mass.
    """
    s1, c1, s2, c2 = sin(z[2]), cos(z[2]), sin(z[3]), cos(z[3])
    w1, w2 = z[6] ** 2, z[7] ** 2
    m, i, a, g = MASS, INERTIA, ARM, GRAVITY
    qx = F[3] - m * a * (w1 * c1 - w2 * c2)  # the joint force at zero acceleration
    qy = F[4] - m * (a * (w1 * s1 - w2 * s2) + g)
    # columns: what the acceleration takes off q; q = q0 − dq @ acceleration
    dqx = np.array([m, 0.0, m * a * s1, -m * a * s2])
    dqy = np.array([0.0, m, -m * a * c1, m * a * c2])
    left = np.array([dqx, dqy, a * (s1 * dqx - c1 * dqy), a * (c2 * dqy - s2 * dqx)])
    left += np.diag([m, m, i, i])
    right = [F[0] + qx, F[1] + qy - m * g, a * (qx * s1 - qy * c1) + F[2], a * (qy * c2 - qx * s2) + F[5]]
    return np.linalg.solve(left, np.array(right))


def body2(z):
    """Position and velocity of the centre of mass of body 2: x, y, vx, vy."""
    s1, c1, s2, c2 = sin(z[2]), cos(z[2]), sin(z[3]), cos(z[3])
    return (
        z[0] - ARM * c1 + ARM * c2,
        z[1] - ARM * s1 + ARM * s2,
        z[4] + ARM * s1 * z[6] - ARM * s2 * z[7],
        z[5] - ARM * c1 * z[6] + ARM * c2 * z[7],
    )


def velocities(states):
    """The six channels Vx, Vy, ω of both bodies, shape (len(states), 6)."""
    return np.array([[z[4], z[5], z[6], *body2(z)[2:], z[7]] for z in states])


def f0(t, z):
    """Field F0: time only, 3 to 40 Hz."""
    w = 2 * pi * t
    return np.array(
        [
            -12 + 8 * sin(7 * w) + 6 * sin(23 * w + 1) + 4 * cos(40 * w),
            14 + 5 * sin(5 * w + 0.5) + 5 * cos(31 * w),
            0.8 * cos(3 * w) + sin(19 * w),
            -10 + 8 * cos(9 * w) + 6 * sin(27 * w) + 4 * sin(37 * w + 2),
            15 + 5 * cos(6 * w) + 5 * sin(33 * w + 1),
            -0.6 * sin(4 * w) + cos(21 * w),
        ]
    )


def f1(t, z):
    """Field F1: a plate in gusts, of time, place and velocity."""
    x2, y2, vx2, vy2 = body2(z)
    bodies = ((z[0], z[1], z[2], z[4], z[5], z[6]), (x2, y2, z[3], vx2, vy2, z[7]))
    return np.concatenate([_plate_f1(t, b, *body) for b, body in enumerate(bodies)])


def _plate_f1(t, b, x, y, angle, vx, vy, spin):
    w = 2 * pi
    gx = 1 + 0.3 * sin(w * (12 * t + 1.3 * x)) + 0.2 * sin(w * (35 * t - 0.9 * y + 0.3 * b))
    gy = 0.3 * cos(w * (17 * t + 1.1 * y)) + 0.2 * sin(w * (29 * t + x))
    ux, uy = -5 * gx - vx, 5 * gy - vy
    ex, ey = cos(angle), sin(angle)
    normal, along, speed, q = uy * ex - ux * ey, ux * ex + uy * ey, hypot(ux, uy), 0.3
    fn, fe = 2.2 * q * normal * speed, 0.2 * q * along * abs(along)
    torque = -0.08 * fn * along / speed - 0.15 * spin * abs(normal)
    return fe * ex - fn * ey, fe * ey + fn * ex, torque


def breeze(t, z):
    """A gentle field of time, place and velocity, without corners: for orders of convergence."""
    _, y2, vx2, vy2 = body2(z)
    gust = 2 * sin(9 * t + z[0])
    return np.array(
        [
            gust - 0.8 * z[4],
            17 + 3 * cos(7 * t) - 0.6 * z[5] - 4 * z[1],
            0.5 * sin(8 * t) - 0.3 * z[6] + 0.4 * sin(z[2]),
            gust - 0.8 * vx2,
            17 + 3 * sin(6 * t + 1) - 0.6 * vy2 - 4 * y2,
            0.5 * cos(8 * t) - 0.3 * z[7],
        ]
    )


def reference(field, steps, end=END):
    """States at steps+1 equal times, by DOP853 at rtol 1e-12."""

    def rate(t, z):
        return np.concatenate([z[4:], acceleration(z, field(t, z))])

    times = np.linspace(0.0, end, steps + 1)
    return solve_ivp(rate, (0.0, end), START, "DOP853", times, rtol=1e-12, atol=1e-13).y.T


def wrench(F):
    """Planar forces of both bodies as the (2, 6) wrench of the coupling."""
    out = np.zeros((2, 6))
    out[:, [0, 1, 5]] = F.reshape(2, 3)
    return out


def lagrange(nodes, at):
    """The values of the Lagrange polynomials of the nodes at one abscissa."""
    return np.array(
        [np.prod([(at - other) / (node - other) for other in nodes if other != node]) for node in nodes]
    )


class TwoLink:
    """Eqs. 6–9 as a plant: Runge–Kutta 4, forward or semi-implicit Euler, over a step of size ``h``."""

    def __init__(self, h, method="rk4"):
        self.h = h
        self.method = method
        self._bases = {}

    def advance(self, state, nodes, wrenches, added_inertia):
        assert added_inertia is None
        key = nodes.tobytes()
        if key not in self._bases:
            self._bases[key] = np.array([lagrange(nodes, at) for at in (0.0, 0.5, 1.0)])
        forces = self._bases[key] @ wrenches[:, :, [0, 1, 5]].reshape(len(nodes), 6)
        return getattr(self, "_" + self.method)(state, *forces)

    def _rk4(self, z, start, middle, end):
        h = self.h
        k1 = _rate(z, start)
        k2 = _rate(z + h / 2 * k1, middle)
        k3 = _rate(z + h / 2 * k2, middle)
        k4 = _rate(z + h * k3, end)
        return z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)

    def _euler(self, z, start, middle, end):
        return z + self.h * _rate(z, start)

    def _semi_implicit_euler(self, z, start, middle, end):
        v = z[4:] + self.h * acceleration(z, start)
        return np.concatenate([z[:4] + self.h * v, v])


def _rate(z, F):
    return np.concatenate([z[4:], acceleration(z, F)])


def exchange(field, h):
    """The field as the exchange of a scheme."""

    def ask(step, iteration, accepted, trial):
        return Answer(wrench(field(step * h, trial)))

    return ask
