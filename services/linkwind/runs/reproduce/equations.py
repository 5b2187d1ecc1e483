"""The paper's equations of two links on a hinge, Eqs. 6-9, and what they give to 1e-12.

Rahmati & Karimi 2021, doi:10.3390/app11031136. They are written down here apart from the multibody core, to
be compared with. A state is z = (X1, Y1, θ1, θ2 and their rates): the centre of mass of link 1, and the
angles from the world's x axis to the direction from the hinge to the centre of mass of each link.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from linkwind import aero
from linkwind.errors import InputError
from linkwind.log.tables import Trajectory
from linkwind.scenario import Scenario
from linkwind.spatial import Array, Motion, Wrench

ODE45 = {"method": "RK45", "rtol": 1e-3, "atol": 1e-6}  # Matlab's ode45 as it comes: its pair, its tolerances
EXACT = {"method": "DOP853", "rtol": 1e-12, "atol": 1e-12}


class Equations:
    """Two links of a scenario under its forces."""

    def __init__(self, scenario: Scenario, start: Trajectory) -> None:
        """Take masses, inertias, hinge and forces from a scenario, and the first state of its trajectory."""
        bodies, (joint,) = scenario.bodies, scenario.joints
        self._mass = bodies[0].mass, bodies[1].mass
        inertia = [body.inertia for body in bodies if isinstance(body.inertia, float)]
        self._inertia = inertia[0], inertia[1]
        self._arm = -joint.parent_point[0], -joint.child_point[0]
        self._gravity = -scenario.environment.gravity[1]
        self._model = aero.build(scenario, scenario.providers[0])
        self._motion, self._wrench = Motion.at_rest(2), Wrench.zeros(2)
        angles = 2.0 * np.arctan2(start.orientation[0, :, 3], start.orientation[0, :, 0])
        links = start.position[0, 0, :2], angles, start.linear[0, 0, :2], start.angular[0, :, 2]
        self._start = np.concatenate(links)

    def solve(self, t: Array, **how: object) -> tuple[Array, Array]:
        """Integrate.

        Args:
            t: times to tell the state at [s], from 0, shape (k,).
            how: ``ODE45`` or ``EXACT``.

        Returns:
            the velocities Vx, Vy, ω of both links, shape (k, 6), and the steps taken [s].

        Raises:
            InputError: scipy is not there.
        """
        found = _solver()(self._rate, (t[0], t[-1]), self._start, dense_output=True, **how)
        return np.array([self.velocities(z) for z in found.sol(t).T]), np.diff(found.t)

    def velocities(self, z: Array) -> Array:
        """Return Vx, Vy [m/s] and ω [rad/s] of both links, shape (6,)."""
        (l1, l2), (_, _, a1, a2, vx, vy, w1, w2) = self._arm, z
        x2 = vx + l1 * math.sin(a1) * w1 - l2 * math.sin(a2) * w2
        y2 = vy - l1 * math.cos(a1) * w1 + l2 * math.cos(a2) * w2
        return np.array([vx, vy, w1, x2, y2, w2])

    def _rate(self, t: float, z: Array) -> Array:
        return np.concatenate([z[4:], self._acceleration(z, self._forces(t, z))])

    def _acceleration(self, z: Array, forces: Array) -> Array:
        """Solve Eqs. 6-9 for the accelerations of X1, Y1, θ1, θ2.

        They are linear in these: with the joint force q = q0 - dq · acceleration, they are
        R1 + q = m1 (Ẍ1, Ÿ1 + g) and (q1 sinθ1 - q2 cosθ1) l1 + τ1 = I1 θ̈1, and link 2 likewise.
        """
        (m1, m2), (i1, i2), (l1, l2), g = self._mass, self._inertia, self._arm, self._gravity
        r1x, r1y, t1, r2x, r2y, t2 = forces
        s1, c1, s2, c2 = math.sin(z[2]), math.cos(z[2]), math.sin(z[3]), math.cos(z[3])
        w1, w2 = z[6] ** 2, z[7] ** 2
        q1 = r2x - m2 * (l1 * w1 * c1 - l2 * w2 * c2)
        q2 = r2y - m2 * (l1 * w1 * s1 - l2 * w2 * s2 + g)
        dq1 = np.array([m2, 0.0, m2 * l1 * s1, -m2 * l2 * s2])
        dq2 = np.array([0.0, m2, -m2 * l1 * c1, m2 * l2 * c2])
        turning = l1 * (s1 * dq1 - c1 * dq2), l2 * (c2 * dq2 - s2 * dq1)
        matrix = np.diag([m1, m1, i1, i2]) + np.array([dq1, dq2, *turning])
        right = [r1x + q1, r1y + q2 - m1 * g, l1 * (q1 * s1 - q2 * c1) + t1, l2 * (q2 * c2 - q1 * s2) + t2]
        return np.linalg.solve(matrix, right)

    def _forces(self, t: float, z: Array) -> Array:
        """Return force and moment on both links [N, N·m], shape (6,)."""
        (l1, l2), motion = self._arm, self._motion
        motion.position[0, :2] = z[:2]
        motion.position[1, 0] = z[0] - l1 * math.cos(z[2]) + l2 * math.cos(z[3])
        motion.position[1, 1] = z[1] - l1 * math.sin(z[2]) + l2 * math.sin(z[3])
        for body, speed in enumerate(self.velocities(z).reshape(2, 3)):
            half = 0.5 * z[2 + body]
            motion.orientation[body] = math.cos(half), 0.0, 0.0, math.sin(half)
            motion.linear[body, :2], motion.angular[body, 2] = speed[:2], speed[2]
        self._model.evaluate(t, motion, self._wrench)
        return np.hstack([self._wrench.force[:, :2], self._wrench.torque[:, 2:]]).ravel()


def _solver() -> Callable[..., Any]:
    try:
        from scipy.integrate import solve_ivp
    except ImportError as error:
        raise InputError(
            "expected the package scipy, for the exact solution; got none. Install it with: "
            "pip install 'linkwind[reproduce]'"
        ) from error
    return solve_ivp  # type: ignore[no-any-return]
