"""A plate in strips: closed forms of blade elements, and Kirchhoff's equations for what the fluid adds."""

import numpy as np
import pytest

import linkwind
from linkwind.aero.section import curves
from linkwind.native.forces import Coefficients, Plates, PlateTable
from linkwind.native.wind import WindTable
from linkwind.spatial import Motion, Wrench
from tests.aero.test_plate_formulas import rotation_matrix, state

RNG = np.random.default_rng(31)
DENSITY, CHORD, SPAN = 1.3, 0.4, 0.7
CALM = WindTable(np.zeros(3), np.zeros((0, 9)))
ALPHA, LIFT, DRAG, MOMENT = 30.0, 1.1, 0.7, -0.1
ROWS = [[0, 0, 0.1, 0], [ALPHA, LIFT, DRAG, MOMENT], [60, 0.8, 1.5, -0.3], [90, 0, 2, -0.5]]
IDEAL = [[0, 0, 0, 0], [90, 0, 0, 0]]  # nothing but added mass
TABLES = {
    "ristroph": (Coefficients.RISTROPH, None),
    "andersen": (Coefficients.ANDERSEN, None),
    "table": (Coefficients.TABLE, ROWS),
}


def random_state():
    q = RNG.normal(size=4)
    scale = 10.0 ** RNG.uniform(-3, 2, size=2)
    linear, angular = scale[:, None] * RNG.normal(size=(2, 3))
    return state(RNG.normal(size=3), q / np.linalg.norm(q), linear, angular)


def random_wind():
    """A wave and a single gust."""
    return WindTable(RNG.normal(size=3), np.column_stack([RNG.normal(size=(2, 8)), [0.0, 1.0]]))


def plate(strips, rows=ROWS, coefficients=Coefficients.TABLE, wind=CALM, size=((CHORD, SPAN),)):
    n = len(size)
    table = PlateTable(
        np.arange(n, dtype=np.int32), np.array(size, dtype=float), coefficients, DENSITY, wind, strips,
        np.zeros((3, 0)) if rows is None else curves(rows),
    )  # fmt: skip
    return Plates(table)


def wrench(plates, motion, t=0.0):
    """Force and torque in W and added inertia of every plate."""
    out = Wrench.zeros(len(motion.position), added_inertia=True)
    assert plates.evaluate(t, motion, out) == 0
    return out.force, out.torque, out.added_inertia


def added_inertia(strips):
    """The 6 × 6 of all strips at the centre, from the velocity of each strip in terms of the plate's."""
    total = np.zeros((6, 6))
    for z in (np.arange(strips) + 0.5) * SPAN / strips - SPAN / 2:
        carried = np.eye(6)
        carried[:3, 3:] = [[0, z, 0], [-z, 0, 0], [0, 0, 0]]  # ω × z k
        mass = np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN / strips
        own = np.diag([0, mass, 0, 0, 0, mass * (CHORD / 2) ** 2 / 8])
        total += carried.T @ own @ carried
    return total


def kirchhoff(added, twist):
    """What Kirchhoff's equations give besides −A times the classical acceleration, in the body frame."""
    v, omega = twist[:3], twist[3:]
    p, angular = np.split(added @ twist, 2)
    frame = added @ np.concatenate([np.cross(omega, v), np.zeros(3)])
    return frame - np.concatenate([np.cross(omega, p), np.cross(omega, angular) + np.cross(v, p)])


def body_twist(motion):
    rotation = rotation_matrix(motion.orientation[0])
    return rotation, np.concatenate([rotation.T @ motion.linear[0], rotation.T @ motion.angular[0]])


@pytest.mark.parametrize("name", TABLES)
@pytest.mark.parametrize("strips", [2, 3, 8, 50])
def test_strips_feel_no_difference_where_nothing_turns(name, strips):
    coefficients, rows = TABLES[name]
    one, several = plate(1, rows, coefficients), plate(strips, rows, coefficients)
    for _ in range(50):
        motion = random_state()
        motion.angular[:] = 0.0
        (force, torque, _), (f, m, _) = wrench(one, motion), wrench(several, motion)
        scale = np.linalg.norm(force)
        np.testing.assert_allclose(f, force, rtol=0, atol=1e-14 * scale)
        np.testing.assert_allclose(m, torque, rtol=0, atol=1e-14 * scale)


def revolving(rate=3.0):
    """A plate that revolves about an axis through its root, at the angle of attack ALPHA all along."""
    alpha = np.radians(ALPHA)
    omega = rate * np.array([np.sin(alpha), np.cos(alpha), 0.0])
    linear = np.cross(omega, [0.0, 0.0, SPAN / 2])
    return state([0, 0, 0], [1, 0, 0, 0], linear, omega)


