"""Force elements of the core: springs between points."""

import dataclasses

import numpy as np
import pytest

from linkwind.errors import MechanismError, SimulationError
from linkwind.native.cfe import Cfe, Stabilisation
from linkwind.native.multibody import FORCE_TYPES, Integrator, Multibody
from tests.native.mechanisms import Body, matrix, motion_of, random_state, random_tree, tables

TIGHT = {"integrator": Integrator.DOPRI5, "rtol": 1e-12, "atol": 1e-13}
NODE = np.zeros(1)


def springs(flat, *elements):
    """Return the tables with springs: bodies, points, and stiffness, damping, rest of each."""
    bodies, points, numbers = zip(*elements, strict=True)
    return dataclasses.replace(
        flat,
        force_type=np.full(len(elements), FORCE_TYPES["spring"], np.int32),
        force_body=np.array(bodies, np.int32),
        force_point=np.array(points, float),
        force_number=np.array(numbers, float),
        force_start=np.zeros(len(elements) + 1, np.int32),
    )


def random_springs(rng, flat, count):
    n = len(flat.parent)
    ends = [rng.permutation(np.arange(-1, n))[:2] for _ in range(count)]
    return springs(flat, *((end, rng.normal(size=(2, 3)), rng.uniform(0.5, 5.0, 3)) for end in ends))


def advance(multibody, state, h, steps, **options):
    work = np.zeros(2)
    for _ in range(steps):
        state, done = multibody.advance(state, h, NODE, np.zeros((1, multibody.n, 6)), None, **options)
        work += done
    return state, work


def loads(flat, motion):
    """The wrenches of springs on the bodies at their centres of mass, written a second time."""
    wrench = np.zeros((len(flat.parent), 6))
    for ends, points, (k, c, rest) in zip(flat.force_body, flat.force_point, flat.force_number, strict=True):
        place, speed, arms = [], [], []
        for body, point in zip(ends, points, strict=True):
            arm = point if body < 0 else matrix(motion.orientation[body]) @ point
            place.append(arm if body < 0 else motion.position[body] + arm)
            speed.append(0 * arm if body < 0 else motion.linear[body] + np.cross(motion.angular[body], arm))
            arms.append(arm)
        apart = place[1] - place[0]
        length = np.linalg.norm(apart)
        pull = (k * (length - rest) + c * apart @ (speed[1] - speed[0]) / length) * apart / length
        for body, arm, force in zip(ends, arms, (pull, -pull), strict=True):
            if body >= 0:
                wrench[body] += np.concatenate([force, np.cross(arm, force)])
    return wrench


def test_two_masses_on_a_spring():
    """Free in space: the distance is a damped oscillation of the reduced mass, the middle a free fall."""
    m1, m2, k, c, rest, g = 1.5, 0.5, 40.0, 0.6, 0.7, 9.81
    bodies = [Body(-1, "free", m1), Body(-1, "free", m2)]
    flat = springs(tables(bodies, (0.0, -g, 0.0)), ((0, 1), np.zeros((2, 3)), (k, c, rest)))
    multibody = Multibody(flat)
    along, start = np.array([2.0, 1.0, -2.0]) / 3.0, 1.0
    state = multibody.initial_state([0, 0, 0, 1, 0, 0, 0, *(start * along), 1, 0, 0, 0], np.zeros(12))
    reduced, t = m1 * m2 / (m1 + m2), 1.3
    decay, natural = c / (2.0 * reduced), np.sqrt(k / reduced)
    rate = np.sqrt(natural**2 - decay**2)
    swing = np.cos(rate * t) + decay / rate * np.sin(rate * t)
    length = rest + (start - rest) * np.exp(-decay * t) * swing
    energy = sum(multibody.energy(state))
    state, (work, dissipated) = advance(multibody, state, t / 20, 20, **TIGHT)
    motion = motion_of(multibody, state)
    np.testing.assert_allclose(motion.position[1] - motion.position[0], length * along, atol=1e-10)
    middle = (m1 * motion.position[0] + m2 * motion.position[1]) / (m1 + m2)
    fallen = m2 / (m1 + m2) * start * along - [0.0, 0.5 * g * t**2, 0.0]
    np.testing.assert_allclose(middle, fallen, atol=1e-10)
    assert work == 0.0
    assert dissipated > 0.1
    assert energy == pytest.approx(sum(multibody.energy(state)) + dissipated, abs=1e-10)


