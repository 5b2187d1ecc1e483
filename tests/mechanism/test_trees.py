"""Random trees in space with every joint: start and tables against kinematics written with scipy."""

import json
import math
from dataclasses import dataclass, field

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from linkwind.mechanism import build
from linkwind.native.multibody import NQ, NV, Multibody
from linkwind.scenario import from_json
from linkwind.spatial import Motion

TYPES = list(NQ)


@dataclass
class Case:
    """A tree with its joint coordinates, and its bodies in the world as the test computes them."""

    bodies: list = field(default_factory=list)
    joints: list = field(default_factory=list)
    q: list = field(default_factory=list)
    v: list = field(default_factory=list)
    rotation: list = field(default_factory=list)
    position: list = field(default_factory=list)
    linear: list = field(default_factory=list)
    angular: list = field(default_factory=list)


def frame(axis):
    """Rotation that takes z to the axis on the shortest way."""
    z, axis = np.array([0.0, 0.0, 1.0]), axis / np.linalg.norm(axis)
    across = np.cross(z, axis)
    sine = np.linalg.norm(across)
    angle = math.atan2(sine, axis @ z)
    return Rotation.from_rotvec(angle * (across / sine if sine else np.array([1.0, 0.0, 0.0])))


def coordinates(kind, rng):
    """Random displacement, turn, and their rates in the joint frame."""
    slides = {"prismatic": [0, 0, 1], "planar": [1, 1, 0], "free": [1, 1, 1]}.get(kind, [0, 0, 0])
    turns = {"revolute": [0, 0, 1], "planar": [0, 0, 1], "spherical": [1, 1, 1], "free": [1, 1, 1]}
    turns = np.array(turns.get(kind, [0, 0, 0]))
    displacement, speed, rate = rng.normal(size=(3, 3))
    turn = Rotation.from_rotvec(turns * rng.uniform(-1.5, 1.5, 3))
    return displacement * slides, turn, speed * slides, rate * turns


def grow(case, kind, parent, rng):
    """Add a body to the tree, moved by random coordinates of its joint."""
    i = len(case.bodies)
    axis = np.array([0.0, 0.0, -2.0]) if rng.random() < 0.2 else rng.normal(size=3)
    parent_point, child_point = rng.normal(size=(2, 3))
    displacement, turn, speed, rate = coordinates(kind, rng)
    if parent is None:
        base, origin, velocity, spin = Rotation.identity(), np.zeros(3), np.zeros(3), np.zeros(3)
    else:
        base, origin = case.rotation[parent], case.position[parent]
        velocity, spin = case.linear[parent], case.angular[parent]
    on_parent = base * frame(axis)
    weld = Rotation.random(rng=rng) if kind in ("fixed", "prismatic") else Rotation.identity()
    rotation = on_parent * turn * frame(axis).inv() * weld
    point = origin + base.apply(parent_point) + on_parent.apply(displacement)
    angular = spin + (on_parent * turn).apply(rate)
    arm = rotation.apply(child_point)
    linear = velocity + np.cross(spin, point - origin) + on_parent.apply(speed) - np.cross(angular, arm)
    case.rotation.append(rotation)
    case.position.append(point - arm)
    case.linear.append(linear)
    case.angular.append(angular)
    turned = turn.as_quat(scalar_first=True)
    angle = turn.as_rotvec()[2:]
    case.q.append(
        {
            "fixed": [], "revolute": angle, "prismatic": displacement[2:],
            "planar": [*displacement[:2], *angle], "spherical": turned, "free": [*displacement, *turned],
        }[kind]
    )  # fmt: skip
    case.v.append(
        {
            "fixed": [], "revolute": rate[2:], "prismatic": speed[2:],
            "planar": [*speed[:2], rate[2]], "spherical": rate, "free": [*speed, *rate],
        }[kind]
    )  # fmt: skip
    case.bodies.append({"name": f"b{i}", "mass": 1.0 + i, "inertia": [1, 2, 2.5, 0.1, 0.2, 0.3]})
    case.joints.append(
        {
            "name": f"j{i}",
            "type": kind,
            "parent": "world" if parent is None else f"b{parent}",
            "child": f"b{i}",
            "parent_point": parent_point.tolist(),
            "child_point": child_point.tolist(),
            "axis": axis.tolist(),
        }
    )


def state(case, i, everything):
    """What a scenario states of a body: all of it, or only what its joint leaves free."""
    kind = case.joints[i]["type"]
    stated = {"orientation": case.rotation[i].as_quat(scalar_first=True).tolist()}
    if everything or kind not in ("fixed", "prismatic"):
        stated["angular_velocity"] = case.angular[i].tolist()
    if everything or kind in ("prismatic", "planar", "free"):
        stated |= {"position": case.position[i].tolist(), "velocity": case.linear[i].tolist()}
    return stated


