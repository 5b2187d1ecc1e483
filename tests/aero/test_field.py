"""Force fields: the two stated ones, the unwrapped angle, memory, and values that are not finite."""

import numpy as np
import pytest

from linkwind import aero
from linkwind.errors import ExpressionError, ProtocolError, SimulationError
from linkwind.scenario import from_json, load, loads
from linkwind.spatial import Motion, Wrench
from tests.aero.scenes import model, wrench

RNG = np.random.default_rng(23)


def builtin(name):
    scenario = from_json(load(name).to_json())  # as a provider gets it
    return aero.build(scenario, scenario.providers[0])


def turned(*angles):
    """Bodies at rest that are turned about z; the quaternion goes on beyond a whole turn."""
    motion, half = Motion.at_rest(len(angles)), np.array(angles) / 2
    motion.orientation[:, 0], motion.orientation[:, 3] = np.cos(half), np.sin(half)
    return motion


def test_f0_is_the_stated_field():
    """paper.md, F0, written out."""

    def s(t, f, phase=0.0):
        return np.sin(2 * np.pi * f * t + phase)

    def c(t, f):
        return np.cos(2 * np.pi * f * t)

    field = builtin("two_link_field")
    for t in RNG.uniform(0, 1.2, size=50):
        out = wrench(field, turned(np.pi - 0.3, 0.3), t, n=2)
        expected = [
            [
                -12 + 8 * s(t, 7) + 6 * s(t, 23, 1) + 4 * c(t, 40),
                14 + 5 * s(t, 5, 0.5) + 5 * c(t, 31),
                0.8 * c(t, 3) + s(t, 19),
            ],
            [
                -10 + 8 * c(t, 9) + 6 * s(t, 27) + 4 * s(t, 37, 2),
                15 + 5 * c(t, 6) + 5 * s(t, 33, 1),
                -0.6 * s(t, 4) + c(t, 21),
            ],
        ]
        got = np.column_stack((out.force[:, :2], out.torque[:, 2]))
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12)
        assert not out.force[:, 2].any()
        assert not out.torque[:, :2].any()


def test_f1_is_the_stated_field():
    """paper.md, F1, in vectors."""
    field = builtin("two_link_gust")
    for t in RNG.uniform(0, 1.2, size=50):
        angles = RNG.uniform(-np.pi, np.pi, size=2)
        motion = turned(*angles)
        motion.position[:, :2], motion.linear[:, :2] = RNG.normal(size=(2, 2, 2))
        motion.angular[:, 2] = RNG.normal(size=2)
        out = wrench(field, motion, t, n=2)
        for b, theta in enumerate(angles):
            x, y = motion.position[b, :2]
            n, e = np.array([-np.sin(theta), np.cos(theta)]), np.array([np.cos(theta), np.sin(theta)])
            tau = 2 * np.pi
            gx = 1 + 0.3 * np.sin(tau * (12 * t + 1.3 * x)) + 0.2 * np.sin(tau * (35 * t - 0.9 * y + 0.3 * b))
            gy = 0.3 * np.cos(tau * (17 * t + 1.1 * y)) + 0.2 * np.sin(tau * (29 * t + x))
            u = np.array([-5 * gx, 5 * gy]) - motion.linear[b, :2]
            size, q = np.linalg.norm(u), 0.3
            f_n, f_e = 2.2 * q * (u @ n) * size, 0.2 * q * (u @ e) * abs(u @ e)
            torque = -0.08 * f_n * (u @ e) / size - 0.15 * motion.angular[b, 2] * abs(u @ n)
            np.testing.assert_allclose(out.force[b, :2], f_n * n + f_e * e, rtol=0, atol=1e-11)
            assert out.torque[b, 2] == pytest.approx(torque, abs=1e-12)


BODY = '[[bodies]]\nname = "{}"\nmass = 1.0\ninertia = 1.0\n'
THETA = (
    "[time]\nend = 1.0\n" + BODY.format("body") + '[aero]\nmodel = "field"\n[aero.field.body]\ntz = "theta"\n'
)


def theta(field, motion):
    return wrench(field, motion).torque[0, 2]


@pytest.mark.parametrize("start_deg", [0, 170, 180, 200, -20, -200, 540, 3600])
def test_the_first_angle_is_that_of_the_scenario(start_deg):
    field = model(THETA, f"bodies.body.angle_deg={start_deg}")
    start = np.radians(start_deg)
    for motion in (turned(start), turned(start % (2 * np.pi)), turned(start + 0.5)):
        assert abs(theta(field, motion) - start) < 0.5 + 1e-12
    assert theta(field, turned(start)) == pytest.approx(start, abs=1e-12)


def test_an_angle_given_as_a_quaternion_starts_within_half_a_turn():
    q = [float(x) for x in turned(3.0).orientation[0]]
    assert theta(model(THETA, f"bodies.body.orientation={q}"), turned(3.0)) == pytest.approx(3.0, abs=1e-14)


