"""Coefficients from a table: what stands in its rows, between them, and on the rest of the circle."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from linkwind.aero.section import curves
from linkwind.native.forces import Coefficients, Plates, PlateTable
from linkwind.native.wind import WindTable
from linkwind.spatial import Motion, Wrench
from tests.aero.scenes import PLATE, model, wrench

RNG = np.random.default_rng(41)
DENSITY, CHORD, SPAN = 1.225, 0.4, 0.7
Q = 0.5 * DENSITY * CHORD * SPAN  # times V²: the unit of force
CALM = WindTable(np.zeros(3), np.zeros((0, 9)))
PLATELIKE = [
    [0, 0, 0.05, 0],
    [10, 0.8, 0.1, 0.01],
    [40, 1.1, 0.9, -0.2],
    [70, 0.5, 1.7, -0.4],
    [90, 0, 1.9, -0.475],
]
CAMBERED = [
    [-180, 0.1, 0.05, 0.02], [-90, -0.1, 2.0, 0.5], [-10, -0.5, 0.1, -0.04], [0, 0.3, 0.02, -0.05],
    [12, 1.4, 0.05, -0.06], [90, 0.1, 1.8, -0.4], [150, -0.7, 0.6, -0.3], [180, 0.1, 0.05, 0.02],
]  # fmt: skip


def coefficients(rows, alpha_deg, speed=2.0):
    """C_l, C_d and C_m about the middle of the chord, read from the wrench of one plate."""
    plates = Plates(
        PlateTable(
            np.zeros(1, dtype=np.int32), np.array([[CHORD, SPAN]]), Coefficients.TABLE, DENSITY, CALM, 1,
            curves(rows),
        )
    )  # fmt: skip
    found = []
    for alpha in np.radians(np.atleast_1d(alpha_deg)):
        motion, out = Motion.at_rest(1), Wrench.zeros(1, added_inertia=True)
        forward, up = np.cos(alpha), np.sin(alpha)  # at a positive angle of attack the plate comes down
        u, w = speed * forward, -speed * up
        motion.linear[0, :2] = u, w
        assert plates.evaluate(0.0, motion, out) == 0
        x, y, torque = *out.force[0, :2], out.torque[0, 2] + out.added_inertia[0, 1, 1] * u * w
        lift, drag = x * up + y * forward, -x * forward + y * up
        found.append([lift, drag, torque / CHORD])
    return np.array(found).T / (Q * speed**2)


def to_the_middle(rows):
    alpha, lift, drag, moment = np.array(rows, dtype=float).T
    turned = np.radians(alpha)
    return moment + 0.25 * (lift * np.cos(turned) + drag * np.sin(turned))


@pytest.mark.parametrize("rows", [PLATELIKE, CAMBERED])
def test_rows_are_what_they_say(rows):
    alpha, lift, drag, _ = np.array(rows, dtype=float).T
    found = coefficients(rows, alpha)
    np.testing.assert_allclose(found, [lift, drag, to_the_middle(rows)], rtol=0, atol=1e-14)


@pytest.mark.parametrize("rows", [PLATELIKE, CAMBERED])
def test_between_rows_is_a_monotone_cubic_all_around(rows):
    """As scipy's PCHIP through three turns of the table."""
    alpha, lift, drag, _ = np.array(rows, dtype=float).T
    each = np.array([lift, drag, to_the_middle(rows)])
    if alpha[0] == 0.0:  # both mirror images, written out
        sign = np.array([[-1.0], [1.0], [-1.0]])
        alpha, each = np.append(alpha, 180 - alpha[-2::-1]), np.hstack([each, sign * each[:, -2::-1]])
        alpha, each = np.append(-alpha[:0:-1], alpha), np.hstack([sign * each[:, :0:-1], each])
    turns = np.concatenate([alpha[:-1] + 360 * k for k in (-1, 0, 1)])
    at = np.linspace(-179.9, 179.9, 977)
    expected = PchipInterpolator(turns, np.tile(each[:, :-1], 3), axis=1)(at)
    np.testing.assert_allclose(coefficients(rows, at), expected, rtol=0, atol=1e-12)


