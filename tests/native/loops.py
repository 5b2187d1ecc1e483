"""Mechanisms with loops for the tests of the core."""

from __future__ import annotations

import numpy as np

from linkwind.native.multibody import Multibody
from tests.native.mechanisms import (
    KEPT,
    Body,
    Closure,
    motion_of,
    random_rotation,
    random_state,
    random_tree,
    tables,
)


def closure_at(rng, multibody: Multibody, state: np.ndarray, first: int, second: int, kind: str) -> Closure:
    """A joint between two bodies that is closed at ``state``."""
    motion = motion_of(multibody, state)
    point, frame = rng.normal(size=3), random_rotation(rng)
    other = point + rng.normal(size=3) if kind == "distance" else point

    def seen(body, place):
        if body < 0:
            return place, frame
        turn = matrix_of(motion, body)
        return turn.T @ (place - motion.position[body]), turn.T @ frame

    (p0, r0), (p1, r1) = seen(first, point), seen(second, other)
    return Closure(first, second, KEPT[kind], p0, p1, r0, r1, float(np.linalg.norm(other - point)) or 1.0)


def matrix_of(motion, body: int) -> np.ndarray:
    w, x, y, z = motion.orientation[body]
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def random_loops(rng, n: int, kinds: tuple[str, ...], gravity=(0.3, -9.81, 1.0)):
    """A random tree of ``n`` bodies of which random pairs are joined, and a state that satisfies them."""
    bodies = random_tree(rng, n, springs=True)
    tree = Multibody(tables(bodies, gravity))
    state = random_state(rng, tree)
    pairs = [tuple(int(b) for b in rng.choice(np.arange(-1, n), 2, replace=False)) for _ in kinds]
    closures = [closure_at(rng, tree, state, *pair, kind) for pair, kind in zip(pairs, kinds, strict=True)]
    multibody = Multibody(tables(bodies, gravity, closures))
    return bodies, closures, multibody, multibody.close(state)


def four_bars(count: int, kept: int = 3) -> tuple[Multibody, np.ndarray]:
    """The N-four-bar mechanism (IFToMM A02): ``count`` windows of rods of 1 m and 1 kg, started at 1 m/s.

    M. Gonzalez, F. Gonzalez, A. Luaces, J. Cuadrado 2010, doi:10.1007/s11044-010-9210-0.
    """
    rod = np.diag([1 / 24, 1 / 24, 1 / 12])
    bodies, closures, q, v = [], [], [], []
    for i in range(count + 1):
        bodies.append(Body(-1, "revolute", 1.0, rod, (i, 0, 0), (-0.5, 0, 0)))
        q, v = [*q, np.pi / 2], [*v, -1.0]
        if i < count:
            closures.append(Closure(len(bodies), len(bodies) + 1, kept, (0.5, 0, 0), (0.5, 0, 0)))
            bodies.append(Body(len(bodies) - 1, "revolute", 1.0, rod, (0.5, 0, 0), (-0.5, 0, 0)))
            q, v = [*q, -np.pi / 2], [*v, 1.0]
    multibody = Multibody(tables(bodies, closures=closures))
    return multibody, multibody.initial_state(np.array(q), np.array(v))
