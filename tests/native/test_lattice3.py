"""The fluid in space against exact solutions, balances, that in a plane, and its collision by definition."""

import numpy as np
import pytest

from linkwind.native.fluid import shear_rate
from linkwind.native.lattice import Lattice
from linkwind.native.lattice3 import Lattice3
from tests.native import flows
from tests.native.flows3 import (
    WEIGHTS,
    equilibrium,
    grid,
    momentum,
    one_step,
    smooth_noise,
    strained,
    wrap,
)

ULP = 2.0**-24  # round-off of a float near 1
INSIDE = np.s_[..., 1:-1, 1:-1, 1:-1]


def rng():
    return np.random.default_rng(9)


@pytest.mark.parametrize("omega", [0.6, 1.0, 1.9])
def test_a_step_is_the_collision_by_its_definition(omega):
    lattice = Lattice3(20, 18, 16, shear_rate=omega, stream=(0.05, -0.02, 0.03), fringe=1)
    lattice.populations[:] += rng().normal(scale=3e-3, size=lattice.populations.shape)
    lattice.force[:] = rng().normal(scale=3e-3, size=lattice.force.shape)
    lattice.forced[:] = 1
    expected = one_step(lattice.populations, lattice.shear_rate, lattice.force.astype(float))
    lattice.step()
    np.testing.assert_allclose(lattice.populations[INSIDE], expected[INSIDE], rtol=0, atol=ULP)


def test_populations_at_rest_are_the_weights_and_kept_less_them():
    assert not Lattice3(16, 12, 11, shear_rate=1.5, fringe=1).populations.any()
    zero = np.zeros((3, 4, 4, 4))
    at_rest = one_step(np.zeros((19, 4, 4, 4)), 1.0, zero) + WEIGHTS[:, None, None, None]
    assert WEIGHTS.sum() == pytest.approx(1)
    np.testing.assert_allclose(at_rest[:, 0, 0, 0], WEIGHTS, rtol=0, atol=1e-15)


def test_a_uniform_stream_stays():
    lattice = Lattice3(48, 41, 40, shear_rate=1.95, stream=(-0.11, 0.07, 0.05), fringe=12)
    before = lattice.populations.copy()
    stream = np.array(lattice.stream, dtype=float)
    np.testing.assert_allclose(before, equilibrium(np.ones((40, 41, 48)), stream), rtol=0, atol=ULP / 8)
    for k in range(100):
        lattice.step((k % 3 - 1, k % 2, -(k % 2)))
    np.testing.assert_allclose(lattice.populations, before, rtol=0, atol=ULP / 2)
    moments = lattice.moments(2)
    for a in range(3):
        np.testing.assert_allclose(moments.velocity[a], stream[a], rtol=0, atol=ULP)
    np.testing.assert_allclose(moments.density, 0, atol=ULP)


WAVES = {  # wave numbers of the period, direction of the velocity
    "y along x": ((1, 0, 0), (0, 1, 0)),
    "z along y": ((0, 1, 0), (0, 0, 1)),
    "x along z": ((0, 0, 1), (1, 0, 0)),
    "oblique in a plane": ((1, 1, 0), (1, -1, 0)),
    "oblique in space": ((1, 1, 1), (1, 1, -2)),
}


def shear_wave(lattice, name, period, viscosity, speed=0.02):
    """Fill a lattice with a shear wave; return its shape, square to which nothing moves, and |k|²."""
    numbers, along = map(np.array, WAVES[name])
    k, along = 2 * np.pi / period * numbers, along / np.linalg.norm(along)
    phase = np.tensordot(k, grid(lattice), 1)
    shape = np.multiply.outer(along, np.sin(phase))
    gradients = speed * np.multiply.outer(np.multiply.outer(along, k), np.cos(phase))
    lattice.populations[:] = strained(np.ones(phase.shape), speed * shape, viscosity, gradients)
    return shape, k @ k


def amplitude(lattice, shape):
    """Part of a shape in the velocity, within the period."""
    return (lattice.moments().velocity * shape)[INSIDE].sum() / (shape[INSIDE] ** 2).sum()


