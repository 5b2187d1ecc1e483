"""Point masses on a line, each with a spring to the ground: the smallest plant, and its own check."""

from __future__ import annotations

import numpy as np

from linkwind.coupling import Answer, Met
from tests.coupling.two_link_reference import lagrange


class Masses:
    """Masses with ground springs and coordinates x: (m + A) a = W − k x, by Runge–Kutta 4 with substeps."""

    def __init__(self, h, mass, stiffness=0.0, substeps=4):
        self.h, self.step = h / substeps, h
        self.mass = np.asarray(mass, dtype=float)
        self.stiffness = stiffness
        self.abscissae = np.arange(2 * substeps + 1) / (2 * substeps)
        self._bases = {}

    def advance(self, state, nodes, wrenches, added_inertia):
        mass = self.mass if added_inertia is None else self.mass + added_inertia[:, 0, 0]
        key = nodes.tobytes()
        if key not in self._bases:
            self._bases[key] = np.array([lagrange(nodes, at) for at in self.abscissae])
        forces = self._bases[key] @ wrenches[:, :, 0]

        def rate(z, force):
            return np.array([z[1], (force - self.stiffness * z[0]) / mass])

        h, z = self.h, state
        for start, middle, end in zip(forces[:-2:2], forces[1::2], forces[2::2], strict=True):
            k1 = rate(z, start)
            k2 = rate(z + h / 2 * k1, middle)
            k3 = rate(z + h / 2 * k2, middle)
            k4 = rate(z + h * k3, end)
            z = z + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        return z

    def twist(self, state):
        twist = np.zeros((len(self.mass), 6))
        twist[:, 0] = state[1]
        return twist

    def inertia(self, state, added_inertia, response):
        return self._added(added_inertia) + self.step * self._own(response)

    def meet(self, state, nodes, wrenches, added_inertia, response, about):
        """Uncoupled masses: held over the step, −g (v − v*) is −g (v₀ − v*) and an added mass h g.

        Through several nodes, the newest wrench is sought by a secant: everything is linear in it.
        """
        g = self._own(response)[:, 0, 0]
        sought = wrenches.copy()
        if len(nodes) == 1:
            inertia = self.inertia(state, added_inertia, response)
            sought[0, :, 0] -= g * (state[1] - about[:, 0])
            new = self.advance(state, nodes, sought, inertia)
        else:
            inertia = self._added(added_inertia)
            first = self.advance(state, nodes, sought, inertia)[1]
            sought[0, :, 0] += 1.0
            slope = self.advance(state, nodes, sought, inertia)[1] - first
            sought[0, :, 0] -= 1.0 + g * (first - about[:, 0]) / (1.0 + g * slope)
            new = self.advance(state, nodes, sought, inertia)
        wrench = wrenches[0].copy()
        wrench[:, 0] -= g * (new[1] - about[:, 0])
        return Met(new, wrench, sought[0], inertia)

    def _own(self, response):
        blocks = np.zeros((len(self.mass), 6, 6))
        for i in range(len(self.mass)):
            blocks[i] = response[6 * i : 6 * i + 6, 6 * i : 6 * i + 6]
        return blocks

    def _added(self, added_inertia):
        return np.zeros((len(self.mass), 6, 6)) if added_inertia is None else added_inertia


def answer(force, added_mass=None, response=None):
    """The answer with the given forces, added masses and responses along x."""
    n = len(force)
    wrench, added, matrix = np.zeros((n, 6)), np.zeros((n, 6, 6)), np.zeros((6 * n, 6 * n))
    wrench[:, 0] = force
    added[:, 0, 0] = 0.0 if added_mass is None else added_mass
    matrix[range(0, 6 * n, 6), range(0, 6 * n, 6)] = 0.0 if response is None else response
    return Answer(wrench, None if added_mass is None else added, None if response is None else matrix)