@pytest.mark.parametrize("rate", [2.9, -2.9, 0.1])
def test_the_angle_is_continuous_over_many_turns(rate):
    """As long as a step turns by less than half a turn."""
    field = model(THETA, "bodies.body.angle_deg=200")
    start = np.radians(200)
    for k in range(100):
        field.commit(0.0, turned(start + rate * k))
        assert theta(field, turned(start + rate * (k + 1))) == pytest.approx(
            start + rate * (k + 1), abs=1e-12
        )


def test_a_trial_state_leaves_no_trace():
    field = model(THETA)
    field.commit(0.0, turned(0.0))
    for _ in range(4):
        assert theta(field, turned(3.0)) == pytest.approx(3.0)
        assert theta(field, turned(-3.0)) == pytest.approx(-3.0)


def test_the_angle_is_the_heading_of_the_body_axis_in_three_dimensions():
    field = model(THETA)
    for _ in range(50):
        q = RNG.normal(size=4)
        q /= np.linalg.norm(q)
        w, x, y, z = q
        # Where the rotated x axis points, from the double product q i q*.
        axis = np.array([w * w + x * x - y * y - z * z, 2 * (x * y + w * z)])
        motion = Motion(np.zeros((1, 3)), q[None], np.zeros((1, 3)), np.zeros((1, 3)))
        np.testing.assert_allclose(
            np.linalg.norm(axis) * np.array([np.cos(theta(field, motion)), np.sin(theta(field, motion))]),
            axis, rtol=0, atol=1e-14,
        )  # fmt: skip


def test_what_is_saved_is_restored():
    field = model(THETA, "bodies.body.angle_deg=200")
    start = np.radians(200)
    field.commit(0.0, turned(start + 2.5))
    blob = field.save()
    for k in range(2, 10):
        field.commit(0.0, turned(start + 2.5 * k))
    assert theta(field, turned(start)) == pytest.approx(start + 8 * np.pi)
    field.restore(blob)
    assert theta(field, turned(start)) == pytest.approx(start)
    assert field.save() == blob
    other = model(THETA)
    other.restore(blob)
    assert other.save() == blob


def test_a_checkpoint_of_another_size_is_refused():
    with pytest.raises(ProtocolError, match="expected a checkpoint of 8 bytes; got 5"):
        model(THETA).restore(b"12345")


TREE = (
    "[time]\nend = 1.0\n" + "".join(map(BODY.format, ("root", "arm", "hand")))
    + '[[joints]]\nname = "elbow"\ntype = "revolute"\nparent = "root"\nchild = "arm"\n'
    + '[[joints]]\nname = "wrist"\ntype = "revolute"\nparent = "arm"\nchild = "hand"\n'
    + '[aero]\nmodel = "field"\n'
    + "".join(f'[aero.field.{name}]\ntz = "theta"\n' for name in ("root", "arm", "hand"))
)  # fmt: skip


def test_a_body_that_states_no_angle_starts_near_its_parents():
    field = model(TREE, "bodies.root.angle_deg=400", "bodies.hand.angle_deg=-20")
    at = np.radians([400, 400, -20])
    assert wrench(field, turned(*at), n=3).torque[:, 2] == pytest.approx(at)


SUBSET = (
    "[time]\nend = 1.0\n" + "".join(map(BODY.format, ("a", "b", "c")))
    + '[[providers]]\nname = "rest"\nmodel = "none"\nbodies = ["b"]\n'
    + '[[providers]]\nname = "pull"\nmodel = "field"\nbodies = ["c", "a"]\n[providers.field.a]\nfy = "x"\n'
)  # fmt: skip


def test_a_provider_of_some_bodies_answers_in_its_own_order():
    scenario = loads(SUBSET, "subset")
    motion = Motion.at_rest(3)
    motion.position[:, 0] = 1.0, 2.0, 3.0
    out = wrench(aero.build(scenario, scenario.providers[1]), motion, n=2)
    assert out.force.tolist() == [[0, 0, 0], [0, 1, 0]]  # c has no table: no force


def test_a_wrong_expression_is_named_as_the_user_wrote_it():
    with pytest.raises(ExpressionError, match=r"^scene: aero\.field\.body\.tz: column 1: "):
        model(THETA, "aero.field.body.tz=oops")
    scenario = loads(SUBSET.replace('"x"', '"2*q"'), "subset")
    with pytest.raises(ExpressionError, match=r'^subset: providers\[1\] "pull"\.field\.a\.fy: column 3: '):
        aero.build(scenario, scenario.providers[1])


@pytest.mark.parametrize(("text", "value"), [("1/x", "inf"), ("sqrt(-1 - t)", "nan"), ("log(x)", "-inf")])
def test_a_value_that_is_not_finite_ends_the_run(text, value):
    field = model(THETA, f"aero.field.body.tz={text}")
    field.commit(0.0, Motion.at_rest(1))
    with pytest.raises(SimulationError) as caught:
        field.evaluate(0.125, Motion.at_rest(1), Wrench.zeros(1))
    message = str(caught.value)
    assert message.startswith("scene: aero.field.body.tz: expected a finite number at t = 0.125 s; got ")
    assert f"got {value}" in message.replace("-nan", "nan")
    assert "x = 0, y = 0, z = 0, vx = 0" in message
    assert "theta = 0." in message