def blades(square, cube, rate=3.0):
    """The wrench at the centre from ∫ r² dr and ∫ r³ dr over the span, r from the root."""
    sine, cosine = np.sin(np.radians(ALPHA)), np.cos(np.radians(ALPHA))
    q = 0.5 * DENSITY * CHORD * rate**2
    x, y = q * (LIFT * np.array([sine, cosine]) - DRAG * np.array([cosine, -sine]))
    along = cube - SPAN / 2 * square
    middle = MOMENT + 0.25 * (LIFT * cosine + DRAG * sine)
    return np.array([x * square, y * square, 0, -y * along, x * along, q * CHORD * middle * square])


@pytest.mark.parametrize("strips", [1, 2, 5, 8, 40])
def test_a_revolving_wing_is_the_midpoint_rule_of_blade_elements(strips):
    """∫ r² dr = R³/3 and ∫ r³ dr = R⁴/4, less 1/(4 N²) and 1/(2 N²) of them."""
    motion = revolving()
    force, torque, added = wrench(plate(strips), motion)
    circulatory = np.concatenate([force[0], torque[0]]) - kirchhoff(added[0], body_twist(motion)[1])
    square, cube = SPAN**3 / 3 * (1 - 0.25 / strips**2), SPAN**4 / 4 * (1 - 0.5 / strips**2)
    np.testing.assert_allclose(circulatory, blades(square, cube), rtol=0, atol=1e-14)


def test_strips_converge_to_the_integral_with_order_two():
    """Everything, added mass included: about the chord it is m s²/12 in the limit."""
    motion, mass = revolving(), np.pi * DENSITY * (CHORD / 2) ** 2 * SPAN
    limit = np.diag([0, mass, 0, mass * SPAN**2 / 12, 0, mass * (CHORD / 2) ** 2 / 8])
    exact = blades(SPAN**3 / 3, SPAN**4 / 4) + kirchhoff(limit, body_twist(motion)[1])
    errors = []
    for strips in (1, 2, 4, 8, 16, 32):
        force, torque, _ = wrench(plate(strips), motion)
        errors.append(np.linalg.norm(np.concatenate([force[0], torque[0]]) - exact))
    np.testing.assert_allclose(np.log2(np.array(errors[:-1]) / errors[1:]), 2.0, atol=0.05)


def test_a_plate_that_flaps_about_its_root_across_the_stream():
    """Normal force ρ c C_D Ω² R³/6, moment about the root ρ c C_D Ω² R⁴/8; C_D2 = 1.9 of Li et al. 2022."""
    rate, strips = 4.0, 400
    motion = state([0, 0, 0], [1, 0, 0, 0], np.cross([rate, 0, 0], [0, 0, SPAN / 2]), [rate, 0, 0])
    force, torque, added = wrench(plate(strips, None, Coefficients.RISTROPH), motion)
    found = np.concatenate([force[0], torque[0]]) - kirchhoff(added[0], body_twist(motion)[1])
    assert found[1] == pytest.approx(DENSITY * CHORD * 1.9 * rate**2 * SPAN**3 / 6, rel=1e-5)
    about_root = found[3] - SPAN / 2 * found[1]
    assert about_root == pytest.approx(-DENSITY * CHORD * 1.9 * rate**2 * SPAN**4 / 8, rel=1e-5)


@pytest.mark.parametrize("strips", [1, 2, 3, 8])
def test_added_inertia_is_that_of_the_strips_moved_to_the_centre(strips):
    *_, added = wrench(plate(strips), random_state())
    expected = added_inertia(strips)
    np.testing.assert_allclose(added[0], expected, rtol=0, atol=1e-16)
    assert np.count_nonzero(added) == (2 if strips == 1 else 3)


@pytest.mark.parametrize("strips", [1, 2, 3, 8])
def test_without_circulation_and_drag_kirchhoffs_equations_are_left(strips):
    ideal, added = plate(strips, IDEAL), added_inertia(strips)
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
    strips = 5
    for _ in range(30):
        wind, motion, t = random_wind(), random_state(), RNG.normal()
        linear, angular = RNG.normal(size=(2, 3))  # accelerations of the whole, in W
        rotation, omega = rotation_matrix(motion.orientation[0]), motion.angular[0]
        force, torque, added = wrench(plate(strips, rows, coefficients, wind), motion, t)
        reaction = added[0] @ np.concatenate([rotation.T @ linear, rotation.T @ angular])
        whole = np.concatenate([force[0] - rotation @ reaction[:3], torque[0] - rotation @ reaction[3:]])

        arms = np.outer((np.arange(strips) + 0.5) * SPAN / strips - SPAN / 2, rotation[:, 2])
        each = Motion(
            motion.position + arms, np.tile(motion.orientation, (strips, 1)),
            motion.linear + np.cross(omega, arms), np.tile(omega, (strips, 1)),
        )  # fmt: skip
        carried = plate(1, rows, coefficients, wind, [(CHORD, SPAN / strips)] * strips)
        forces, torques, inertias = wrench(carried, each, t)
        accelerations = linear + np.cross(angular, arms) + np.cross(omega, np.cross(omega, arms))
        total, size = np.zeros(6), 0.0
        for i in range(strips):
            reaction = inertias[i] @ np.concatenate([rotation.T @ accelerations[i], rotation.T @ angular])
            f, m = forces[i] - rotation @ reaction[:3], torques[i] - rotation @ reaction[3:]
            total += np.concatenate([f, m + np.cross(arms[i], f)])
            size += np.linalg.norm(forces[i]) + np.linalg.norm(torques[i]) + np.linalg.norm(reaction)
        np.testing.assert_allclose(whole, total, rtol=0, atol=1e-13 * size)