def test_nothing_jumps_where_the_circle_closes():
    below, above = coefficients(CAMBERED, [180 - 1e-9, -180 + 1e-9]).T
    np.testing.assert_allclose(below, above, rtol=0, atol=1e-9)


def test_symmetries_are_those_of_the_section():
    """Up and down for a table from 0 to 180; front and rear as well for one from 0 to 90."""
    alpha = np.linspace(1, 89, 45)
    lift, drag, moment = coefficients(PLATELIKE, alpha)
    for mirrored in (-alpha, 180 - alpha):
        found = coefficients(PLATELIKE, mirrored)
        np.testing.assert_allclose(found, [-lift, drag, -moment], rtol=0, atol=1e-13)
    profile = [
        [0, 0, 0.01, 0],
        [15, 1.2, 0.1, 0.0],
        [90, 0.1, 1.8, -0.4],
        [165, -0.6, 0.2, 0.3],
        [180, 0, 0.02, 0],
    ]
    lift, drag, moment = coefficients(profile, np.append(alpha, 180 - alpha))
    found = coefficients(profile, np.append(-alpha, alpha - 180))
    np.testing.assert_allclose(found, [-lift, drag, -moment], rtol=0, atol=1e-13)


def test_the_moment_is_about_the_quarter_chord():
    """Without one there the normal force acts a quarter of the chord ahead of the middle."""
    rows = [[a, cl, cd, 0 if a < 90 else -cd / 4] for a, cl, cd, _ in PLATELIKE]
    lift, drag, moment = coefficients(rows, 40.0)[:, 0]
    normal = lift * np.cos(np.radians(40)) + drag * np.sin(np.radians(40))
    assert moment == pytest.approx(normal / 4, rel=1e-13)
    assert moment > 0.0  # nose up


def test_a_fine_table_of_the_flat_plate_is_the_flat_plate():
    """The coefficients of Li et al. 2022, written out here; errors go with the rows' distance squared."""

    def rows(n):
        degrees = np.linspace(0, 90, n)
        a = np.radians(degrees)
        f = 0.5 * (1 - np.tanh((degrees - 14) / 6))
        lift = f * 5.2 * np.sin(a) + (1 - f) * 0.95 * np.sin(2 * a)
        drag = f * (0.1 + 5.0 * np.sin(a) ** 2) + (1 - f) * 1.9 * np.sin(a) ** 2
        centre = f * (0.3 - 3.5 * a**2) + (1 - f) * 0.2 * (1 - 2 * a / np.pi)
        moment = (centre - 0.25) * (lift * np.cos(a) + drag * np.sin(a))
        lift[-1], moment[-1] = 0.0, -0.25 * drag[-1]
        return np.column_stack([degrees, lift, drag, moment]).tolist()

    plate, errors = model(PLATE), []
    motions = [Motion.at_rest(1) for _ in range(100)]
    for motion in motions:
        motion.linear[0, :2] = RNG.normal(size=2)
    for n in (91, 181, 901):
        other = model(PLATE, "aero.plate.coefficients=table", f"aero.plate.table={rows(n)}")
        pairs = [(wrench(plate, motion), wrench(other, motion)) for motion in motions]
        errors.append(
            max(np.abs([one.force - two.force, one.torque - two.torque]).max() for one, two in pairs)
        )
    assert errors[2] < 2e-5 * Q
    assert errors[0] / errors[2] > 100.0


@pytest.mark.parametrize("speed", [0.0, 1e-300, 1e-160])
def test_the_smallest_speeds_are_harmless(speed):
    motion = Motion.at_rest(1)
    motion.linear[0, :2] = -speed, -0.3 * speed
    text = f"aero.plate.table={PLATELIKE}"
    out = wrench(model(PLATE, "aero.plate.coefficients=table", text), motion)
    assert np.abs(out.force).max() <= 10 * Q * speed**2
    assert np.abs(out.torque).max() <= 10 * Q * speed**2