def tree(seed, everything):
    """A tree with each kind of joint three times, and its scenario with bodies in random order."""
    rng = np.random.default_rng(seed)
    case = Case()
    for kind in rng.permutation(TYPES * 3):
        parent = rng.integers(-1, len(case.bodies))
        grow(case, kind, None if parent < 0 else int(parent), rng)
    bodies = [body | state(case, i, everything) for i, body in enumerate(case.bodies)]
    shuffled = rng.permutation(len(bodies))
    data = {
        "name": "tree",
        "time": {"end": 1.0},
        "bodies": [bodies[i] for i in shuffled],
        "joints": [case.joints[i] for i in rng.permutation(len(bodies))],
    }
    return case, shuffled, from_json(json.dumps(data))


def same_up_to_sign(kind, q, expected):
    q, expected = np.array(q, dtype=float), np.array(expected, dtype=float)
    if kind in ("spherical", "free") and q[-4:] @ expected[-4:] < 0:
        q[-4:] *= -1.0
    np.testing.assert_allclose(q, expected, atol=1e-12)


@pytest.mark.parametrize("everything", [True, False])
@pytest.mark.parametrize("seed", range(10))
def test_joint_coordinates_follow_from_what_is_stated(seed, everything):
    case, shuffled, scenario = tree(seed, everything)
    mechanism = build(scenario)
    tables = mechanism.tables
    assert mechanism.joints == tuple(f"j{i}" for i in shuffled)
    for row, i in enumerate(shuffled):
        kind = case.joints[i]["type"]
        q = mechanism.q0[tables.q_index[row] :][: NQ[kind]]
        v = mechanism.v0[tables.v_index[row] :][: NV[kind]]
        same_up_to_sign(kind, q, case.q[i])
        np.testing.assert_allclose(v, case.v[i], atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_the_core_puts_the_bodies_where_the_scenario_states_them(seed):
    case, shuffled, scenario = tree(seed, everything=False)
    mechanism = build(scenario)
    multibody = Multibody(mechanism.tables)
    motion = Motion.at_rest(multibody.n)
    multibody.motion(multibody.initial_state(mechanism.q0, mechanism.v0), motion)
    for row, i in enumerate(shuffled):
        np.testing.assert_allclose(motion.position[row], case.position[i], atol=1e-12)
        np.testing.assert_allclose(motion.linear[row], case.linear[i], atol=1e-12)
        np.testing.assert_allclose(motion.angular[row], case.angular[i], atol=1e-12)
        rotation = Rotation.from_quat(motion.orientation[row], scalar_first=True)
        np.testing.assert_allclose(rotation.as_matrix(), case.rotation[i].as_matrix(), atol=1e-12)


@pytest.mark.parametrize("seed", range(10))
def test_every_parent_comes_before_its_children(seed):
    _, _, scenario = tree(seed, everything=False)
    tables = build(scenario).tables
    place = {int(body): rank for rank, body in enumerate(tables.order)}
    assert sorted(place) == list(range(len(scenario.bodies)))
    assert all(parent < 0 or place[int(parent)] < place[i] for i, parent in enumerate(tables.parent))


def test_bodies_without_joints_in_space_get_free_ones():
    inertia = [1, 2, 2.5, 0, 0, 0]
    body = {"name": "a", "mass": 1, "inertia": inertia, "position": [1, 2, 3], "velocity": [4, 5, 6]}
    body |= {"orientation": [0.5, 0.5, 0.5, 0.5], "angular_velocity": [1, 0, 0]}
    data = {"name": "x", "time": {"end": 1.0}, "bodies": [body, {"name": "b", "mass": 1, "inertia": inertia}]}
    mechanism = build(from_json(json.dumps(data)))
    assert mechanism.joints == ("world-a", "world-b")
    assert mechanism.q0.tolist() == [1, 2, 3, 0.5, 0.5, 0.5, 0.5, 0, 0, 0, 1, 0, 0, 0]
    # Body z is the world's y, body x the world's... (x, y, z) -> (y, z, x): world x is body z.
    assert mechanism.v0.tolist() == [4, 5, 6, 0, 0, 1, 0, 0, 0, 0, 0, 0]
    assert mechanism.tables.inertia[0].tolist() == inertia


def test_a_slightly_rounded_orientation_is_turned_onto_the_axis():
    root = {"name": "a", "mass": 1, "inertia": [1, 2, 2.5, 0, 0, 0]}
    child = root | {"name": "b", "orientation": [0.9238795, 0.3826834, 0, 0]}  # 45° about x, 7 digits
    joint = {"name": "j", "type": "revolute", "parent": "a", "child": "b", "axis": [3, 0, 0]}
    data = {"name": "x", "time": {"end": 1.0}, "bodies": [root, child], "joints": [joint]}
    mechanism = build(from_json(json.dumps(data)))
    assert mechanism.q0[7] == pytest.approx(math.pi / 4, abs=1e-6)
