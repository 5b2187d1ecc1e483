"""Wings in strips: plates of their own on one body, integrals over the span, and where they are on it."""

import numpy as np
import pytest

import linkwind
from linkwind.aero.planform import ends, relative, strips
from linkwind.aero.plate import plate_table
from linkwind.aero.section import curves
from linkwind.native.forces import Plates, PlateTable
from linkwind.scenario import loads
from linkwind.scenario.shapes import Plate, Wing
from linkwind.spatial import Motion
from tests.aero.scenes import PLATE
from tests.aero.test_plate_formulas import rotation_matrix, state
from tests.aero.test_strips import (
    ALPHA,
    CALM,
    DENSITY,
    DRAG,
    IDEAL,
    LIFT,
    ROWS,
    TABLES,
    body_twist,
    kirchhoff,
    plate,
    random_state,
    random_wind,
    wrench,
)

RNG = np.random.default_rng(33)
BLADE = Wing(type="wing", points=[[-0.1, -0.2], [0.2, -0.3], [0.35, 0.5], [0.3, 0.9], [0.15, 0.6]])
RECTANGLE = Wing(type="wing", points=[[-0.2, -0.35], [0.2, -0.35], [0.2, 0.35], [-0.2, 0.35]])
SAME = Plate(type="plate", length=0.4, span=0.7)


def made(shapes, count, rows=ROWS, coefficients=TABLES["table"][0], wind=CALM):
    size = [(strips(shape, 1)[0, 0], shape.span) for shape in shapes]
    table = PlateTable(
        np.arange(len(shapes), dtype=np.int32), np.array(size), coefficients, DENSITY, wind, count,
        np.zeros((3, 0)) if rows is None else curves(rows), relative(shapes, count),
    )  # fmt: skip
    return Plates(table)


def places(count):
    """Chord, width and place of each strip of the blade: shape (count, 5), x, y, z last."""
    chord, x, z = strips(BLADE, count).T
    return np.column_stack([chord, np.full(count, BLADE.span / count), x, 0 * x, z])


def added_inertia(count):
    """That of all strips, from the velocity of each in terms of the body's."""
    total = np.zeros((6, 6))
    for chord, width, *r in places(count):
        carried = np.eye(6)
        carried[:3, 3:] = -np.cross(np.eye(3), r)  # ω × r
        mass = np.pi * DENSITY * (chord / 2) ** 2 * width
        total += carried.T @ np.diag([0, mass, 0, 0, 0, mass * (chord / 2) ** 2 / 8]) @ carried
    return total


@pytest.mark.parametrize("name", TABLES)
def test_a_rectangle_is_a_plate(name):
    """In one strip to the bit; in more, and beside other wings, but for rounding."""
    coefficients, rows = TABLES[name]
    for _ in range(20):
        motion, wind = random_state(), random_wind()
        one = [wrench(made([shape], 1, rows, coefficients, wind), motion) for shape in (RECTANGLE, SAME)]
        assert [part.tobytes() for part in one[0]] == [part.tobytes() for part in one[1]]
        many = [wrench(made([shape], 8, rows, coefficients, wind), motion) for shape in (RECTANGLE, SAME)]
        for found, expected in zip(*many, strict=True):
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_a_plate_beside_a_wing_is_what_it_was():
    motion = random_state()
    both = Motion(*(np.repeat(part, 2, axis=0) for part in (
        motion.position, motion.orientation, motion.linear, motion.angular)))  # fmt: skip
    alone, beside = wrench(made([SAME], 5), motion), wrench(made([BLADE, SAME], 5), both)
    assert beside[0][1].tolist() == alone[0][0].tolist()
    assert beside[1][1].tolist() == alone[1][0].tolist()
    np.testing.assert_allclose(beside[2][1], alone[2][0], rtol=1e-14, atol=1e-17)


@pytest.mark.parametrize("count", [1, 2, 8])
def test_added_inertia_is_that_of_the_strips_moved_to_the_centre_of_mass(count):
    *_, added = wrench(made([BLADE], count), random_state())
    np.testing.assert_allclose(added[0], added_inertia(count), rtol=0, atol=1e-15)
    assert (added[0] == added[0].T).all()
    assert abs(added[0, 1, 5]) > 1e-3  # what turns it about z moves it along y


@pytest.mark.parametrize("count", [1, 2, 8])
def test_without_circulation_and_drag_kirchhoffs_equations_are_left(count):
    ideal, added = made([BLADE], count, IDEAL), added_inertia(count)
    for _ in range(100):
        motion = random_state()
        rotation, twist = body_twist(motion)
        force, torque, _ = wrench(ideal, motion)
        found = np.concatenate([rotation.T @ force[0], rotation.T @ torque[0]])
        scale = np.linalg.norm(added) * max(np.linalg.norm(twist), np.linalg.norm(twist) ** 2)
        np.testing.assert_allclose(found, kirchhoff(added, twist), rtol=0, atol=1e-14 * scale)


