"""Vortices in a box of fluid, where it turns more than it strains: the Q criterion, and surfaces to draw.

Q is the second invariant of the velocity gradient, Q = (|Ω|² − |S|²)/2 with its antisymmetric part Ω and its
symmetric part S: ω²/4 in a rigid rotation, 0 in a pure shear. A vortex is where Q is above a level.

Source: J. C. R. Hunt, A. A. Wray, P. Moin, Eddies, streams, and convergence zones in turbulent flows,
CTR-S88, Stanford, 1988, p. 193.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from linkwind.frames import Single, VolumeFrame
from linkwind.log.isosurface import Indices, between, isosurface, simplified

SHARE = 0.6  # of all rotation, the sum of √Q over the cells where Q > 0, that vortices have within
FAINT = 1e-3  # of the largest speed, by which velocity changes across a cell: not less is rotation
BINS = np.exp2(np.arange(-160.0, 160.25, 0.25))  # edges, of Q [1/s²]
CONTRAST = 1.5  # largest vorticity of the scale over the least that the surface of a vortex can have


class Scale(NamedTuple):
    """From which level on, and by what, vortices are drawn; one for all frames that are looked at together.

    Attributes:
        level: of Q on their surface [1/s²]; infinite where nothing turns.
        turning: how much they turn about the axes x, y, z of W: the sum of the vorticity's magnitude [1/s].
    """

    level: float
    turning: tuple[float, float, float]

    @property
    def axis(self) -> int:
        """The axis about which they turn most, 0 to 2: the vorticity about it gives the colour."""
        return self.turning.index(max(self.turning))

    @property
    def top(self) -> float:
        """Largest vorticity of the scale [1/s], which reaches as far below 0; ω² is 4 Q and more."""
        return _rounded(CONTRAST * 2.0 * math.sqrt(self.level)) if math.isfinite(self.level) else 1.0


class Vortices(NamedTuple):
    """The surfaces of the vortices of a frame, as triangles.

    Attributes:
        point: their vertices [m], shape (n, 3), in W.
        vorticity: there, about the axis of the scale [1/s], shape (n,).
        velocity: of the fluid there [m/s], shape (n, 3), in W.
        triangle: vertices of each, shape (m, 3), counterclockwise as seen from outside.
    """

    point: Single
    vorticity: Single
    velocity: Single
    triangle: Indices


def gradient(frame: VolumeFrame) -> Single:
    """Return the velocity gradient ∂v_i/∂x_j [1/s], shape (layers, rows, columns, 3, 3), in W."""
    with np.errstate(invalid="ignore", over="ignore"):
        along: Any = np.gradient(frame.velocity, np.float32(frame.cell), axis=(2, 1, 0))
    change: Single = np.stack(along, axis=-1)
    return change


def vorticity(gradient: Single) -> Single:
    """Return the vorticity [1/s], shape (…, 3), of a velocity gradient, shape (…, 3, 3)."""
    turns = [gradient[..., k, j] - gradient[..., j, k] for j, k in ((1, 2), (2, 0), (0, 1))]
    return np.stack(turns, axis=-1)


def criterion(gradient: Single) -> Single:
    """Return Q [1/s²] of a velocity gradient, shape (…, 3, 3): −½ of the trace of its square."""
    with np.errstate(invalid="ignore", over="ignore"):
        q: Single = np.float32(-0.5) * np.einsum("...ij,...ji->...", gradient, gradient)
    return q


def scale(frames: Iterable[VolumeFrame]) -> Scale:
    """Return the level above which ``SHARE`` of the rotation of all frames is, and about what they turn."""
    within, about = np.zeros(len(BINS) - 1), np.zeros(3)
    for frame in frames:
        change = gradient(frame)
        q = criterion(change).astype(np.float64)
        turning = (q > (FAINT * _fastest(frame) / frame.cell) ** 2) & (q < BINS[-1])
        rate = np.sqrt(q[turning])
        within += np.histogram(rate * rate, BINS, weights=rate)[0]
        about += np.abs(vorticity(change[turning])).sum(axis=0, dtype=np.float64)
    above = np.cumsum(within[::-1])
    found = int(np.searchsorted(above, SHARE * above[-1]))
    x, y, z = about.tolist()
    return Scale(_rounded(BINS[-2 - found]) if above[-1] else math.inf, (x, y, z))


def _rounded(value: float) -> float:
    return float(f"{value:.2g}")


def _fastest(frame: VolumeFrame) -> float:
    finite = frame.velocity[np.isfinite(frame.velocity)]
    return float(np.abs(finite).max()) if finite.size else 0.0


def vortices(frame: VolumeFrame, scale: Scale, most: int) -> Vortices:
    """Return the vortices of a frame as about ``most`` triangles at most."""
    change = gradient(frame)
    surface = simplified(isosurface(criterion(change), scale.level), most)
    about = between(vorticity(change)[..., scale.axis], surface.point)
    velocity = between(frame.velocity, surface.point)
    point = np.add(frame.origin, frame.cell * surface.point[:, ::-1]).astype(np.float32)
    return Vortices(point, about, velocity, surface.triangle)
