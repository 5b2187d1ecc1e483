"""The fluid on a lattice against exact solutions, balances, and a collision written by its definition."""

import numpy as np
import pytest

from linkwind.native.fluid import shear_rate
from linkwind.native.lattice import Lattice
from tests.native.flows import (
    CX,
    CY,
    equilibrium,
    grid,
    one_step,
    smooth_noise,
    strained,
    taylor_green,
)

ULP = 2.0**-24  # round-off of a float near 1


def rng():
    return np.random.default_rng(9)


@pytest.mark.parametrize("omega", [0.6, 1.0, 1.9])
def test_a_step_is_the_collision_by_its_definition(omega):
    lattice = Lattice(48, 40, shear_rate=omega, stream=(0.05, -0.02), fringe=1)
    lattice.populations[:] += rng().normal(scale=3e-3, size=lattice.populations.shape)
    lattice.force[:] = rng().normal(scale=3e-3, size=lattice.force.shape)
    expected = one_step(lattice.populations, lattice.shear_rate, lattice.force.astype(float))
    lattice.step()
    inside = np.s_[:, 1:-1, 1:-1]
    np.testing.assert_allclose(lattice.populations[inside], expected[inside], rtol=0, atol=ULP)


def test_a_uniform_stream_stays():
    lattice = Lattice(80, 64, shear_rate=1.95, stream=(-0.11, 0.07), fringe=16)
    before = lattice.populations.copy()
    stream = np.array(lattice.stream, dtype=float)
    np.testing.assert_allclose(before, equilibrium(np.ones((64, 80)), *stream), rtol=0, atol=ULP / 8)
    for k in range(300):
        lattice.step((k % 3 - 1, k % 2))
    np.testing.assert_allclose(lattice.populations, before, rtol=0, atol=ULP / 4)
    moments = lattice.moments(2)
    np.testing.assert_allclose(moments.velocity[0], stream[0], rtol=0, atol=ULP)
    np.testing.assert_allclose(moments.velocity[1], stream[1], rtol=0, atol=ULP)
    np.testing.assert_allclose(moments.density, 0, atol=ULP)


def decay(length, viscosity=0.05, steps=40):
    """Rate at which Taylor-Green vortices decay, over the exact 2 ν k², where the border is not felt.

    The first steps are left out: what a start from smooth fields lacks in fourth moments relaxes there.
    """
    lattice = Lattice(192, 192, shear_rate=shear_rate(viscosity), fringe=1)
    shape = taylor_green(lattice, length, 0.64 / length, viscosity)
    inside = np.s_[64:128, 64:128]
    amplitude = []
    for _ in range(2):
        for _ in range(steps):
            lattice.step()
        amplitude.append((lattice.moments().velocity[0] * shape)[inside].sum())
    return np.log(amplitude[0] / amplitude[1]) / (2 * viscosity * (2 * np.pi / length) ** 2 * steps)


def test_viscosity_and_its_order_of_convergence():
    coarse, fine = abs(decay(32) - 1), abs(decay(64) - 1)
    assert fine < 5e-3
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.2)


@pytest.mark.parametrize("stream", [(0.0, 0.0), (0.05, -0.02)])
def test_momentum_changes_by_the_force(stream):
    lattice = Lattice(96, 96, shear_rate=1.8, stream=stream, fringe=8)
    lattice.force[:, 40:56, 40:56] = rng().normal(scale=1e-4, size=(2, 16, 16)) + 2e-4
    lattice.force_rows = (40, 56)

    def momentum():
        return np.array([np.tensordot(c, lattice.populations, 1).sum(dtype=float) for c in (CX, CY)])

    before, steps = momentum(), 20  # waves have not reached the fringe, 32 cells away
    for _ in range(steps):
        lattice.step()
    given = steps * lattice.force.sum(axis=(1, 2), dtype=float)
    round_off = ULP * (np.hypot(*stream) * 96 * 96 * steps + np.abs(given))  # of what there is, in every step
    assert (np.abs(momentum() - before - given) < round_off).all()
    assert (round_off < 1e-3 * given).all()


def test_a_moving_window_sees_the_same_bits():
    """A vortex in a stream under a force, from a window at rest and from one that moves by whole cells."""
    rest, moving = (Lattice(112, 96, shear_rate=1.97, stream=(0.2, -0.1), fringe=4) for _ in range(2))
    x, y = grid(rest)
    r2 = ((x - 56) ** 2 + (y - 48) ** 2) / 64
    u, v = 0.2 - 0.02 * (y - 48) * np.exp(-r2), -0.1 + 0.02 * (x - 56) * np.exp(-r2)
    for lattice in (rest, moving):
        lattice.populations[:] = equilibrium(np.ones_like(u), u, v)
    left, up = 0, 0
    for k in range(16):
        shift = ((1, 0), (0, -1), (1, -1), (0, 1), (-1, 0), (1, -1), (0, 0))[k % 7]
        for lattice, i, j in ((rest, 60, 50), (moving, 60 - left, 50 - up)):
            lattice.force[:] = 0
            lattice.force[:, j : j + 3, i : i + 4] = 1e-3 * (1 + k)
            lattice.force_rows = (j, j + 3)
        rest.step()
        moving.step(shift)
        left, up = left + shift[0], up + shift[1]
    assert (left, up) == (5, -5)
    inside = rest.populations[:, 32:64, 36:76]  # one cell a step from the fringes of both
    there = moving.populations[:, 32 - up : 64 - up, 36 - left : 76 - left]
    assert inside.tobytes() == there.tobytes()
    assert np.abs(inside - rest.populations[:, :1, :1]).max() > 1e-3


