"""What ``linkwind validate`` makes of its rows, and its cheap cases; CI runs the short form of all."""

import json
import math

import numpy as np
import pytest
from scipy.special import ellipj, ellipk, hankel2, jv, kv
from typer.testing import CliRunner

from linkwind.cli import app
from linkwind.errors import InputError
from linkwind.runs.validate import COUPLING, FLOW, MULTIBODY, VORTEX, page
from linkwind.runs.validate.multibody import elliptic
from linkwind.runs.validate.rows import Findings, Row, most, near
from linkwind.runs.validate.space import wing
from linkwind.runs.validate.vortex import exact, flutter, surface


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


@pytest.mark.parametrize("name", ["impulse balance in space", "carried by the stream in space"])
def test_flow_in_space(name):
    (found,) = FLOW.run(True, (name,))
    assert found.rows
    for row in found.rows:
        assert row.ok, row


@pytest.mark.parametrize("name", COUPLING.cases)
def test_coupling(name):
    (found,) = COUPLING.run(True, (name,))
    assert found.rows
    for row in found.rows:
        assert row.ok, row


@pytest.mark.parametrize("name", VORTEX.cases)
def test_vortex(name):
    (found,) = VORTEX.run(True, (name,))
    assert found.rows
    for row in found.rows:
        assert row.ok is not False, row


def test_sections_are_those_of_scipy_s_functions():
    k = np.array([0.01, 0.2, 1.0, 5.0, 20.0])
    for order in (0, 1):
        for z in (k, 1j * k, (1.0 + 2.0j) * k):
            assert exact.bessel_k(order, z) == pytest.approx(kv(order, z), rel=1e-14)
    deficiency = hankel2(1, k) / (hankel2(1, k) + 1j * hankel2(0, k))
    assert exact.theodorsen(k) == pytest.approx(deficiency, rel=1e-14)
    bent = deficiency * (jv(0, k) - 1j * jv(1, k)) + 1j * jv(1, k)
    assert exact.sears(k) == pytest.approx(bent, rel=1e-13)


def test_horseshoes_find_the_published_lift_of_a_square_wing():
    """1.4602 (E. O. Tuck 1993), in the first quarter of the chord."""
    lift, place = surface.swept(np.zeros(2), np.ones(2), 0.5)
    assert lift == pytest.approx(1.4602, rel=2e-3)
    assert 0.15 < place < 0.25


def test_sections_have_their_limits():
    slow = exact.loads(1e-4, 0.0, 0.02)  # a plate at rest: 2 pi, at the quarter of the chord, without drag
    assert slow.lift.real == pytest.approx(np.pi * 0.02, rel=1e-3)
    assert slow.moment.real == pytest.approx(0.25 * np.pi * 0.02, rel=1e-3)
    assert abs(slow.thrust) < 1e-3 * slow.lift.real * 0.02
    fast = exact.loads(1e4, 0.02, 0.0)  # its added mass
    assert fast.lift.real == pytest.approx(0.25 * np.pi * 0.02 * 4e8, rel=1e-3)
    start, *later = exact.wagner(np.array([1e-6, 8.0, 300.0]))
    assert start == pytest.approx(0.5, abs=1e-5)
    assert later[0] == pytest.approx(
        1.0 - 0.165 * np.exp(-0.364) - 0.335 * np.exp(-2.4), abs=0.01
    )  # R. T. Jones
    assert later[1] == pytest.approx(1.0 - 1.0 / 302.0, abs=1e-3)  # I. E. Garrick: 1 - 2/(4 + s), far on
    heave = np.exp(0.08j * np.arange(2048) * (2.0 * np.pi / 163.84))  # one wave: Sears' function itself
    lift = exact.gust_lift(heave.real, 0.08) / np.pi
    assert np.abs(lift).max() == pytest.approx(abs(exact.sears(np.array([np.pi / 163.84]))[0]), rel=1e-3)


def test_wings_are_tuck_s():
    for aspect, published in ((1.0, 1.4602), (2.0, 2.4744)):
        assert surface.wing(aspect)[0] == pytest.approx(published, abs=1e-4)
    slope, drag = surface.wing(0.1)
    assert slope == pytest.approx(0.5 * np.pi * 0.1, rel=0.01)  # R. T. Jones: slender, and an elliptic lift
    assert drag == pytest.approx(1.0, abs=1e-3)


def test_growth_is_that_of_a_known_sum():
    t = np.linspace(0.0, 60.0, 700)
    x = (
        np.exp(0.01 * t) * np.cos(0.93 * t + 1.0)
        + 2.0 * np.exp(-0.2 * t) * np.sin(0.4 * t)
        + 0.1 * np.exp(-0.5 * t)
    )
    assert flutter.growth(t, x) == pytest.approx(0.01 + 0.93j, abs=1e-6)


def test_a_section_in_little_fluid_swings_as_in_the_void():
    heavy = flutter.Section("", 1e6, -0.2, 0.5, 0.1, 0.6)
    frequencies = np.sqrt(np.linalg.eigvals(np.linalg.solve(heavy.inertia, np.diag(heavy.springs))))
    for frequency in frequencies.tolist():
        assert heavy.rate(1.0, 1j * frequency) == pytest.approx(1j * frequency, abs=1e-4)


def test_the_long_cylinder_is_as_hard_to_turn_as_its_fluid():
    """Else the model refuses it in its first step: at the whole case nobody looks often."""
    _, shape, angle = wing.LONG[1]
    t, force = wing._in_space(shape, angle, 10, (5.0, 5.0, 8.0), wing.SPANS[0])
    assert np.isfinite(force).all()
    assert force[t > 3.0, 0].mean() > 0.5 * 5.0  # ½ρU² on its front is half a newton a metre
