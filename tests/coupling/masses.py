"""Point masses on a line, each with a spring to the ground: the smallest plant, and its own check."""

from __future__ import annotations

import numpy as np

from linkwind.coupling import Answer
from tests.coupling.two_link_reference import lagrange


class Masses:
    """Masses with ground springs and coordinates x: (m + A) a = W − k x, by Runge–Kutta 4 with substeps."""

    def __init__(self, h, mass, stiffness=0.0, substeps=4):
        self.h = h / substeps
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


def answer(force, added_mass=None):
    """The answer with the given forces along x and added masses along x."""
    wrench = np.zeros((len(force), 6))
    wrench[:, 0] = force
    if added_mass is None:
        return Answer(wrench)
    added = np.zeros((len(force), 6, 6))
    added[:, 0, 0] = added_mass
    return Answer(wrench, added)