def decay(name, period, steps=40):
    """Rate at which a shear wave decays, over the exact ν k²."""
    viscosity = 0.02
    sizes = [period + 2 if n else 10 for n in WAVES[name][0]]
    lattice = Lattice3(*sizes, shear_rate=shear_rate(viscosity), fringe=1)
    shape, k2 = shear_wave(lattice, name, period, viscosity)
    amplitudes = []
    for _ in range(2):  # what a start from smooth fields lacks in fourth moments relaxes in the first steps
        for _ in range(steps):
            wrap(lattice)
            lattice.step()
        amplitudes.append(amplitude(lattice, shape))
    return np.log(amplitudes[0] / amplitudes[1]) / (viscosity * k2 * steps)


@pytest.mark.parametrize("name", WAVES)
def test_viscosity_from_the_decay_of_a_shear_wave(name):
    assert decay(name, 72) == pytest.approx(1, abs=5e-3)


def test_viscosity_is_of_second_order():
    coarse, fine = (abs(decay("x along z", period) - 1) for period in (32, 64))
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.2)


@pytest.mark.parametrize("stream", [(0.0, 0.0, 0.0), (0.05, -0.02, 0.03)])
def test_momentum_changes_by_the_force(stream):
    lattice = Lattice3(32, 30, 28, shear_rate=1.8, stream=stream, fringe=1)
    lattice.force[:, 10:18, 11:19, 12:20] = rng().normal(scale=1e-4, size=(3, 8, 8, 8)) + 2e-4
    lattice.forced[10:18, 11:19] = 1
    before, steps = momentum(lattice.populations[INSIDE]), 40
    for _ in range(steps):
        wrap(lattice)
        lattice.step()
    given = steps * lattice.force.sum(axis=(1, 2, 3), dtype=float)
    round_off = ULP * (np.linalg.norm(stream) * 26 * 28 * 30 * steps + np.abs(given))
    assert (np.abs(momentum(lattice.populations[INSIDE]) - before - given) < round_off).all()
    assert (round_off < 1e-3 * given).all()


def test_a_moving_window_sees_the_same_bits():
    """Waves in a stream under a force, from a window at rest and from one that moves by whole cells."""
    stream = (0.15, -0.1, 0.05)
    rest, moving = (Lattice3(64, 58, 52, shear_rate=1.97, stream=stream, fringe=2) for _ in range(2))
    for lattice in (rest, moving):
        smooth_noise(lattice, 0.03, rng())
    shifts = [(1, 0, 0), (0, -1, 1), (1, -1, 0), (0, 1, -1), (-1, 0, 1), (1, -1, 1), (1, 1, 1)]
    moved = np.zeros(3, dtype=int)
    for n, shift in enumerate(shifts):
        for lattice, off in ((rest, (0, 0, 0)), (moving, moved)):
            i, j, k = np.array((31, 28, 25)) - off
            lattice.force[:], lattice.forced[:] = 0, 0
            lattice.force[:, k : k + 3, j : j + 3, i : i + 4] = 1e-3 * (1 + n)
            lattice.forced[k : k + 3, j : j + 3] = 1
        rest.step()
        moving.step(shift)
        moved += shift
    x, y, z = moved
    assert (x, y, z) == (3, -1, 3)
    inside = rest.populations[:, 16:36, 16:42, 16:48]  # one cell a step from the fringes of both
    there = moving.populations[:, 16 - z : 36 - z, 16 - y : 42 - y, 16 - x : 48 - x]
    assert inside.tobytes() == there.tobytes()
    assert np.abs(inside - rest.populations[:, :1, :1, :1]).max() > 1e-3


