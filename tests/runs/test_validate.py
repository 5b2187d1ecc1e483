"""What ``linkwind validate`` makes of its rows, and its cheap cases; CI runs the short form of all."""

import json
import math

import pytest
from scipy.special import ellipj, ellipk
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.runs.validate import COUPLING, MULTIBODY, page
from linkwind.runs.validate.multibody import elliptic
from linkwind.runs.validate.rows import Findings, Row, most, near


def test_rows_judge_and_are_plain(tmp_path):
    rows = [
        Row("a", "b [m]", 1.02, 1.0, 0.03, "x"),
        Row("a", "c", 1.04, 1.0, 0.03, "x"),
        most("a", "d", 0.1, 0.2),
    ]
    rows += Findings(
        [near("a", "e", 1e-9, 0.0, 2e-9, "x"), near("a", "e", 3e-9, 0.0, 2e-9, "x")], seconds=0.5
    ).rows
    assert [row.ok for row in rows] == [True, False, True, True, False]
    assert [row.seconds for row in rows] == [None, None, None, 0.5, 0.5]
    assert rows[3].error == 1e-9
    assert Row("a", "b", 2.0, 1.0, None, "x").ok is None
    assert json.loads(json.dumps(rows[0].as_json())).keys() >= {
        "case", "quantity", "value", "reference", "ratio", "ok", "error", "seconds"
    }  # fmt: skip
    page.write(tmp_path / "flow.html", "title", rows, [], "a remark")
    text = (tmp_path / "flow.html").read_text(encoding="utf-8")
    assert "1.02" in text
    assert "off" in text
    assert "a remark" in text
    assert "3 ok, 2 off" in text


def test_a_folder_that_cannot_be_is_told_before_the_cases(tmp_path):
    (tmp_path / "file").touch()
    for command in (["validate", "flow"], ["reproduce"]):
        done = CliRunner().invoke(app, [*command, "--out", str(tmp_path / "file" / "out")])
        assert isinstance(done.exception, InputError)
        assert "Choose another --out" in str(done.exception)


@pytest.mark.parametrize("m", [0.0, 0.3, 0.99])
def test_elliptic_functions_are_scipy_s(m):
    assert elliptic.quarter(m) == pytest.approx(ellipk(m), rel=1e-15)
    for u in (-7.3, 0.0, 0.4, 25.0):
        *expected, amplitude = ellipj(u, m)
        assert elliptic.jacobi(u, m) == pytest.approx(expected, abs=1e-13)
        assert math.remainder(elliptic.amplitude(u, m) - amplitude, 2.0 * math.pi) == pytest.approx(
            0.0, abs=1e-12
        )


CHEAP = (
    "equations of the paper",
    "simple pendulum",
    "bricard",
    "flyball governor",
    "andrews",
    "free rigid body",
    "joints cut",
)


@pytest.mark.parametrize("name", CHEAP)
def test_multibody(name):
    (found,) = MULTIBODY.run(True, (name,))
    assert found.rows
    for row in found.rows:
        assert row.ok, row


@pytest.mark.parametrize("name", COUPLING.cases)
def test_coupling(name):
    (found,) = COUPLING.run(True, (name,))
    assert found.rows
    for row in found.rows:
        assert row.ok, row
