"""The lattice's binding: the same bits everywhere, views, moments, states, refusals."""

import numpy as np
import pytest

from linkwind.native import lattice as module
from linkwind.native.fluid import shear_rate
from linkwind.native.lattice import Lattice
from tests.native.builds import BUILDS, compiled, use
from tests.native.flows import CX, CY, smooth_noise, taylor_green


def run(threads=1, size=(100, 90), forced=True):
    """A flow that uses everything: force, shift, fringe, a width that is no whole number of vectors."""
    lattice = Lattice(*size, shear_rate=1.98, stream=(0.1, -0.05), fringe=10, threads=threads)
    smooth_noise(lattice, 0.05, np.random.default_rng(4))
    if forced:
        lattice.force[:, 30:50] = np.random.default_rng(5).normal(scale=1e-3, size=(2, 20, size[0]))
        lattice.force_rows = (30, 50)
    for k in range(40):
        lattice.step((k % 5 == 0, -(k % 3 == 0)))
    return lattice.populations.tobytes()


@pytest.mark.parametrize("threads", [2, 3, 7])
def test_bits_do_not_depend_on_the_number_of_threads(threads):
    assert run(threads) == run()


@pytest.mark.parametrize("name", BUILDS)
def test_bits_do_not_depend_on_instructions_and_compiler(name, monkeypatch):
    expected = run()
    use(monkeypatch, module, compiled(name))
    assert run() == expected


def test_rows_without_force_have_the_bits_of_a_force_of_zero():
    one, two = (Lattice(64, 56, shear_rate=1.9, stream=(0.1, 0.0), fringe=8) for _ in range(2))
    one.force_rows = (0, 0)
    for lattice in (one, two):
        smooth_noise(lattice, 0.05, np.random.default_rng(6))
        for _ in range(20):
            lattice.step()
    assert one.state == two.state


def test_force_outside_its_rows_is_not_read():
    lattice = Lattice(64, 56, shear_rate=1.9, fringe=8)
    lattice.force[:] = np.nan
    lattice.force_rows = (30, 30)
    lattice.step()
    assert not lattice.populations.any()  # a fluid at rest is exactly zero


def test_moments_are_means_over_blocks_and_vorticity_their_curl():
    lattice = Lattice(67, 61, shear_rate=1.5, fringe=1)
    taylor_green(lattice, 40, 0.05, shear_rate(1.5))
    f = lattice.populations[:, :60, :66].astype(float)
    jx, jy, density = (np.tensordot(c, f, 1) for c in (CX, CY, np.ones(9)))
    jx, jy, density = (a.reshape(20, 3, 22, 3).mean(axis=(1, 3)) for a in (jx, jy, density))
    picture = lattice.moments(3)
    np.testing.assert_allclose(picture.density, density, rtol=0, atol=1e-9)
    np.testing.assert_allclose(picture.velocity, np.array([jx, jy]) / (1 + density), rtol=0, atol=1e-8)
    y, x = np.mgrid[:20, :22] * 3 + 1  # the middles of the blocks
    k = 2 * np.pi / 40
    exact = -2 * 0.05 * k * np.cos(k * x) * np.cos(k * y)  # means and differences flatten it by some percent
    inside = np.s_[1:-1, 1:-1]
    np.testing.assert_allclose(picture.vorticity[inside], exact[inside], rtol=0, atol=0.06 * 0.1 * k)


@pytest.mark.parametrize("threads", [1, 2])
def test_populations_are_a_view_of_where_they_are(threads):
    lattice = Lattice(64, 56, shear_rate=1.9, fringe=8, threads=threads)
    for _ in range(3):
        lattice.populations[:, 20:30, 20:30] += 1e-3
        before = lattice.populations
        lattice.step()
        assert before.ctypes.data != lattice.populations.ctypes.data
        assert np.abs(lattice.populations[:, 15:35, 15:35]).max() > 5e-4


def test_a_state_put_back_gives_the_same_future():
    lattice = Lattice(64, 56, shear_rate=1.9, stream=(0.1, 0.0), fringe=8)
    smooth_noise(lattice, 0.05, np.random.default_rng(7))
    lattice.step()
    state = lattice.state
    lattice.step()
    future = lattice.state
    lattice.halve_step(1.95)
    assert lattice.stream == pytest.approx((0.05, 0.0))
    lattice.state = state
    assert lattice.state == state
    assert lattice.stream == (np.float32(0.1), 0.0)
    lattice.step()
    assert lattice.state == future
    with pytest.raises(ValueError, match=r"state: expected \d+ bytes; got 12"):
        lattice.state = state[:12]


GOOD = {"nx": 64, "ny": 64, "shear_rate": 1.9, "stream": (0.1, 0.0), "fringe": 24, "threads": 1}


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("nx", 55, "nx: expected at least .* = 56 cells; got 55"),
        ("ny", 55, "ny: expected at least .* = 56 cells; got 55"),
        ("fringe", 0, "fringe: expected 1 or more"),
        ("shear_rate", 0.0, "shear_rate: expected"),
        ("shear_rate", shear_rate(1e-9), "shear_rate: expected"),  # 2 in single precision
        ("shear_rate", float("nan"), "shear_rate: expected"),
        ("stream", (0.25, 0.25), "stream: expected at most 0.3"),
        ("stream", (float("nan"), 0.0), "stream: expected at most 0.3"),
        ("threads", 0, "threads: expected 1 or more"),
    ],
)
def test_arguments_out_of_range_are_refused(argument, value, message):
    with pytest.raises(ValueError, match=message):
        Lattice(**GOOD | {argument: value})


def test_calls_out_of_range_are_refused_and_change_nothing():
    lattice = Lattice(**GOOD | {"shear_rate": 1.0})
    state = lattice.state
    with pytest.raises(ValueError, match="other than 1"):
        lattice.halve_step(4 / 3)
    with pytest.raises(ValueError, match="shear_rate: expected"):
        lattice.halve_step(2.0)
    with pytest.raises(ValueError, match="force_rows: expected a range within 0 … 64"):
        lattice.force_rows = (3, 65)
    with pytest.raises(ValueError, match=r"stride: expected 1 … 32"):
        lattice.moments(33)
    with pytest.raises(ValueError, match="shift: expected -1, 0 or 1 cells"):
        lattice.step((0, 2))
    assert lattice.state == state
