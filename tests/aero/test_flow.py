"""The model flow against exact values and invariants; longer cases: ``linkwind validate flow``."""

import numpy as np
import pytest

from linkwind.errors import SimulationError
from linkwind.runs.validate import balance, free, plate
from linkwind.runs.validate.driven import motion
from linkwind.runs.validate.scenes import CIRCLE
from linkwind.spatial import Wrench
from tests.aero.flows import STEP, answer, driven, swing

ELLIPSE = '{ type = "ellipse", length = 1.0, width = 0.25 }'


@pytest.mark.parametrize(("axis", "exact"), [(1, plate.ADDED_MASS), (2, plate.ADDED_INERTIA)])
def test_added_mass_of_a_thin_plate(axis, exact):
    got = plate.accelerated(64, axis, side=8.0, steps=800)
    assert got == pytest.approx(exact, rel=0.03)


def test_added_mass_of_an_ellipse_less_what_is_inside():
    got = plate.accelerated(48, 1, shape=ELLIPSE, side=8.0, steps=700)
    assert got == pytest.approx(np.pi / 4, rel=0.06)


def test_force_on_a_circle_that_oscillates_in_a_viscous_fluid():
    assert all(row.ok for row in plate.stokes(short=True).rows)


def test_stokes_force_at_both_ends():
    assert plate.stokes_force(1e4) == pytest.approx((1.0, 0.0), abs=1e-3)  # without viscosity
    phase, _ = plate.stokes_force(1.0)  # λ = √i: tables of the Kelvin functions
    assert phase == pytest.approx(3.7, abs=1.0)


@pytest.mark.parametrize("ratio", free.RATIOS)
def test_a_light_plate_accelerates_by_its_mass_and_the_added_mass(ratio):
    flight = free.flown(free.light_plate(ratio, "pec", cells=32, steps=600))
    assert free.acceleration(flight) == pytest.approx(1e-6 / 32 / 1e-6, rel=0.03)
    gone = np.diff(flight.linear[250:, 0, 1])
    assert gone.std() < 0.2 * gone.mean()  # smoothly
    if ratio == 0.3:  # where the plain scheme blows up
        plain = free.flown(free.light_plate(ratio, "explicit", cells=32, steps=600), to_the_end=False)
        assert len(plain.t) < 600
        assert free.fastest(plain) > 100.0 * free.fastest(flight)


@pytest.mark.parametrize(("carried", "ratio"), [(0.2, 1.0), (0.9, 2.0)])  # two lattice steps in one, eight
def test_several_lattice_steps_in_one_hold_a_plate_of_that_mass_over_the_added_mass(carried, ratio):
    flight = free.flown(free.light_plate(ratio, "pec", cells=32, steps=400, carried=carried))
    assert free.acceleration(flight) == pytest.approx(1e-6 / 32 / 1e-6, rel=0.06)
    gone = np.diff(flight.linear[250:, 0, 1])
    assert gone.std() < 0.2 * gone.mean()
    light = free.light_plate(0.3 * ratio, "pec", cells=32, steps=400, carried=carried)
    assert free.fastest(free.flown(light, to_the_end=False)) > 100.0 * free.fastest(flight)  # too light


def test_impulse_is_kept():
    assert all(row.ok for row in balance.impulse(short=True).rows)


def test_only_the_motion_relative_to_the_fluid_counts():
    assert all(row.ok for row in balance.galilean(short=True).rows)


def test_no_force_on_bodies_that_move_with_the_stream():
    assert all(row.ok for row in balance.carried(short=True).rows)


def test_the_links_of_a_hinge_pull_each_other_alike():
    assert all(row.ok for row in free.hinged(short=True).rows)


def test_a_response_is_the_derivative_of_the_wrench():
    flow = driven()
    flow.go(swing, steps=20)
    wrench = _response(flow, 21 * STEP, 0.0)
    other = _response(flow, 21 * STEP, 0.01)
    for axis in range(3):
        entry = (0, 1, 5)[axis]
        changed = _wrench(other[axis]) - _wrench(wrench[axis])
        expected = -0.01 * wrench[axis].response[[0, 1, 5], entry]
        np.testing.assert_allclose(changed, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


def _response(flow, t, change):
    """Answers where one component after another of the twist is changed."""
    answers = []
    for axis in range(3):
        pose, twist = swing(t)
        twist = twist + change * np.eye(3)[axis]
        out = Wrench.zeros(1)
        out.response = np.zeros((6, 6))
        flow.model.evaluate(t, motion(pose, twist, 1), out)
        answers.append(out)
    return answers


def _wrench(out):
    return np.array([*out.force[0, :2], out.torque[0, 2]])


@pytest.mark.parametrize("shape", ["plate", "ellipse"])
def test_a_coarser_communication_step_comes_to_the_same(shape):
    """Several lattice steps in a communication step against one in each."""
    table = {"plate": '{ type = "plate", length = 1.0 }', "ellipse": ELLIPSE}[shape]
    step = 0.008  # so that the stream goes 0.112 cells a step: four times that takes four lattice steps
    one = driven(shape=table, step=step).go(swing, steps=160)
    coarse = driven(shape=table, step=4 * step).go(swing, steps=40)
    means = one.wrench.reshape(40, 4, 3).mean(axis=1)
    np.testing.assert_allclose(coarse.wrench[:, 0], means, rtol=0.0, atol=1e-3 * np.abs(means).max())


def test_a_fluid_at_a_hundred_thousand_stays_finite():
    flow = driven(viscosity=5e-6, cells=16, window=(6.0, 6.0))
    assert np.isfinite(flow.go(swing, steps=2000).wrench).all()


def test_evaluations_change_nothing():
    flow = driven()
    flow.go(swing, steps=10)
    first = answer(flow.model, 11 * STEP)
    answer(flow.model, 11 * STEP + 0.5 * STEP)
    assert answer(flow.model, 11 * STEP) == first


def test_a_closed_body_lighter_than_the_fluid_inside_is_refused():
    """Below some 0.75 of what it displaces, with 32 cells, a free circle is thrown about."""
    displaced, step = np.pi / 4.0, round(0.25 * STEP, 9)
    light, heavy = (
        driven(f"bodies.0.mass={share * displaced!r}", shape=CIRCLE, cells=32, step=step)
        for share in (0.5, 0.9)
    )
    expected = r"body.*mass: expected at least 0\.\d+ kg, for the fluid inside"
    with pytest.raises(SimulationError, match=expected):
        light.go(swing, steps=2)
    heavy.go(swing, steps=2)


def test_a_closed_body_of_less_inertia_than_the_fluid_inside_is_refused():
    """Below some 0.6 of the inertia of what it displaces, with 32 cells, a free circle is turned about."""
    displaced, step = np.pi / 4.0, round(0.25 * STEP, 9)
    settings = {"shape": CIRCLE, "cells": 32, "step": step}
    light, heavy = (
        driven(f"bodies.0.mass={displaced!r}", f"bodies.0.inertia={share * displaced / 8.0!r}", **settings)
        for share in (0.4, 1.0)
    )
    with pytest.raises(SimulationError, match=r"body.*inertia: expected at least 0\.\d+ kg·m² about each"):
        light.go(swing, steps=2)
    heavy.go(swing, steps=2)
