"""The bindings of the force models: the numbers both sides share, memory, wind, status codes."""

import re
from importlib.resources import files

import numpy as np
import pytest

from linkwind.native import forces
from linkwind.native import wind as winds
from linkwind.native.expressions import LOCALS_SIZE, STACK_SIZE, Operation
from linkwind.native.forces import (
    Coefficients,
    Field,
    FieldTable,
    Plates,
    PlateTable,
)
from linkwind.native.wind import WindTable, wind_at
from linkwind.spatial import Motion, Wrench

RNG = np.random.default_rng(20)
CALM = WindTable(np.zeros(3), np.zeros((0, 9)))


def header(name, folder):
    text = (files("linkwind") / "_data" / "fmu" / folder / name).read_text()
    return re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)


def enumerations(name, folder="aero"):
    """Each enum of a header as {identifier: value}."""
    for body in re.findall(r"enum \{(.*?)\}", header(name, folder), flags=re.DOTALL):
        value, out = -1, {}
        for entry in filter(None, map(str.strip, body.split(","))):
            identifier, _, given = (part.strip() for part in entry.partition("="))
            value = int(given) if given else value + 1
            out[identifier] = value
        yield out


def test_operations_variables_and_limits_are_those_of_the_c_header():
    (variables,), (limits, operations) = enumerations("lw_field.h"), enumerations("lw_expression.h", "core")
    assert operations == {f"LW_{op.name}": op.value for op in Operation}
    assert list(variables) == [f"LW_VAR_{name.upper()}" for name in forces.VARIABLES] + ["LW_VARIABLES"]
    assert limits == {"LW_EXPRESSION_STACK": STACK_SIZE, "LW_EXPRESSION_LOCALS": LOCALS_SIZE}


def test_shapes_of_gusts_and_variables_of_winds_are_those_of_the_c_header():
    _, shapes, variables = enumerations("lw_wind.h")
    assert shapes == {f"LW_{name.upper()}": value for name, value in winds.GUST_SHAPES.items()}
    assert list(variables) == [f"LW_WIND_{name.upper()}" for name in (*winds.VARIABLES, "variables")]


def test_coefficient_sets_are_those_of_the_c_header():
    (sets,) = enumerations("lw_plate.h")
    assert sets == {f"LW_PLATE_{c.name}": c.value for c in Coefficients}


def random_wind(n=3):
    gusts = RNG.normal(size=(n, 9))
    gusts[:, 3] *= 5.0
    gusts[:, 8] = np.arange(n) % 2
    return WindTable(RNG.normal(size=3), gusts)


def written_out(wind, t, r):
    velocity = wind.uniform.copy()
    for ax, ay, az, frequency, kx, ky, kz, phase, shape in wind.gusts:
        angle = 2 * np.pi * (frequency * t + kx * r[0] + ky * r[1] + kz * r[2]) + phase
        single = (1 - np.cos(angle)) / 2 if 0 <= angle <= 2 * np.pi else 0.0
        velocity += np.array([ax, ay, az]) * (single if shape else np.sin(angle))
    return velocity


def test_wind_is_the_stated_sum_and_its_rate_the_derivative_along_the_path():
    for _ in range(20):
        wind, t = random_wind(), RNG.normal()
        r, v = RNG.normal(size=(2, 3))
        velocity, rate = wind_at(wind, t, r, v)
        np.testing.assert_allclose(velocity, written_out(wind, t, r), rtol=0, atol=1e-13)

        def along(s, wind=wind, t=t, r=r, v=v):
            return written_out(wind, t + s, r + s * v)

        h = 1e-4  # five-point stencil: truncation ~ h⁴, round-off ~ ε/h
        difference = (8 * (along(h) - along(-h)) - (along(2 * h) - along(-2 * h))) / (12 * h)
        np.testing.assert_allclose(rate, difference, rtol=0, atol=2e-7 * max(1, abs(rate).max()))


def test_a_single_gust_rises_and_falls_once():
    """14 CFR 25.341: U = peak/2 (1 - cos(π s/H)) for s from 0 to 2 H, here flown through at 20 m/s."""
    peak, half, speed = 12.0, 30.0, 20.0
    gust = [[0.0, peak, 0.0, 0.0, 1.0 / (2.0 * half), 0.0, 0.0, 0.0, 1.0]]
    wind = WindTable(np.zeros(3), np.array(gust))
    for s in (-1.0, -1e-9, 0.0, 10.0, half, 50.0, 2.0 * half, 2.0 * half + 1e-9, 100.0):
        inside = 0.0 <= s <= 2.0 * half
        velocity, rate = wind_at(wind, 7.0, np.array([s, 3.0, 0.0]), np.array([speed, 0.0, 0.0]))
        expected = 0.5 * peak * (1.0 - np.cos(np.pi * s / half)) if inside else 0.0
        slope = 0.5 * peak * np.pi / half * np.sin(np.pi * s / half) if inside else 0.0
        np.testing.assert_allclose(velocity, [0.0, expected, 0.0], rtol=0, atol=1e-13)
        np.testing.assert_allclose(rate, [0.0, speed * slope, 0.0], rtol=0, atol=1e-13)


