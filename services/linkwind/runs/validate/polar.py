"""The flow around a cylinder that oscillates in line, solved another way: nothing here is of the lattice.

Vorticity ω and stream function ψ in the frame of the cylinder, in polar coordinates r = R e^ξ, θ that fit its
surface. The flow is symmetric about the line of motion: ω = Σ ω_n(ξ, t) sin nθ, and so is ψ. The fluid far
away has the velocity U(t) along x:

    ∂ω/∂t + (∂ψ/∂θ ∂ω/∂ξ − ∂ψ/∂ξ ∂ω/∂θ) / r² = ν ∇²ω,   ψ_n'' − n² ψ_n = −r² ω_n,   ψ → U r sin θ

At the surface ψ_n = 0. That the fluid rests there, ψ_n' = 0, is a condition on the vorticity (multiply by
e^{−nξ} and integrate), which decides on its value at the surface: ∫ r² e^{−nξ} ω_n dξ = −2 U R for n = 1, 0
for the others. With a = −dU/dt, the acceleration of the cylinder, the force on it over ρ is

    F = π (R² a + ν R dω₁/dξ − ν R ω₁)   at ξ = 0

Central differences in ξ, Fourier modes in θ, steps backward in time of second order, convection extrapolated.
"""

from __future__ import annotations

import numpy as np

from linkwind.spatial import Array

POINTS, ANGLES, STEPS = 160, 48, 800  # along ξ, along θ, in a period
FAR = 25.0  # radius of the outer border, in diameters
MODES = ANGLES // 3  # what products of modes do not alias into


def oscillating(viscosity: float, period: float, periods: int) -> tuple[Array, Array]:
    """Return phases t/T from 0 to 1 and the force over ρU²D in the last of some periods.

    The cylinder has diameter 1 and the velocity −cos(2π t/T); it starts at rest, at t = T/4.
    """
    flow, h = _Flow(viscosity, period / STEPS), period / STEPS
    rate, force = 2.0 * np.pi / period, []
    for k in range(1, periods * STEPS + STEPS // 4 * 3 + 1):
        t = 0.25 * period + k * h
        force.append(flow.step(np.cos(rate * t)) + np.pi * 0.25 * rate * np.sin(rate * t))
    return np.arange(STEPS + 1) / STEPS, np.array(force[-STEPS - 1 :])


class _Flow:
    """Vorticity and stream function, modes by points."""

    def __init__(self, viscosity: float, h: float) -> None:
        """Invert the matrices of every mode once; h [s] is the time step."""
        xi, self._width = np.linspace(0.0, np.log(2.0 * FAR), POINTS + 1, retstep=True)
        n, r = np.arange(1, MODES + 1)[:, None], 0.5 * np.exp(xi)
        self._n, self._squares, self._h, self._viscosity = n, r * r, h, viscosity
        # ψ: 0 at the surface; outside it there is no vorticity, and ψ_n' + n ψ_n = 2 U r for n = 1, else 0.
        poisson = self._second() - n[:, :, None] ** 2 * np.eye(POINTS + 1)
        poisson[:, 0], poisson[:, 0, 0] = 0.0, 1.0
        poisson[:, -1, -2] *= 2.0
        poisson[:, -1, -1] -= 2.0 * n[:, 0] / self._width
        self._poisson = np.linalg.inv(poisson)
        self._stream_far = -4.0 * r[-1] / self._width
        # ω: what is known at the surface and 0 far away.
        laplacian = (self._second() - n[:, :, None] ** 2 * np.eye(POINTS + 1)) / self._squares[:, None]
        implicit = 1.5 / h * np.eye(POINTS + 1) - viscosity * laplacian
        implicit[:, [0, -1]] = 0.0
        implicit[:, 0, 0] = implicit[:, -1, -1] = 1.0
        self._diffuse = np.linalg.inv(implicit)
        weights = np.full(POINTS + 1, self._width)
        weights[[0, -1]] *= 0.5
        self._slip = weights * self._squares * np.exp(-n * xi)
        self._surface = self._diffuse[:, :, 0]  # by a unit of vorticity at the surface
        self._vorticity = np.zeros((MODES, POINTS + 1))
        self._before, self._convected = self._vorticity, self._vorticity
        self._stream = self._vorticity

    def _second(self) -> Array:
        """Return the matrix of the second derivative along ξ, borders apart."""
        ones = np.ones(POINTS)
        matrix = np.diag(ones, 1) + np.diag(ones, -1) - 2.0 * np.eye(POINTS + 1)
        return np.asarray(matrix / self._width**2)

    def step(self, speed: float) -> float:
        """Go on to a velocity of the far fluid; return the force over ρ but for π R² a."""
        convected = self._convection()
        now, before = self._vorticity, self._before
        known = (4.0 * now - before) / (2.0 * self._h) + 2.0 * convected - self._convected
        known[:, [0, -1]] = 0.0
        vorticity = np.matmul(self._diffuse, known[:, :, None])[:, :, 0]
        lacks = -(self._slip * vorticity).sum(axis=1)
        lacks[0] -= speed  # 2 U R
        vorticity += (lacks / (self._slip * self._surface).sum(axis=1))[:, None] * self._surface
        self._before, self._vorticity, self._convected = now, vorticity, convected
        source = -self._squares * vorticity
        source[:, 0] = 0.0
        source[0, -1] += self._stream_far * speed
        self._stream = np.matmul(self._poisson, source[:, :, None])[:, :, 0]
        first = vorticity[0]
        slope = np.dot([-25.0, 48.0, -36.0, 16.0, -3.0], first[:5]) / (12.0 * self._width)
        return float(np.pi * 0.5 * self._viscosity * (slope - first[0]))

    def _convection(self) -> Array:
        """Return minus the convection of the vorticity, by modes."""
        psi, omega, n = self._stream, self._vorticity, self._n
        product = _cosines(n * psi) * _sines(self._slope(omega)) - _sines(self._slope(psi)) * _cosines(
            n * omega
        )
        modes = np.fft.rfft(product / self._squares, axis=0)[1 : MODES + 1]
        return np.asarray(2.0 / ANGLES * modes.imag)

    def _slope(self, modes: Array) -> Array:
        return np.gradient(modes, self._width, axis=1, edge_order=2)


def _sines(modes: Array) -> Array:
    """Return Σ a_n sin nθ at the angles."""
    return _at_angles(-0.5j * ANGLES * modes)


def _cosines(modes: Array) -> Array:
    """Return Σ a_n cos nθ at the angles."""
    return _at_angles(0.5 * ANGLES * modes)


def _at_angles(modes: np.ndarray) -> Array:
    spectrum = np.zeros((ANGLES // 2 + 1, POINTS + 1), dtype=np.complex128)
    spectrum[1 : MODES + 1] = modes
    return np.asarray(np.fft.irfft(spectrum, ANGLES, axis=0))