# ---- a free plate in an ideal fluid ----

MASS, INERTIA = 0.05, np.array([2e-3, 2.6e-3, 7e-4])
LINEAR, ANGULAR = np.array([0.6, -0.9, 0.4]), np.array([2.0, -1.1, 1.7])  # at the start, in the body frame
FREE = f"""
[time]
end = 2.0
[environment]
gravity = [0.0, 0.0, 0.0]
density = {DENSITY}
[[bodies]]
name = "plate"
mass = {MASS}
inertia = [{", ".join(map(str, INERTIA))}, 0.0, 0.0, 0.0]
shape = {{ type = "plate", length = {CHORD}, span = {SPAN} }}
velocity = {LINEAR.tolist()}
angular_velocity = {ANGULAR.tolist()}
[aero]
model = "plate"
[aero.plate]
coefficients = "table"
table = {IDEAL}
strips = 8
[bus]
transport = "inprocess"
"""


def total_inertia():
    return np.diag([MASS] * 3 + INERTIA.tolist()) + added_inertia(8)


def ideal_flight(duration, h=1e-3):
    """Position, orientation and twist in the body frame by Kirchhoff's equations in numpy, and RK4."""
    inertia = total_inertia()
    inverse = np.linalg.inv(inertia)

    def rate(y):
        orientation, twist = y[3:7], y[7:]
        v, omega = twist[:3], twist[3:]
        p, angular = np.split(inertia @ twist, 2)
        impulse = -np.concatenate([np.cross(omega, p), np.cross(omega, angular) + np.cross(v, p)])
        w, e = orientation[0], orientation[1:]
        turn = 0.5 * np.array([-e @ omega, *(w * omega + np.cross(e, omega))])
        rotation = rotation_matrix(orientation / np.linalg.norm(orientation))
        return np.concatenate([rotation @ v, turn, inverse @ impulse])

    y = np.concatenate([np.zeros(3), [1, 0, 0, 0], LINEAR, ANGULAR])
    for _ in range(round(duration / h)):
        k1 = rate(y)
        k2 = rate(y + h / 2 * k1)
        k3 = rate(y + h / 2 * k2)
        k4 = rate(y + h * k3)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return y


def fly(step, folder):
    scenario = linkwind.loads(FREE, "free.toml", [f"coupling.step={step}", "coupling.adaptive=false"])
    return linkwind.open_log(linkwind.run(scenario, folder).log).trajectory()


def kept(path):
    """T = ½ vᵀ(M + A)v, linear and angular momentum of body and fluid about the origin, at every point."""
    inertia, rows = total_inertia(), []
    each = (path.position[:, 0], path.orientation[:, 0], path.linear[:, 0], path.angular[:, 0])
    for r, q, v, omega in zip(*each, strict=True):
        rotation = rotation_matrix(q)
        twist = np.concatenate([rotation.T @ v, rotation.T @ omega])
        p, angular = np.split(inertia @ twist, 2)
        momentum, about = rotation @ p, rotation @ angular + np.cross(r, rotation @ p)
        rows.append([0.5 * twist @ inertia @ twist, *momentum, *about])
    return np.array(rows)


def test_a_free_plate_in_an_ideal_fluid_keeps_energy_and_both_momenta(tmp_path):
    """But for the steps in time, which are of order 4; and it flies as Kirchhoff's equations say."""
    expected = ideal_flight(2.0)
    rotation = rotation_matrix(expected[3:7] / np.linalg.norm(expected[3:7]))
    end = np.array([expected[:3], rotation @ expected[7:10], rotation @ expected[10:]])
    drifts, off = [], []
    for step in (2e-3, 1e-3):
        path = fly(step, tmp_path / f"{step}")
        found = kept(path)
        drifts.append(np.abs(found - found[0]).max(axis=0))
        off.append(np.abs([path.position[-1, 0], path.linear[-1, 0], path.angular[-1, 0]] - end).max())
    assert np.ptp(path.angular[:, 0, 0]) > 1.0  # it does tumble
    np.testing.assert_allclose(drifts[1], 0.0, atol=2e-8)
    assert (drifts[0] / drifts[1] > 12.0).all()
    assert off[1] < 3e-6
    assert off[0] / off[1] > 12.0
