"""The slave of ``slave_plain`` with the paper's general form instead: M(y) ÿ + C + G = R, solved by numpy."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from slave_plain import I1, I2, L1, L2, M1, M2, G, TwoLink


class TwoLinkNumpy(TwoLink):
    """Another way to the same accelerations; the state is an array."""

    def rate(self, state):
        """Return d/dt of the state (8,)."""
        a, b, u, w = state[[2, 3, 6, 7]].tolist()
        c1, s1, c2, s2 = cos(a), sin(a), cos(b), sin(b)
        p1, p2 = L1 * u * u, L2 * w * w
        m, k = M1 + M2, -M2 * L1 * L2 * cos(a - b)
        e1x, e1y, e2x, e2y = M2 * L1 * s1, -M2 * L1 * c1, -M2 * L2 * s2, M2 * L2 * c2
        matrix = [
            [m, 0.0, e1x, e2x],
            [0.0, m, e1y, e2y],
            [e1x, e1y, I1 + M2 * L1 * L1, k],
            [e2x, e2y, k, I2 + M2 * L2 * L2],
        ]
        qx = self.F2x - M2 * (p1 * c1 - p2 * c2)
        qy = self.F2y - M2 * (p1 * s1 - p2 * s2 + G)
        right = [
            self.F1x + qx,
            self.F1y - M1 * G + qy,
            self.T1z + L1 * (qx * s1 - qy * c1),
            self.T2z - L2 * (qx * s2 - qy * c2),
        ]
        return np.concatenate((state[4:], np.linalg.solve(matrix, right)))

    def do_step(self, current_time, step_size):
        state, h = np.asarray(self.state), step_size
        k1 = self.rate(state)
        k2 = self.rate(state + h / 2 * k1)
        k3 = self.rate(state + h / 2 * k2)
        k4 = self.rate(state + h * k3)
        self.state = state + h / 6 * (k1 + 2 * (k2 + k3) + k4)
        self.set_poses()
        return True
