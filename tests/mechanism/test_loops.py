"""Loops from a scenario: which joints close them, assembly at the start, what is refused."""

import json

import numpy as np
import pytest

from linkwind.errors import MechanismError
from linkwind.mechanism import build
from linkwind.native.multibody import Integrator, Multibody
from linkwind.scenario import from_json
from linkwind.spatial import Motion

ROD = {"mass": 1.0, "inertia": 1 / 12}


def scenario(bodies, joints):
    return from_json(json.dumps({"name": "case", "time": {"end": 1.0}, "bodies": bodies, "joints": joints}))


def pin(name, parent, child, parent_point, child_point, kind="revolute", **more):
    points = {"parent_point": parent_point, "child_point": child_point}
    return {"name": name, "type": kind, "parent": parent, "child": child} | points | more


def four_bar(crank=90.0, rod=None, rocker=None, ground=2.0, **more):
    """Crank of 1 m on the origin, rod of 2 m, rocker of 1.5 m on (ground, 0)."""
    bodies = [
        {"name": "crank", "angle_deg": crank, "angular_velocity": 2.0} | ROD,
        {"name": "rod"} | ROD | ({} if rod is None else {"angle_deg": rod}),
        {"name": "rocker"} | ROD | ({} if rocker is None else {"angle_deg": rocker}) | more,
    ]
    joints = [
        pin("a", "world", "crank", [0, 0], [-0.5, 0]),
        pin("b", "crank", "rod", [0.5, 0], [-1, 0]),
        pin("d", "world", "rocker", [ground, 0], [-0.75, 0]),
        pin("c", "rod", "rocker", [1, 0], [0.75, 0]),
    ]
    return scenario(bodies, joints)


def started(mechanism):
    multibody = Multibody(mechanism.tables)
    motion = Motion.at_rest(multibody.n)
    state = multibody.initial_state(mechanism.q0, mechanism.v0)
    multibody.motion(state, motion)
    return multibody, state, motion


def angle(motion, i):
    w, _, _, z = motion.orientation[i]
    return 2.0 * np.arctan2(z, w)


def test_the_later_joint_of_a_body_closes_a_loop():
    mechanism = build(four_bar())
    assert mechanism.joints == ("a", "b", "d")
    assert mechanism.closures == ("c",)


def test_unstated_bodies_find_their_place_and_speed():
    """Positions of the pins from circles; angular velocities from the loop's velocity equation."""
    multibody, _, motion = started(build(four_bar(60.0)))
    crank, rod, rocker = (angle(motion, i) for i in range(3))
    assert crank == pytest.approx(np.pi / 3, abs=1e-12)
    end = np.array([np.cos(crank), np.sin(crank)]) + 2.0 * np.array([np.cos(rod), np.sin(rod)])
    other = np.array([2.0, 0.0]) + 1.5 * np.array([np.cos(rocker), np.sin(rocker)])
    assert np.abs(end - other).max() < 1e-12
    across = [np.array([-np.sin(a), np.cos(a)]) for a in (crank, rod, rocker)]
    rod_rate, rocker_rate = np.linalg.solve(
        np.column_stack([2.0 * across[1], -1.5 * across[2]]), -2.0 * across[0]
    )
    assert motion.angular[:, 2] == pytest.approx([2.0, rod_rate, rocker_rate], abs=1e-10)
    assert multibody.joint_gap(motion) < 1e-13


def test_stated_bodies_are_closed_to_round_off():
    rod, rocker = (np.degrees(angle(started(build(four_bar()))[2], i)) for i in (1, 2))
    multibody, _, motion = started(build(four_bar(90.0, round(rod, 3), round(rocker, 3))))
    assert multibody.joint_gap(motion) < 1e-13
    assert angle(motion, 0) == pytest.approx(np.pi / 2, abs=1e-4)


def test_a_slider_crank():
    """The slider's place and speed against the formulas of the textbook."""
    bodies = [
        {"name": "crank", "angle_deg": 30.0, "angular_velocity": 5.0} | ROD,
        {"name": "rod"} | ROD,
        {"name": "slider", "position": [2.5, 0.0]} | ROD,
    ]
    del bodies[2]["position"]
    joints = [
        pin("a", "world", "crank", [0, 0], [-0.5, 0]),
        pin("b", "crank", "rod", [0.5, 0], [-1, 0]),
        pin("c", "rod", "slider", [1, 0], [0, 0]),
        pin("guide", "world", "slider", [0, 0], [0, 0], "prismatic", axis=[1, 0]),
    ]
    _, _, motion = started(build(scenario(bodies, joints)))
    t = np.radians(30.0)
    reach = np.sqrt(4.0 - np.sin(t) ** 2)
    assert motion.position[2, 0] == pytest.approx(np.cos(t) + reach, abs=1e-12)
    assert motion.linear[2, 0] == pytest.approx(-5.0 * (np.sin(t) + np.sin(t) * np.cos(t) / reach), abs=1e-11)
    assert motion.position[2, 1] == pytest.approx(0.0, abs=1e-13)
    assert motion.angular[2, 2] == pytest.approx(0.0, abs=1e-11)