@pytest.mark.parametrize("shift", [(1, 0, 0), (-1, 1, 0), (0, -1, 1), (1, 1, 1), (-1, -1, -1), (0, 0, -1)])
@pytest.mark.parametrize("steps", [0, 1])  # before: from either place in the memory
def test_a_shift_is_a_step_of_a_moved_copy_and_the_stream_comes_in(shift, steps):
    sizes = (36, 22, 21)
    one, two = (Lattice3(*sizes, shear_rate=1.5, stream=(0.1, 0.05, -0.02), fringe=6) for _ in range(2))
    for lattice in [one, two] * steps:
        lattice.step()
    stream = one.populations[:, :1, :1, :1].copy()
    inner = one.populations[INSIDE]
    inner += rng().normal(scale=1e-3, size=inner.shape)
    one.force[:] = rng().normal(scale=1e-3, size=one.force.shape)
    one.forced[:], two.forced[:] = 1, 1
    at = [np.arange(n) + s for n, s in zip(sizes, shift, strict=True)]
    known = [(a > 0) & (a < n - 1) for a, n in zip(at, sizes, strict=True)]
    inside = known[2][:, None, None] & known[1][:, None] & known[0]
    clipped = (np.clip(a, 0, n - 1) for a, n in zip(at, sizes, strict=True))
    source = np.ix_(*list(clipped)[::-1])
    two.populations[:] = np.where(inside, one.populations[:, *source], stream)
    two.force[:] = np.where(inside, one.force[:, *source], 0)
    one.step(shift)
    two.step()
    assert one.populations[:, inside].tobytes() == two.populations[:, inside].tobytes()
    assert (one.populations[:, ~inside] == stream[:, 0, 0]).all()


@pytest.mark.parametrize(("sizes", "fringe"), [((40, 34, 33), 12), ((20, 21, 22), 6)])
def test_the_fringe_relaxes_by_the_stated_weights(sizes, fringe):
    bare, fringed = (Lattice3(*sizes, shear_rate=1.9, stream=(0.1, 0.0, 0.0), fringe=n) for n in (1, fringe))
    disturbed = bare.populations + rng().normal(scale=1e-3, size=bare.populations.shape)
    stream = bare.populations[:, :1, :1, :1].astype(float)
    for lattice in (bare, fringed):
        lattice.populations[:] = disturbed
        lattice.step()
    x, y, z = (1 - 0.3 * (np.maximum(fringe - _layer(n), 0) / fringe) ** 3 for n in sizes)
    rest = np.zeros(sizes[::-1])
    rest[INSIDE] = (z[:, None, None] * y[:, None] * x)[INSIDE]
    expected = stream + rest * (bare.populations - stream)
    np.testing.assert_allclose(fringed.populations, expected, rtol=0, atol=ULP / 4)


def _layer(n):
    return np.minimum(np.arange(n), np.arange(n)[::-1])


def test_the_fringe_absorbs_a_pulse_of_sound():
    """The share of its energy that is left when it would have come back to the middle."""
    left = {}
    for fringe in (1, 12):
        lattice = Lattice3(64, 64, 64, shear_rate=shear_rate(1e-3), fringe=fringe)
        r2 = ((grid(lattice) - 31.5) ** 2).sum(0)
        lattice.populations[:] = equilibrium(1 + 0.01 * np.exp(-r2 / 18), np.zeros((3, *r2.shape)))
        before = _sound(lattice)
        for _ in range(120):  # 63 cells at 0.577 a step: 109 steps
            lattice.step()
        left[fringe] = _sound(lattice) / before
    assert left[12] < 1e-3
    assert left[12] < left[1] / 5


def _sound(lattice):
    """Energy of sound, twice that of its velocity and of its pressure ρ'/3 where ρ is 1."""
    picture = lattice.moments()
    return (picture.density.astype(float) ** 2 / 3).sum() + (picture.velocity.astype(float) ** 2).sum()


def test_a_flow_uniform_along_z_is_the_flow_in_the_plane():
    period, viscosity = 48, 0.01
    plane = Lattice(period + 2, period + 2, shear_rate=shear_rate(viscosity), fringe=1)
    space = Lattice3(period + 2, period + 2, 10, shear_rate=shear_rate(viscosity), fringe=1)
    x, y = flows.grid(plane)
    k = 2 * np.pi / period
    u = 0.05 * np.sin(k * y) + 0.03 * np.sin(2 * k * (x + y) + 1)  # the second wave has no divergence either
    v = 0.04 * np.sin(k * x + 2) - 0.03 * np.sin(2 * k * (x + y) + 1)
    plane.populations[:] = flows.equilibrium(np.ones(x.shape), u, v)
    space.populations[:] = equilibrium(np.ones(x.shape), (u, v, 0 * u))[:, None]
    f = plane.populations
    for _ in range(400):
        f = plane.populations
        f[..., 0], f[..., -1] = f[..., -2], f[..., 1]
        f[:, 0], f[:, -1] = f[:, -2], f[:, 1]
        wrap(space)
        plane.step()
        space.step()
    ours, theirs = space.moments().velocity[:, 1:-1, 1:-1, 1:-1], plane.moments().velocity[:, 1:-1, 1:-1]
    changed = np.abs(theirs - np.array([u, v])[:, 1:-1, 1:-1]).max()
    assert changed > 0.03
    assert np.abs(ours[:2] - theirs[:, None]).max() < 0.02 * changed  # sound is damped in another way
    assert np.abs(ours[2]).max() < 1e-6