@pytest.mark.parametrize("seed", range(3))
def test_a_spring_is_the_wrench_that_it_is(seed):
    """Accelerations and energy of random trees with springs against the same trees under their wrenches."""
    rng = np.random.default_rng(seed)
    flat = tables(random_tree(rng, 7, springs=True))
    sprung, bare = Multibody(random_springs(rng, flat, 4)), Multibody(flat)
    state = random_state(rng, sprung)
    motion, wrench = motion_of(sprung, state), rng.normal(size=(7, 6))
    got, expected = (
        sprung.evaluate(state, wrench),
        bare.evaluate(state, wrench + loads(sprung.tables, motion)),
    )
    for name in ("joint_acceleration", "acceleration", "reaction"):
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), rtol=1e-10, atol=1e-10)
    np.testing.assert_array_equal(got.total_wrench, wrench)


def test_springs_keep_energy_and_order():
    """Error of RK4 at fourth order, and the balance of energy with it."""
    rng = np.random.default_rng(5)
    multibody = Multibody(random_springs(rng, tables(random_tree(rng, 5)), 3))
    start = random_state(rng, multibody)
    exact, _ = advance(multibody, start, 0.05, 4, **TIGHT)
    errors, residuals = [], []
    for steps in (20, 40):
        state, (_, dissipated) = advance(multibody, start, 0.2 / steps, steps, integrator=Integrator.RK4)
        errors.append(np.abs(state - exact)[:-1].max())
        residuals.append(abs(sum(multibody.energy(state)) + dissipated - sum(multibody.energy(start))))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.4)
    assert residuals[1] < residuals[0] / 10.0


def test_bodies_with_joints_as_forces_move_alike():
    rng = np.random.default_rng(2)
    flat = random_springs(rng, tables(random_tree(rng, 4)), 3)
    reduced, maximal = Multibody(flat), Cfe(flat, stabilisation=Stabilisation.PROJECTION, time=0.05)
    q, v = rng.normal(size=reduced.nq), rng.normal(size=reduced.nv)
    ends = []
    for multibody in (reduced, maximal):
        state, (_, dissipated) = advance(multibody, multibody.initial_state(q, v), 1e-3, 50, integrator=2)
        ends.append((motion_of(multibody, state).position, dissipated, sum(multibody.energy(state))))
    for got, expected in zip(*ends, strict=True):
        np.testing.assert_allclose(got, expected, rtol=1e-7, atol=1e-7)


def test_points_that_meet_have_no_direction():
    flat = springs(tables([Body(-1, "free")]), ((-1, 0), np.zeros((2, 3)), (1.0, 0.0, 0.5)))
    multibody = Multibody(flat, ["ball"], forces=["tether"])
    with pytest.raises(SimulationError, match=r'^force "tether": expected two points apart; got points that'):
        multibody.evaluate(multibody.initial_state([0, 0, 0, 1, 0, 0, 0], np.zeros(6)), np.zeros((1, 6)))


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("force_type", [9], r"force_type\[0\]: expected one of 0 \(spring\)"),
        ("force_body", [(0, 0)], r"force_body\[0\]: expected a body that is there, of a spring two"),
        ("force_body", [(0, 3)], r"force_body\[0\]: expected a body that is there, of a spring two"),
        ("force_point", [np.full((2, 3), np.nan)], r"force_point\[0\]: expected finite numbers"),
        ("force_number", [(np.inf, 0, 0)], r"force_number\[0\]: expected finite numbers"),
        ("force_start", [0, 2], r"force_start\[0\]: expected an instruction"),
        ("force_number", [(0.0, 0)], r"force_number: expected shape \(1, 3\)"),
    ],
)
def test_wrong_tables_are_refused(field, value, message):
    flat = springs(tables([Body(-1, "free")]), ((-1, 0), np.zeros((2, 3)), (1.0, 0.0, 0.5)))
    with pytest.raises(MechanismError, match=message):
        Multibody(dataclasses.replace(flat, **{field: np.array(value)}))
