"""Means over a range of time: those of curves whose integrals are known."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import linkwind
from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.log.means import means
from tests.log.sample import record

T = np.arange(1001) * 1e-3


def test_a_beat_of_a_square_of_a_sine_has_half_its_peak():
    """The trapezoidal rule is exact over whole periods of a sum of few sines."""
    force = 3.0 + 2.0 * np.sin(2 * np.pi * 5 * T) ** 2 + 40.0 * (T < 0.2)  # after a start
    found = means({"step": T, "t [s]": T, "F [N]": force}, 0.4, 0.8, "log")
    assert found == {"F [N]": pytest.approx(4.0, abs=1e-12)}


@pytest.mark.parametrize(("begin", "end"), [(0.0, 1.0), (0.1003, 0.7008), (0.5001, 0.5002), (0.25, 0.5)])
def test_ends_between_rows_are_met(begin, end):
    """Of a straight line the mean is the value in the middle of the range."""
    found = means({"t [s]": T, "v": 5.0 - 8.0 * T}, begin, end, "log")
    assert found["v"] == pytest.approx(5.0 - 4.0 * (begin + end), abs=1e-12)


def test_without_a_range_it_is_that_of_the_table():
    columns = {"t [s]": T, "a": 3.0 * T**2}
    assert means(columns, None, None, "log") == means(columns, 0.0, 1.0, "log")
    assert means(columns, 0.4, None, "log") == means(columns, 0.4, 1.0, "log")


def test_a_value_that_is_missing_makes_no_number():
    values = np.where(T == 0.5, np.nan, 1.0)
    assert np.isnan(means({"t [s]": T, "a": values}, 0.4, 0.6, "log")["a"])
    assert means({"t [s]": T, "a": values}, 0.6, 0.8, "log")["a"] == pytest.approx(1.0)


@pytest.mark.parametrize(("begin", "end"), [(0.5, 0.5), (0.6, 0.5), (-0.1, 0.5), (0.5, 1.1), (np.nan, 1.0)])
def test_what_is_no_range_of_the_log_is_refused(begin, end):
    with pytest.raises(InputError, match="flight: expected a range of time within 0 to 1 s"):
        means({"t [s]": T, "a": T}, begin, end, "flight")


def test_the_command_prints_what_the_function_returns(tmp_path):
    states, _ = record(tmp_path / "log.mcap", 5)
    found = linkwind.means(tmp_path / "log.mcap", 0.001, 0.003)
    ys = [state.scalars["kinetic_energy"] for state in states]
    assert found["kinetic_energy [J]"] == pytest.approx((ys[1] / 2 + ys[2] + ys[3] / 2) / 2)
    arguments = ["log", "means", str(tmp_path / "log.mcap"), "--from", "0.001", "--to", "0.003"]
    shown = CliRunner().invoke(app, [*arguments, "--json"])
    assert json.loads(shown.stdout) == found
    lines = dict(
        line.split(maxsplit=1)[::-1] for line in CliRunner().invoke(app, arguments).stdout.splitlines()
    )
    assert lines.keys() == found.keys()
    assert float(lines["joint_gap [m]"]) == pytest.approx(found["joint_gap [m]"], rel=1e-5)
    steps = CliRunner().invoke(app, [*arguments, "--table", "steps", "--json"])
    assert json.loads(steps.stdout)["interface_energy [J]"] == pytest.approx(-0.5)  # -0.25 k
    assert json.loads(steps.stdout)["extrapolation_error.3"] is None  # not measured