def test_a_distance_swings_like_a_massless_rod():
    """A point mass on a distance joint is a pendulum: period by the arithmetic-geometric mean."""
    bodies = [{"name": "bob", "mass": 2.0, "inertia": 1e-3, "position": [1.0, 0.0]}]
    joints = [pin("rod", "world", "bob", [0, 0], [0, 0], "distance")]
    multibody, state, _ = started(build(scenario(bodies, joints)))
    a, b = 1.0, np.cos(np.pi / 4)
    for _ in range(30):
        a, b = (a + b) / 2, np.sqrt(a * b)
    period = 2.0 * np.pi / a / np.sqrt(9.81)
    steps = 2000
    for _ in range(steps):
        state, _ = multibody.advance(
            state, period / steps, np.zeros(1), np.zeros((1, 1, 6)), None, integrator=Integrator.RK4
        )
    assert state[:2] == pytest.approx([1.0, 0.0], abs=1e-7)


OPEN = "Correct points and start, or leave out the start of bodies that are to find their place."
WRONG = [
    (four_bar(ground=6.0),
     r'joints\[3\] "c": expected rod and rocker to meet in c \(revolute\) at the start; got a loop that '
     r'stays '
     r"open by 2\.\d+ m \(or rad\), in a mechanism of 6 m\. " + OPEN),
    (four_bar(90.0, 10.0, 90.0),
     r'joints\[3\] "c": expected rod and rocker to meet in c \(revolute\) at the start; got a loop that '
     r'stays '
     r"open by 0\.\d+ m"),
    (four_bar(angular_velocity=40.0),
     r'joints\[3\] "c": expected velocities of rod and rocker that keep c closed; got some that open it '
     r'at \d+'),
    (scenario(
        [{"name": "a"} | ROD, {"name": "b"} | ROD],
        [pin("h", "a", "b", [1, 0], [-1, 0]), pin("k", "a", "b", [1, 0], [-1, 0], "planar")]),
     r'joints\[1\] "k".type: expected fixed, revolute, prismatic or distance, because b is carried by '
     r'another '
     r'joint, so that k closes a loop; got "planar", which keeps nothing\. Remove it\.'),
    (scenario(
        [{"name": "a"} | ROD, {"name": "b"} | ROD],
        [pin("h", "a", "b", [1, 0], [-1, 0]), pin("k", "a", "b", [1, 0], [-1, 0], stiffness=3.0)]),
     r'joints\[1\] "k".stiffness: expected none, because b is carried by another joint, so that k '
     r'closes a loop; '
     r"got 3\.0\. Move the spring to a joint before it in the file\."),
    (scenario([{"name": "a"} | ROD], [pin("d", "world", "a", [0, 0], [0, 0], "distance")]),
     r'joints\[0\] "d": expected two points apart, whose distance d is to keep; got 0 m at the start\.'),
    # a flat parallelogram may go on as one or fold as an antiparallelogram
    (scenario(
        [{"name": "a"} | ROD, {"name": "b"} | ROD, {"name": "c"} | ROD],
        [pin("p1", "world", "a", [0, 0], [-0.5, 0]), pin("p2", "a", "b", [0.5, 0], [-1, 0]),
         pin("p3", "world", "c", [2, 0], [-0.5, 0]), pin("p4", "b", "c", [1, 0], [0.5, 0])]),
     r'joints\[3\] "p4": expected a start from which the motion is settled; got a singular one, in which the '
     r"loops keep 1 directions and a little further 2\. Start in another position\."),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "line"), WRONG)
def test_a_wrong_loop_gets_its_line(wrong, line):
    with pytest.raises(MechanismError, match=r"^case\.toml: " + line):
        build(wrong)


def test_bricard_with_its_redundant_row():
    """IFToMM A04: six hinges, six bodies with the ground, one equation too many; computed value at 1 s."""
    across = np.eye(3)[[1, 2, 0, 1, 2, 0]]
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, -1, 0], [1, -1, 1], [0, -1, 1], [0, 0, 1]], float)
    axes = [0, 1, 2, 0, 1]  # along which each rod lies
    bodies, joints = [], []
    for i, name in enumerate("abcde"):
        inertia = [1.01 / 12 * (k != axes[i]) + (k == axes[i]) / 600 for k in range(3)] + [0, 0, 0]
        middle = (corners[i] + corners[i + 1]) / 2
        place = {} if i else {"position": middle.tolist()}
        bodies.append({"name": name, "mass": 1.0, "inertia": inertia} | place)
        parent = ("world", *"abcde")[i]
        hold = corners[i] if i == 0 else corners[i] - (corners[i - 1] + corners[i]) / 2
        held = (corners[i] - middle).tolist()
        joints.append(pin(f"j{i}", parent, name, hold.tolist(), held, axis=across[i].tolist()))
    last = (corners[5] - (corners[4] + corners[5]) / 2).tolist()
    joints.append(pin("j5", "world", "e", corners[5].tolist(), last, axis=across[5].tolist()))
    multibody, state, motion = started(build(scenario(bodies, joints)))
    assert multibody.rows == multibody.nv == 5
    for _ in range(1000):
        state, _ = multibody.advance(
            state, 1e-3, np.zeros(1), np.zeros((1, 5, 6)), None, integrator=Integrator.RK4
        )
    multibody.motion(state, motion)
    w, *xyz = motion.orientation[2]
    arm, u = np.array([0.0, 0.0, 0.5]), np.array(xyz)
    corner = motion.position[2] + arm + 2 * np.cross(u, np.cross(u, arm) + w * arm)
    assert corner == pytest.approx([0.51050146, -1.64916760, 0.14012311], abs=1e-8)
    assert multibody.joint_gap(motion) < 1e-13
