"""Flows on a lattice in space for the tests: equilibria, periodic borders, a collision by its definition."""

import numpy as np

PLANES = [(0, 1), (0, 2), (1, 2)]
SIGNS = [(1, 1), (-1, -1), (1, -1), (-1, 1)]


def _directions():
    c = [(0, 0, 0)] + [tuple(sign * (a == axis) for a in range(3)) for axis in range(3) for sign in (1, -1)]
    for one, other in PLANES:
        for signs in SIGNS:
            c.append(tuple(signs[0] * (a == one) + signs[1] * (a == other) for a in range(3)))
    return np.array(c)


C = _directions()  # (19, 3)
WEIGHTS = np.array([1 / 3] + [1 / 18] * 6 + [1 / 36] * 12)


def equilibrium(density, u):
    """Populations less weights, shape (19, …): marginals of a product of three-point rules.

    Each rule has mean u and variance 1/3. What a plane has on its diagonals is the product of its two rules;
    the axes and rest have what is left of the rule along them.
    """
    u = [np.asarray(v, dtype=float) + 0 * np.asarray(density) for v in u]

    def rule(sign, axis):
        return (1 / 3 + sign * u[axis] + u[axis] ** 2) / 2

    f = np.zeros((19, *u[0].shape))
    for q in range(7, 19):
        one, other = np.flatnonzero(C[q])
        f[q] = rule(C[q, one], one) * rule(C[q, other], other)
    for q in range(1, 7):
        axis = np.flatnonzero(C[q])[0]
        same = (C[:, axis] == C[q, axis]) & (np.abs(C).sum(1) == 2)
        f[q] = rule(C[q, axis], axis) - f[same].sum(0)
    f[0] = 1 - f[1:].sum(0)
    return density * f - _across(WEIGHTS, f)


def strained(density, u, viscosity, gradients):
    """Populations of a flow with velocity gradients ∂_b u_a (3, 3, …), after the collision.

    Second moments off equilibrium are -2 ρ S / (3 ω) before a collision and (1 - ω) of that after it.
    """
    omega = 1 / (3 * viscosity + 0.5)
    rate = (gradients + np.swapaxes(gradients, 0, 1)) / 2
    second = -2 * density * rate / (3 * omega) * (1 - omega)
    f = equilibrium(density, u)
    return f + 4.5 * _across(WEIGHTS, f) * np.einsum("qa,qb,ab...->q...", C, C, second)


def _across(weights, f):
    return weights.reshape(-1, *[1] * (f.ndim - 1))


def grid(lattice):
    """Coordinates x, y, z of the cells, an array of shape (3, nz, ny, nx)."""
    return np.mgrid[: lattice.nz, : lattice.ny, : lattice.nx][::-1]


def wrap(lattice):
    """Make the next step one of a periodic flow, whose period is two cells less than the window each way."""
    f = lattice.populations
    f[..., 0], f[..., -1] = f[..., -2], f[..., 1]
    f[:, :, 0], f[:, :, -1] = f[:, :, -2], f[:, :, 1]
    f[:, 0], f[:, -1] = f[:, -2], f[:, 1]


def smooth_noise(lattice, speed, rng):
    """Fill a lattice with random waves of at least 8 cells, on the stream."""
    at = grid(lattice).astype(float)
    u = np.zeros(at.shape)
    for _ in range(12):
        k, phase = rng.normal(size=3) * 2 * np.pi / 32, rng.uniform(0, 2 * np.pi)
        across = np.cross(k, rng.normal(size=3))
        wave = np.cos(np.tensordot(k, at, 1) + phase)
        u += np.multiply.outer(speed / 3 * across / np.linalg.norm(across), wave)
    u += np.array(lattice.stream)[:, None, None, None]
    lattice.populations[:] = equilibrium(np.ones(at.shape[1:]), u)


def momentum(populations):
    """Momentum of cells, summed in double precision."""
    return np.tensordot(C.T, populations.sum(axis=(1, 2, 3), dtype=float), 1)


EXPONENTS = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
EXPONENTS += [(2, 0, 0), (0, 2, 0), (0, 0, 2), (1, 1, 0), (1, 0, 1), (0, 1, 1)]
EXPONENTS += [(2, 1, 0), (1, 2, 0), (2, 0, 1), (1, 0, 2), (0, 2, 1), (0, 1, 2)]
EXPONENTS += [(2, 2, 0), (2, 0, 2), (0, 2, 2)]


def one_step(populations, omega, force):
    """Stream and collide in double precision, by the definition of central moments; periodic.

    Moments are taken with the 19 x 19 matrix of Π (c_a - u_a)^n, relaxed, and taken back with its inverse:
    K' = K + Λ(K_eq - K) + (1 - Λ/2) S, Λ = ω for second moments less their trace, 0 for mass and momentum,
    1 for the rest; S = F for momentum, F_b / 3 for the moment of a² b, else 0. K_eq are those of a Gauss
    distribution of variance 1/3 as far as the 19 reach, but that of a² b² is less half of what is left off it
    along the third axis.
    """
    f = populations.astype(float) + WEIGHTS[:, None, None, None]
    f = np.array([np.roll(f[q], C[q], (2, 1, 0)) for q in range(19)])
    density = f.sum(0)
    u = (np.tensordot(C.T, f, 1) + force / 2) / density
    off = C[:, :, None, None, None] - u  # (19, 3, nz, ny, nx)
    basis = np.array([np.prod([off[:, a] ** n[a] for a in range(3)], axis=0) for n in EXPONENTS])
    moments = np.einsum("mqkji,qkji->mkji", basis, f)
    after = np.zeros_like(moments)
    for m, n in enumerate(EXPONENTS):
        order = sum(n)
        if order == 0:
            after[m] = moments[m]
        elif order == 1:
            after[m] = moments[m] + force[n.index(1)]
        elif order == 2 and 2 in n:
            trace = moments[4:7].sum(0)
            after[m] = density / 3 + (1 - omega) * (moments[m] - trace / 3)
        elif order == 2:
            after[m] = (1 - omega) * moments[m]
        elif order == 3:
            after[m] = force[n.index(1)] / 6
        else:
            left = after[4 + n.index(0)] - density / 3
            after[m] = density / 9 - left / 2
    out = np.linalg.solve(np.moveaxis(basis, (0, 1), (-2, -1)), np.moveaxis(after, 0, -1)[..., None])
    return np.moveaxis(out[..., 0], -1, 0) - WEIGHTS[:, None, None, None]