def test_wind_without_gusts_is_uniform_and_steady():
    velocity, rate = wind_at(WindTable(np.array([1.0, 2.0, 3.0]), np.zeros((0, 9))), 1.0, *np.ones((2, 3)))
    assert velocity.tolist() == [1.0, 2.0, 3.0]
    assert rate.tolist() == [0.0, 0.0, 0.0]


def plates(body=(0,), wind=CALM, n_sizes=None):
    size = np.tile([0.5, 1.0], (n_sizes or len(body), 1))
    return Plates(PlateTable(np.array(body, dtype=np.int32), size, Coefficients.RISTROPH, 1.2, wind))


def random_motion(n):
    orientation = RNG.normal(size=(n, 4))
    orientation /= np.linalg.norm(orientation, axis=1, keepdims=True)
    return Motion(RNG.normal(size=(n, 3)), orientation, RNG.normal(size=(n, 3)), RNG.normal(size=(n, 3)))


def test_a_model_writes_its_own_bodies_in_its_own_order():
    motion = random_motion(4)
    every, some = Wrench.zeros(4), Wrench.zeros(2)
    assert plates(range(4)).evaluate(0.0, motion, every) == 0
    assert plates((3, 1)).evaluate(0.0, motion, some) == 0
    assert (some.force == every.force[[3, 1]]).all()
    assert (some.torque == every.torque[[3, 1]]).all()


def test_a_binding_follows_when_another_motion_or_wrench_is_given():
    model = plates()
    first, second = random_motion(1), random_motion(1)
    results = []
    for motion in (first, second, first):
        wrench = Wrench.zeros(1)
        model.evaluate(0.0, motion, wrench)
        results.append(wrench.force.copy())
    assert (results[0] == results[2]).all()
    assert (results[0] != results[1]).any()


def test_added_inertia_is_rewritten_whole_and_left_out_where_there_is_no_place():
    model, wrench = plates(), Wrench.zeros(1, added_inertia=True)
    wrench.added_inertia[:] = np.nan
    model.evaluate(0.0, random_motion(1), wrench)
    assert np.count_nonzero(wrench.added_inertia) == 2
    assert model.evaluate(0.0, random_motion(1), Wrench.zeros(1)) == 0


def test_plates_tell_the_first_wrench_that_is_not_finite():
    motion = random_motion(3)
    motion.linear[1, 0] = np.inf
    motion.angular[2, 0] = np.nan
    assert plates(range(3)).evaluate(0.0, motion, Wrench.zeros(3)) == 1 + 1


def field(*programs, constants=(0.0,), body=None):
    start = np.cumsum([0, *map(len, programs)])
    code = np.array([instruction for program in programs for instruction in program], dtype=np.int32)
    bodies = np.array(body or range(len(programs)), dtype=np.int32)
    table = FieldTable(bodies, start.astype(np.int32), code.reshape(-1, 2), np.array(constants, dtype=float))
    return Field(table, np.zeros(len(programs)))


def test_a_field_writes_components_in_order_and_zero_where_it_has_none():
    Op = Operation
    model = field(
        [(Op.CONSTANT, 0), (Op.RESULT, 1)], [], [(Op.VARIABLE, 3), (Op.NEGATE, 0), (Op.RESULT, 5)],
        constants=[7.0], body=[2, 0, 1],
    )  # fmt: skip
    motion, wrench = random_motion(3), Wrench(np.full((3, 3), np.nan), np.full((3, 3), np.nan))
    assert model.evaluate(0.0, motion, wrench) == 0
    assert wrench.force.tolist() == [[0, 7, 0], [0, 0, 0], [0, 0, 0]]
    assert wrench.torque.tolist() == [[0, 0, 0], [0, 0, 0], [0, 0, -motion.position[1, 2]]]


@pytest.mark.parametrize("component", range(6))
def test_a_field_tells_body_and_component_that_are_not_finite(component):
    Op = Operation
    bad = [(Op.CONSTANT, 0), (Op.CONSTANT, 0), (Op.DIVIDE, 0), (Op.RESULT, component)]
    assert field([], bad, bad).evaluate(0.0, random_motion(3), Wrench.zeros(3)) == 1 + 6 + component


def test_variables_are_those_of_the_body():
    motion = random_motion(2)
    got = field([], [(Operation.VARIABLE, 0), (Operation.RESULT, 0)]).variables(1, 0.25, motion)
    expected = dict(zip("xyz", motion.position[1], strict=True), t=0.25)
    expected |= dict(zip(("vx", "vy", "vz"), motion.linear[1], strict=True))
    expected |= dict(zip(("wx", "wy", "wz"), motion.angular[1], strict=True))
    theta = got.pop("theta")
    assert got == expected
    w, x, y, z = motion.orientation[1]
    assert theta == pytest.approx(np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)), abs=1e-14)
