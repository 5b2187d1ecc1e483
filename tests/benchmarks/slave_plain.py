"""The mechanism of ``two_link`` as a PythonFMU slave in plain Python, as fast as plain Python gets.

Eqs. 6-9 of Rahmati & Karimi 2021, doi:10.3390/app11031136, with the joint force eliminated by hand, so that
a two-by-two system for the angular accelerations is left; rk4, one substep. Inputs are held over the step.
"""

from __future__ import annotations

from math import cos, radians, sin

from pythonfmu import Fmi2Causality, Fmi2Slave, Real

M1, M2 = 2.0, 2.0  # kg
I1, I2 = 1.4, 1.4  # kg·m²
L1, L2 = 0.25, 0.25  # m, joint to centre of mass
G = 9.81  # m/s²
START = (-0.2349231551964771, -0.08550503583141716, radians(200), radians(-20), 0.0, 0.0, 0.0, 0.0)

REDUCED = M1 * M2 / (M1 + M2)
J1, J2, J12 = I1 + REDUCED * L1 * L1, I2 + REDUCED * L2 * L2, REDUCED * L1 * L2

INPUTS = [f"{kind}{body}{axis}" for body in (1, 2) for kind in "FT" for axis in "xyz"]
OUTPUTS = [
    f"{kind}{body}{axis}" for body in (1, 2) for kind, axes in (("r", "xyz"), ("o", "wxyz")) for axis in axes
]


class TwoLink(Fmi2Slave):
    """Forces and torques in; positions and quaternions of both bodies out."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.state = START  # X1, Y1, θ1, θ2 and their rates
        for names, causality in ((INPUTS, Fmi2Causality.input), (OUTPUTS, Fmi2Causality.output)):
            for name in names:
                setattr(self, name, 0.0)
                self.register_variable(Real(name, causality=causality))
        self.set_poses()

    def set_poses(self):
        x, y, a, b, *_ = self.state
        self.r1x, self.r1y = x, y
        self.r2x, self.r2y = x - L1 * cos(a) + L2 * cos(b), y - L1 * sin(a) + L2 * sin(b)
        self.o1w, self.o1z = cos(a / 2), sin(a / 2)
        self.o2w, self.o2z = cos(b / 2), sin(b / 2)

    def accelerations(self, a, b, u, w):
        """Return d²/dt² of X1, Y1, θ1, θ2 at angles a, b and their rates u, w."""
        c1, s1, c2, s2 = cos(a), sin(a), cos(b), sin(b)
        p1, p2 = L1 * u * u, L2 * w * w
        # joint force without its part from the angular accelerations
        qx = REDUCED * (self.F2x / M2 - self.F1x / M1 - p1 * c1 + p2 * c2)
        qy = REDUCED * (self.F2y / M2 - self.F1y / M1 - p1 * s1 + p2 * s2)
        t1 = self.T1z + L1 * (qx * s1 - qy * c1)
        t2 = self.T2z + L2 * (qy * c2 - qx * s2)
        k = J12 * (c1 * c2 + s1 * s2)
        determinant = J1 * J2 - k * k
        u_dot, w_dot = (J2 * t1 + k * t2) / determinant, (J1 * t2 + k * t1) / determinant
        qx -= REDUCED * (L1 * u_dot * s1 - L2 * w_dot * s2)
        qy += REDUCED * (L1 * u_dot * c1 - L2 * w_dot * c2)
        return (self.F1x + qx) / M1, (self.F1y + qy) / M1 - G, u_dot, w_dot

    def do_step(self, current_time, step_size):
        x, y, a, b, vx, vy, u, w = self.state
        h, half, sixth = step_size, step_size / 2, step_size / 6
        x1, y1, a1, b1 = self.accelerations(a, b, u, w)
        u2, w2 = u + half * a1, w + half * b1
        x2, y2, a2, b2 = self.accelerations(a + half * u, b + half * w, u2, w2)
        u3, w3 = u + half * a2, w + half * b2
        x3, y3, a3, b3 = self.accelerations(a + half * u2, b + half * w2, u3, w3)
        u4, w4 = u + h * a3, w + h * b3
        x4, y4, a4, b4 = self.accelerations(a + h * u3, b + h * w3, u4, w4)
        self.state = (
            x + h * (vx + sixth * (x1 + x2 + x3)),
            y + h * (vy + sixth * (y1 + y2 + y3)),
            a + sixth * (u + 2 * (u2 + u3) + u4),
            b + sixth * (w + 2 * (w2 + w3) + w4),
            vx + sixth * (x1 + 2 * (x2 + x3) + x4),
            vy + sixth * (y1 + 2 * (y2 + y3) + y4),
            u + sixth * (a1 + 2 * (a2 + a3) + a4),
            w + sixth * (b1 + 2 * (b2 + b3) + b4),
        )
        self.set_poses()
        return True