@pytest.mark.parametrize("shift", [(1, 0), (-1, 1), (0, -1), (1, 1), (-1, -1)])
@pytest.mark.parametrize("steps", [0, 1])  # before: from either place in the memory
def test_a_shift_is_a_step_of_a_moved_copy_and_the_stream_comes_in(shift, steps):
    one, two = (Lattice(48, 40, shear_rate=1.5, stream=(0.1, 0.05), fringe=6) for _ in range(2))
    for lattice in [one, two] * steps:
        lattice.step()
    stream = one.populations[:, 0, 0].copy()
    one.populations[:, 1:-1, 1:-1] += rng().normal(scale=1e-3, size=(9, 38, 46))
    one.force[:] = rng().normal(scale=1e-3, size=one.force.shape)
    for lattice_array, old, empty in (
        (two.populations, one.populations, stream),
        (two.force, one.force, (0.0, 0.0)),
    ):
        for j in range(40):
            for i in range(48):
                x, y = i + shift[0], j + shift[1]
                inside = 0 < x < 47 and 0 < y < 39
                lattice_array[:, j, i] = old[:, y, x] if inside else empty
    one.step(shift)
    two.step()
    x, y = (np.arange(n) + s for n, s in zip((48, 40), shift, strict=True))
    whole = np.ix_(range(9), (y > 0) & (y < 39), (x > 0) & (x < 47))
    ours, theirs = one.populations[whole], two.populations[whole]
    assert ours.tobytes() == theirs.tobytes()
    outside = np.ones((40, 48), dtype=bool)
    outside[np.ix_((y > 0) & (y < 39), (x > 0) & (x < 47))] = False
    assert (one.populations[:, outside] == stream[:, None]).all()


@pytest.mark.parametrize(("nx", "ny", "fringe"), [(64, 48, 12), (44, 48, 18), (18, 20, 5), (76, 80, 34)])
def test_the_fringe_relaxes_by_the_stated_weights(nx, ny, fringe):
    """Also where both sides' fringes reach into the same sixteen columns, which are worked on together."""
    bare, fringed = (Lattice(nx, ny, shear_rate=1.9, stream=(0.1, 0.0), fringe=n) for n in (1, fringe))
    disturbed = bare.populations + rng().normal(scale=1e-3, size=bare.populations.shape)
    stream = bare.populations[:, :1, :1].astype(float)
    for lattice in (bare, fringed):
        lattice.populations[:] = disturbed
        lattice.step()

    def weights(n):
        layer = np.minimum(np.arange(n), np.arange(n)[::-1])
        return 0.3 * (np.maximum(fringe - layer, 0) / fringe) ** 3

    rest = (1 - weights(ny))[:, None] * (1 - weights(nx))[None, :]
    rest[[0, -1], :] = rest[:, [0, -1]] = 0
    expected = stream + rest * (bare.populations - stream)
    np.testing.assert_allclose(fringed.populations, expected, rtol=0, atol=ULP / 4)


def test_a_turbulent_field_at_a_high_reynolds_number_stays_finite():
    lattice = Lattice(128, 96, shear_rate=1.9999, stream=(0.08, 0.03), threads=2)
    smooth_noise(lattice, 0.05, rng())
    for k in range(2000):
        lattice.step((k % 12 == 0, 0))
    assert np.isfinite(lattice.populations).all()
    assert np.abs(lattice.moments().velocity).max() < 0.3


def wave(lattice, viscosity, steps):
    """Amplitude of a shear wave after some steps, far from the border."""
    x, _ = grid(lattice)
    k = 2 * np.pi / 32
    shape = np.sin(k * x)
    zero, ones = np.zeros(x.shape), np.ones(x.shape)
    gradients = (zero, zero, 0.02 * k * np.cos(k * x), zero)
    lattice.populations[:] = strained(ones, zero, 0.02 * shape, viscosity, gradients)
    for _ in range(steps):
        lattice.step()

    def amplitude():
        inside = np.s_[80:112, 80:112]
        return (lattice.moments().velocity[1] * shape)[inside].sum() / (shape[inside] ** 2).sum()

    return amplitude


@pytest.mark.parametrize("viscosity", [0.004, 0.4])
def test_half_the_step_keeps_flow_and_decay_in_physical_time(viscosity):
    """Shear of the stress itself: the first steps afterwards already decay at the physical rate."""
    lattice = Lattice(192, 192, shear_rate=shear_rate(viscosity), fringe=1)
    amplitude = wave(lattice, viscosity, 10)
    density = lattice.moments().density
    before = amplitude()
    lattice.halve_step(shear_rate(viscosity / 2))
    np.testing.assert_allclose(lattice.moments().density, density / 4, rtol=0, atol=2 * ULP)
    assert amplitude() == pytest.approx(before / 2, rel=1e-6)
    assert lattice.shear_rate == pytest.approx(
        4 * shear_rate(viscosity) / (2 + shear_rate(viscosity)), rel=1e-6
    )
    k2 = (2 * np.pi / 32) ** 2
    for steps in (2, 20):
        start = amplitude()
        for _ in range(steps):
            lattice.step()
        rate = np.log(start / amplitude()) / (viscosity / 2 * k2 * steps)
        assert rate == pytest.approx(1, abs=0.01)
