"""The binding of the lattice in space: the same bits everywhere, views, moments, states, refusals."""

import numpy as np
import pytest

from linkwind.native import lattice3 as module
from linkwind.native.fluid import shear_rate
from linkwind.native.lattice3 import Lattice3
from tests.native.builds import BUILDS, compiled, use
from tests.native.flows3 import C, smooth_noise


def run(threads=1, size=(50, 43, 40)):
    """A flow that uses everything: force, shift, fringe, a width that is no whole number of vectors."""
    lattice = Lattice3(*size, shear_rate=1.98, stream=(0.1, -0.05, 0.02), fringe=7, threads=threads)
    smooth_noise(lattice, 0.05, np.random.default_rng(4))
    lattice.force[:, 15:25, 10:20] = np.random.default_rng(5).normal(scale=1e-3, size=(3, 10, 10, size[0]))
    lattice.forced[15:25, 10:20] = 1
    for k in range(20):
        lattice.step((k % 5 == 0, -(k % 3 == 0), (k % 7 == 0) - (k % 4 == 0)))
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
    one, two = (Lattice3(40, 32, 30, shear_rate=1.9, stream=(0.1, 0.0, 0.0), fringe=8) for _ in range(2))
    two.forced[:] = 1
    for lattice in (one, two):
        smooth_noise(lattice, 0.05, np.random.default_rng(6))
        for _ in range(20):
            lattice.step()
    assert one.state == two.state


def test_force_outside_its_rows_is_not_read():
    lattice = Lattice3(40, 32, 30, shear_rate=1.9, fringe=8)
    lattice.force[:] = np.nan
    lattice.force[:, 20, 10] = 0
    lattice.forced[20, 10] = 1
    lattice.step((1, 0, -1))
    assert not lattice.populations.any()  # a fluid at rest is exactly zero


def test_moments_are_means_over_blocks():
    lattice = Lattice3(31, 26, 22, shear_rate=1.5, stream=(0.1, 0.0, 0.05), fringe=1)
    smooth_noise(lattice, 0.05, np.random.default_rng(8))
    lattice.populations[:] += np.random.default_rng(9).normal(scale=1e-3, size=lattice.populations.shape)
    f = lattice.populations[:, :21, :24, :30].astype(float)
    sums = np.array([f.sum(0), *np.tensordot(C.T, f, 1)])
    density, *momentum = sums.reshape(4, 7, 3, 8, 3, 10, 3).mean(axis=(2, 4, 6))
    picture = lattice.moments(3)
    np.testing.assert_allclose(picture.density, density, rtol=0, atol=1e-9)
    np.testing.assert_allclose(picture.velocity, np.array(momentum) / (1 + density), rtol=0, atol=1e-8)


@pytest.mark.parametrize("threads", [1, 2])
def test_populations_are_a_view_of_where_they_are(threads):
    lattice = Lattice3(40, 32, 30, shear_rate=1.9, fringe=8, threads=threads)
    for _ in range(3):
        lattice.populations[:, 12:18, 12:18, 12:18] += 1e-3
        before = lattice.populations
        lattice.step()
        assert before.ctypes.data != lattice.populations.ctypes.data
        assert np.abs(lattice.populations[:, 9:21, 9:21, 9:21]).max() > 5e-4


def test_a_state_put_back_gives_the_same_future():
    lattice = Lattice3(40, 32, 30, shear_rate=1.9, stream=(0.1, 0.0, 0.0), fringe=8)
    smooth_noise(lattice, 0.05, np.random.default_rng(7))
    lattice.step()
    state = lattice.state
    lattice.step()
    future = lattice.state
    lattice.halve_step(1.95)
    assert lattice.stream == pytest.approx((0.05, 0.0, 0.0))
    lattice.state = state
    assert lattice.state == state
    assert lattice.stream == (np.float32(0.1), 0.0, 0.0)
    lattice.step()
    assert lattice.state == future
    with pytest.raises(ValueError, match=r"state: expected \d+ bytes; got 16"):
        lattice.state = state[:16]


GOOD = {
    "nx": 48,
    "ny": 40,
    "nz": 40,
    "shear_rate": 1.9,
    "stream": (0.1, 0.0, 0.0),
    "fringe": 16,
    "threads": 1,
}


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("nx", 39, "nx: expected at least .* = 40 cells; got 39"),
        ("ny", 39, "ny: expected at least .* = 40 cells; got 39"),
        ("nz", 39, "nz: expected at least .* = 40 cells; got 39"),
        ("fringe", 0, "fringe: expected 1 or more"),
        ("shear_rate", 0.0, "shear_rate: expected"),
        ("shear_rate", shear_rate(1e-9), "shear_rate: expected"),  # 2 in single precision
        ("shear_rate", float("nan"), "shear_rate: expected"),
        ("stream", (0.2, 0.2, 0.2), "stream: expected at most 0.3"),
        ("stream", (float("nan"), 0.0, 0.0), "stream: expected at most 0.3"),
        ("threads", 0, "threads: expected 1 or more"),
    ],
)
def test_arguments_out_of_range_are_refused(argument, value, message):
    with pytest.raises(ValueError, match=message):
        Lattice3(**GOOD | {argument: value})


def test_calls_out_of_range_are_refused_and_change_nothing():
    lattice = Lattice3(**GOOD | {"shear_rate": 1.0})
    state = lattice.state
    with pytest.raises(ValueError, match="other than 1"):
        lattice.halve_step(4 / 3)
    with pytest.raises(ValueError, match="shear_rate: expected"):
        lattice.halve_step(2.0)
    with pytest.raises(ValueError, match=r"stride: expected 1 … 20"):
        lattice.moments(21)
    with pytest.raises(ValueError, match="shift: expected -1, 0 or 1 cells"):
        lattice.step((0, 0, 2))
    assert lattice.state == state
