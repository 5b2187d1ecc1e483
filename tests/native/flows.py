"""Flows on a lattice for the tests: velocity fields, equilibria written another way than in C, neighbours."""

import numpy as np

CX = np.array([0, 1, 0, -1, 0, 1, -1, -1, 1])
CY = np.array([0, 0, 1, 0, -1, 1, 1, -1, -1])
WEIGHTS = np.array([4 / 9] + [1 / 9] * 4 + [1 / 36] * 4)


def equilibrium(density, u, v):
    """Populations less weights, shape (9, …): products of three-point rules of mean u and variance 1/3."""

    def rule(c, mean):
        return 2 / 3 - mean**2 if c == 0 else (1 / 3 + c * mean + mean**2) / 2

    rest = [f * np.ones_like(density + u) for f in WEIGHTS]
    return np.array([density * rule(a, u) * rule(b, v) - w for a, b, w in zip(CX, CY, rest, strict=True)])


def strained(density, u, v, viscosity, gradients):
    """Populations of a flow with velocity gradients (u_x, u_y, v_x, v_y), after the collision.

    Second moments off equilibrium are -2 ρ S / (3 ω) before a collision and (1 - ω) of that after it; the
    trace is none.
    """
    omega = 1 / (3 * viscosity + 0.5)
    ux, uy, vx, vy = gradients
    factor = -2 * density / (3 * omega) * (1 - omega)
    normal, cross = factor * (ux - vy) / 2, factor * (uy + vx) / 2
    off = 4.5 * WEIGHTS[:, None, None] * (normal * (CX**2 - CY**2)[:, None, None])
    off = off + 9 * WEIGHTS[:, None, None] * cross * (CX * CY)[:, None, None]
    return equilibrium(density, u, v) + off


def grid(lattice):
    """Coordinates of the cells, two arrays of shape (ny, nx)."""
    y, x = np.mgrid[: lattice.ny, : lattice.nx]
    return x, y


def taylor_green(lattice, length, speed, viscosity):
    """Fill a lattice with vortices of a wavelength; return their streamwise shape function."""
    x, y = grid(lattice)
    k = 2 * np.pi / length
    shape = np.cos(k * x) * np.sin(k * y)
    u, v = speed * shape, -speed * np.sin(k * x) * np.cos(k * y)
    pressure = -(speed**2) / 4 * (np.cos(2 * k * x) + np.cos(2 * k * y))
    sines, cosines = np.sin(k * x) * np.sin(k * y), np.cos(k * x) * np.cos(k * y)
    gradients = speed * k * np.array([-sines, cosines, -cosines, sines])
    lattice.populations[:] = strained(1 + 3 * pressure, u, v, viscosity, gradients)
    return shape


def smooth_noise(lattice, speed, rng):
    """Fill a lattice with random waves of at least 8 cells, on the stream."""
    x, y = grid(lattice)
    u, v = (np.zeros(x.shape) for _ in range(2))
    for _ in range(20):
        k, phase = rng.normal(size=2) * 2 * np.pi / 32, rng.uniform(0, 2 * np.pi)
        wave = speed * rng.normal() / 4 * np.cos(k[0] * x + k[1] * y + phase)
        u, v = u - k[1] / np.hypot(*k) * wave, v + k[0] / np.hypot(*k) * wave
    ux, uy = lattice.stream
    lattice.populations[:] = equilibrium(1 + 0 * u, ux + u, uy + v)


def one_step(populations, omega, force):
    """Stream and collide in double precision, by the definition of central moments; periodic.

    Every moment relaxes as K' = K + Λ(K_eq - K) + (1 - Λ/2) S, Λ = ω for the two shear moments, 0 for mass
    and momentum, 1 for the rest; S = F for momentum, F/3 for third moments, 0 else.
    """
    f = populations.astype(float) + WEIGHTS[:, None, None]
    f = np.array([np.roll(f[q], (CY[q], CX[q]), (0, 1)) for q in range(9)])
    density = f.sum(0)
    ux, uy = (np.tensordot(c, f, 1) + force[a] / 2 for a, c in enumerate((CX, CY)))
    a, b = (c[:, None, None] - u / density for c, u in ((CX, ux), (CY, uy)))
    basis = np.array([a**0, a, b, a * a + b * b, a * a - b * b, a * b, a * a * b, a * b * b, a * a * b * b])
    moments = np.einsum("kqji,qji->kji", basis, f)
    rates = np.array([0, 0, 0, 1, omega, omega, 1, 1, 1])[:, None, None]
    zero = np.zeros_like(density)
    target = np.array([density, zero, zero, density * 2 / 3, zero, zero, zero, zero, density / 9])
    x, y = force
    source = np.array([zero, x, y, zero, zero, zero, y / 3, x / 3, zero])
    moments += rates * (target - moments) + (1 - rates / 2) * source
    out = np.linalg.solve(basis.transpose(2, 3, 0, 1), moments.transpose(1, 2, 0)[..., None])
    return out[..., 0].transpose(2, 0, 1) - WEIGHTS[:, None, None]