@pytest.mark.parametrize("name", TABLES)
def test_strips_are_plates_of_their_own_on_one_body(name):
    """In gusts, with accelerations: the wrench −A a included, each of the five as a plate that is carried."""
    coefficients, rows = TABLES[name]
    count = 5
    for _ in range(30):
        wind, motion, t = random_wind(), random_state(), RNG.normal()
        linear, angular = RNG.normal(size=(2, 3))  # accelerations of the whole, in W
        rotation, omega = rotation_matrix(motion.orientation[0]), motion.angular[0]
        force, torque, added = wrench(made([BLADE], count, rows, coefficients, wind), motion, t)
        reaction = added[0] @ np.concatenate([rotation.T @ linear, rotation.T @ angular])
        whole = np.concatenate([force[0] - rotation @ reaction[:3], torque[0] - rotation @ reaction[3:]])

        parts = places(count)
        arms = parts[:, 2:] @ rotation.T
        each = Motion(
            motion.position + arms, np.tile(motion.orientation, (count, 1)),
            motion.linear + np.cross(omega, arms), np.tile(omega, (count, 1)),
        )  # fmt: skip
        carried = plate(1, rows, coefficients, wind, parts[:, :2])
        forces, torques, inertias = wrench(carried, each, t)
        accelerations = linear + np.cross(angular, arms) + np.cross(omega, np.cross(omega, arms))
        total, size = np.zeros(6), 0.0
        for i in range(count):
            reaction = inertias[i] @ np.concatenate([rotation.T @ accelerations[i], rotation.T @ angular])
            f, m = forces[i] - rotation @ reaction[:3], torques[i] - rotation @ reaction[3:]
            total += np.concatenate([f, m + np.cross(arms[i], f)])
            size += np.linalg.norm(forces[i]) + np.linalg.norm(torques[i]) + np.linalg.norm(reaction)
        np.testing.assert_allclose(whole, total, rtol=0, atol=1e-13 * size)


@pytest.mark.parametrize("count", [1, 3, 8])
def test_a_translating_wing_has_the_force_of_its_area_at_its_centre(count):
    """However many strips; without a moment of the section, also the moment about the centre of mass."""
    alpha, speed = np.radians(ALPHA), 3.0
    motion = state([0, 0, 0], [1, 0, 0, 0], speed * np.array([np.cos(alpha), -np.sin(alpha), 0.0]), [0, 0, 0])
    quarter = -0.25 * (LIFT * np.cos(alpha) + DRAG * np.sin(alpha))  # the middle is then free of moment
    rows = [row if row[0] != ALPHA else [ALPHA, LIFT, DRAG, quarter] for row in ROWS]
    force, torque, added = wrench(made([BLADE], count, rows), motion)
    found = np.concatenate([force[0], torque[0]]) - kirchhoff(added[0], body_twist(motion)[1])
    points = np.array(BLADE.points)
    (x, z), (x1, z1) = points.T, np.roll(points, -1, axis=0).T
    cross = x * z1 - x1 * z
    area = 0.5 * cross.sum()
    centre = ((x + x1) @ cross / (6 * area), 0.0, (z + z1) @ cross / (6 * area))
    q = 0.5 * DENSITY * abs(area) * speed**2
    sine, cosine = np.sin(alpha), np.cos(alpha)
    expected = q * np.array([LIFT * sine - DRAG * cosine, LIFT * cosine + DRAG * sine, 0.0])
    np.testing.assert_allclose(found[:3], expected, rtol=0, atol=1e-13)
    np.testing.assert_allclose(found[3:], np.cross(centre, expected), rtol=0, atol=1e-13)


def revolving(rate):
    """The hub, which the blade is fixed to, turns at the angle of attack ALPHA all along."""
    alpha = np.radians(ALPHA)
    return state([0, 0, 0], [1, 0, 0, 0], [0, 0, 0], rate * np.array([np.sin(alpha), np.cos(alpha), 0.0]))