def test_taylor_green_vortices_at_a_high_reynolds_number_stay_finite_and_lose_energy():
    period = 48
    lattice = Lattice3(*[period + 2] * 3, shear_rate=1.9999, fringe=1, threads=2)
    x, y, z = 2 * np.pi / period * grid(lattice)
    speed = 0.06
    u = speed * np.array([np.sin(x) * np.cos(y) * np.cos(z), -np.cos(x) * np.sin(y) * np.cos(z), 0 * x])
    pressure = speed**2 / 16 * (np.cos(2 * x) + np.cos(2 * y)) * (np.cos(2 * z) + 2)
    lattice.populations[:] = equilibrium(1 + 3 * pressure, u)
    energy = []
    for k in range(2001):  # two and a half turns of a vortex; it breaks down to the size of the cells
        if k % 400 == 0:
            energy.append((lattice.moments().velocity[INSIDE].astype(float) ** 2).sum())
        wrap(lattice)
        lattice.step()
    assert np.isfinite(lattice.populations).all()
    assert (np.diff(energy) < 0).all()
    assert energy[-1] < 0.7 * energy[0]


@pytest.mark.parametrize("viscosity", [1e-2, 1e-3, 1e-5])
def test_noise_in_a_fluid_at_rest_dies_away(viscosity):
    """Nothing feeds it, whatever its waves are, down to those of two cells."""
    period = 32
    lattice = Lattice3(*[period + 2] * 3, shear_rate=shear_rate(viscosity), fringe=1, threads=2)
    lattice.populations[:] = rng().normal(scale=1e-5, size=lattice.populations.shape)
    energy = []
    for k in range(1501):
        if k % 500 == 1:
            energy.append((lattice.moments().velocity[INSIDE].astype(float) ** 2).sum())
        wrap(lattice)
        lattice.step()
    assert (np.diff(energy) < 0).all()


@pytest.mark.parametrize("viscosity", [0.004, 0.4])
@pytest.mark.parametrize("name", ["y along x", "oblique in a plane"])
def test_half_the_step_keeps_flow_and_decay_in_physical_time(viscosity, name):
    """Shear of the stress itself: the first steps afterwards already decay at the physical rate."""
    period = 48
    sizes = [period + 2 if n else 10 for n in WAVES[name][0]]
    lattice = Lattice3(*sizes, shear_rate=shear_rate(viscosity), stream=(0.1, 0.0, 0.0), fringe=1)
    shape, k2 = shear_wave(lattice, name, period, viscosity, 0.01)  # faster: errors of third order in it

    def go_on(steps):
        for _ in range(steps):
            wrap(lattice)
            lattice.step()

    go_on(10)
    density, before = lattice.moments().density, amplitude(lattice, shape)
    lattice.halve_step(shear_rate(viscosity / 2))
    np.testing.assert_allclose(lattice.moments().density, density / 4, rtol=0, atol=2 * ULP)
    assert amplitude(lattice, shape) == pytest.approx(before / 2, rel=1e-6)
    old = shear_rate(viscosity)
    assert lattice.shear_rate == pytest.approx(4 * old / (2 + old), rel=1e-6)
    assert lattice.stream == pytest.approx((0.05, 0.0, 0.0))
    for steps in (2, 20):
        start = amplitude(lattice, shape)
        go_on(steps)
        rate = np.log(start / amplitude(lattice, shape)) / (viscosity / 2 * k2 * steps)
        assert rate == pytest.approx(1, abs=0.01)