def test_a_revolving_blade_is_the_integral_over_its_span():
    """A tapered, swept blade, whose chord line leaves the axis: v = ω × r there, by Simpson's rule in numpy;
    the error falls with the square of the strips."""
    rate = 3.0
    blade = Wing(type="wing", points=[[-0.1, 0.2], [0.2, 0.2], [0.25, 1.0], [0.15, 1.0]])
    motion = revolving(rate)
    z = np.linspace(0.2, 1.0, 801)
    weight = np.ones(801)
    weight[1:-1:2], weight[2:-1:2] = 4, 2
    weight *= (z[1] - z[0]) / 3
    front, back = -0.1 + (z - 0.2) * 0.25 / 0.8, 0.2 + (z - 0.2) * 0.05 / 0.8
    chord, x = back - front, 0.5 * (front + back)
    place = np.column_stack([x, 0 * x, z])
    speed = np.cross(motion.angular[0], place)
    u, w = speed[:, 0], speed[:, 1]
    coefficient = [np.array([_curve(column, -np.arctan2(w_, u_)) for u_, w_ in zip(u, w, strict=True)])
                   for column in range(3)]  # fmt: skip
    q, fast = 0.5 * DENSITY * chord, np.hypot(u, w)
    f = np.column_stack([
        q * fast * (-coefficient[0] * w - coefficient[1] * u),
        q * fast * (coefficient[0] * u - coefficient[1] * w),
        0 * u,
    ])  # fmt: skip
    m = np.cross(place, f)
    m[:, 2] += q * chord * coefficient[2] * fast**2
    exact = np.concatenate([weight @ f, weight @ m])
    errors = []
    for count in (4, 8, 16, 32):
        force, torque, added = wrench(made([blade], count), motion)
        found = np.concatenate([force[0], torque[0]]) - kirchhoff(added[0], body_twist(motion)[1])
        errors.append(np.linalg.norm(found - exact))
    assert errors[-1] < 1e-3 * np.linalg.norm(exact)
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.1)


def _curve(column, alpha):
    """What one strip at an angle of attack has: C_l, C_d, C_m, from a plate of unit size at unit speed."""
    motion = state([0, 0, 0], [1, 0, 0, 0], [np.cos(alpha), -np.sin(alpha), 0.0], [0, 0, 0])
    force, torque, added = wrench(plate(1, size=[(1.0, 1.0)]), motion)
    (x, y), m = (part[0] - kirchhoff(added[0], body_twist(motion)[1])[at] for part, at in (
        (force[:, :2], slice(0, 2)), (torque[:, 2], 5)))  # fmt: skip
    lift, drag = x * np.sin(alpha) + y * np.cos(alpha), y * np.sin(alpha) - x * np.cos(alpha)
    return (lift, drag, m)[column] / (0.5 * DENSITY)


# ---- as the model of a scenario ----

TEXT = """
[time]
end = 0.2
[environment]
gravity = [0.0, -9.81, 0.0]
wind = [2.0, 0.5, 0.0]
[[bodies]]
name = "wing"
mass = 0.3
inertia = [0.02, 0.03, 0.01, 0.0, 0.0, 0.0]
angular_velocity = [1.0, 2.0, 3.0]
shape = SHAPE
[aero]
model = "plate"
bodies = ["BODY"]
[aero.plate]
strips = 4
[bus]
transport = "inprocess"
"""
SAIL = """
[[bodies]]
name = "sail"
mass = 0.0
inertia = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
shape = { type = "plate", length = 0.4, span = 0.7 }
[[joints]]
name = "weld"
type = "fixed"
parent = "wing"
child = "sail"
parent_point = [0.3, 0.0, 0.5]
[aero]"""


def fly(text, folder, step):
    settings = [f"coupling.step={step}", "coupling.order=2", "coupling.adaptive=false"]
    outcome = linkwind.run(loads(text, "wing.toml", settings), folder, report=False)
    assert linkwind.verify(outcome.log).identical
    return linkwind.open_log(outcome.log).trajectory()


def test_a_wing_on_an_arm_flies_as_a_plate_on_a_fixed_joint(tmp_path):
    """But for what stands between two points in time, of order 3: torques about one centre or the other."""
    points = [[0.1, 0.15], [0.5, 0.15], [0.5, 0.85], [0.1, 0.85]]
    wing = TEXT.replace("SHAPE", f'{{ type = "wing", points = {points} }}').replace("BODY", "wing")
    plate = TEXT.replace("shape = SHAPE\n", "").replace("BODY", "sail").replace("[aero]", SAIL, 1)
    off = []
    for step in (2e-3, 1e-3):
        one, two = (fly(text, tmp_path / f"{step}{at}", step) for at, text in enumerate((wing, plate)))
        off.append(np.abs(one.position[:, 0] - two.position[:, 0]).max())
    assert np.ptp(one.linear[:, 0], axis=0).min() > 0.03
    assert off[1] < 1e-8
    assert off[0] / off[1] > 7.0


def test_the_table_of_a_scenario_has_the_mean_chord_and_the_strips():
    shape = 'bodies.plate.shape={type="wing",points=[[0,0],[0.4,0],[0.4,1]]}'
    scenario = loads(PLATE, "scene", [shape, "aero.plate.strips=2"])
    table = plate_table(scenario, scenario.providers[0])
    np.testing.assert_allclose(table.size, [[0.2, 1.0]], rtol=1e-14)
    assert ends(scenario.bodies[0].shape) == (0.0, 1.0)
    # A trapezium of chords 0.4 and 0.2, a triangle of chords 0.2 and 0: centres of area by hand.
    expected = [[1.5, (0.4 - 7 / 45) / 0.2, 2 / 9 - (-0.25)], [0.5, (0.4 - 1 / 15) / 0.2, 2 / 3 - 0.25]]
    np.testing.assert_allclose(table.planform[0], expected, rtol=1e-14)
