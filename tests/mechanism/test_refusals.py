"""What does not make a mechanism gets one exact line."""

import json

import pytest

from linkwind.errors import MechanismError
from linkwind.mechanism import build
from linkwind.scenario import from_json, load

SPATIAL = [1, 2, 2.5, 0, 0, 0]


def pair(kind, inertia=1.0, child=None, **joint):
    """Two bodies, the second on a joint whose points are 1 m from both."""
    bodies = [
        {"name": "a", "mass": 1, "inertia": inertia},
        {"name": "b", "mass": 1, "inertia": inertia} | (child or {}),
    ]
    points = {"parent_point": [1, 0, 0], "child_point": [-1, 0, 0]}
    joints = [{"name": "j", "type": kind, "parent": "a", "child": "b"} | points | joint]
    data = {"name": "case", "time": {"end": 1.0}, "bodies": bodies, "joints": joints}
    return from_json(json.dumps(data))


LEAVE = "Leave it out, or correct it."
NUMBER = "because every inertia is a single number"
SIX = "6 numbers for the inertia of each body."

WRONG = [
    (pair("revolute", child={"position": [2.5, 0]}),
     'bodies[1] "b".position: expected [2, 0, 0] m, as j (revolute) demands; '
     f"got [2.5, 0, 0] m, 0.5 m off. {LEAVE}"),
    (pair("revolute", child={"angle_deg": 90, "position": [1, 1.25]}),
     f'bodies[1] "b".position: expected [1, 1, 0] m, as j (revolute) demands; '
     f"got [1, 1.25, 0] m, 0.25 m off. {LEAVE}"),
    (pair("revolute", child={"angular_velocity": 2, "velocity": [0, 1]}),
     'bodies[1] "b".velocity: expected [0, 2, 0] m/s, as j (revolute) demands; got [0, 1, 0] m/s, 1 m/s off. '
     f"{LEAVE}"),
    (pair("revolute", child={"angular_velocity": [0, 3, 2]}),
     'bodies[1] "b".angular_velocity: expected [0, 0, 2] rad/s, as j (revolute) demands; '
     f"got [0, 3, 2] rad/s, 3 rad/s off. {LEAVE}"),
    (pair("prismatic", axis=[1, 0], child={"position": [5, 0.5]}),
     f'bodies[1] "b".position: expected [5, 0, 0] m, as j (prismatic) demands; '
     f"got [5, 0.5, 0] m, 0.5 m off. {LEAVE}"),
    (pair("prismatic", axis=[1, 0], child={"angular_velocity": 1}),
     'bodies[1] "b".angular_velocity: expected [0, 0, 0] rad/s, as j (prismatic) demands; '
     f"got [0, 0, 1] rad/s, 1 rad/s off. {LEAVE}"),
    (pair("fixed", child={"velocity": [1, 0]}),
     f'bodies[1] "b".velocity: expected [0, 0, 0] m/s, as j (fixed) demands; '
     f"got [1, 0, 0] m/s, 1 m/s off. {LEAVE}"),
    (pair("planar", child={"position": [2, 0, 1]}),
     f'bodies[1] "b".position: expected [2, 0, 0] m, as j (planar) demands; got [2, 0, 1] m, 1 m off. '
     f'{LEAVE}'),
    (pair("revolute", child={"orientation": [0.6, 0.8, 0, 0]}),
     "bodies[1] \"b\": expected an orientation that differs from the parent's by a turn about the axis of j; "
     "got one that is 106.26° off. Correct it, or the joint's axis."),
    (load("two_link_free", ["name=case", "bodies.0.position=[0, 0, 1]"]),
     'bodies[0] "link1".position: expected [0, 0, 0] m, as world-link1 (planar) demands; got [0, 0, 1] '
     'm, 1 m off. '
     f"{LEAVE}"),
    # out of the plane
    (pair("spherical"),
     f'joints[0] "j".type: expected fixed, revolute, prismatic, planar or distance, {NUMBER}; '
     f'got "spherical". Give {SIX}'),
    (pair("free"),
     f'joints[0] "j".type: expected fixed, revolute, prismatic, planar or distance, {NUMBER}; '
     f'got "free". Give {SIX}'),
    (pair("revolute", axis=[0, 1, 1]),
     f'joints[0] "j".axis: expected an axis along z, {NUMBER}; got [0, 1, 1]. Leave it out, or give {SIX}'),
    (pair("prismatic"),
     f'joints[0] "j".axis: expected an axis in the x, y plane, {NUMBER}; got [0, 0, 1]. '
     f"Use for example [1, 0, 0], or give {SIX}"),
    # springs and dampers
    (pair("revolute", stiffness=[1, 2]),
     'joints[0] "j".stiffness: expected one number, or a list of 1, for a revolute joint; '
     "got [1.0, 2.0]. Correct it."),
    (pair("fixed", damping=2),
     'joints[0] "j".damping: expected nothing for a fixed joint; got 2.0. Correct it.'),
    (pair("planar", rest=1),
     'joints[0] "j".rest: expected 3 numbers for a planar joint; got 1.0. Correct it.'),
    (pair("spherical", SPATIAL, rest=[2, 0, 0, 0]),
     'joints[0] "j".rest: expected a unit quaternion [w, x, y, z] at the end for a spherical joint; '
     "got [2.0, 0.0, 0.0, 0.0]. Correct it."),
]  # fmt: skip


@pytest.mark.parametrize(("scenario", "line"), WRONG)
def test_a_wrong_mechanism_gets_its_line(scenario, line):
    with pytest.raises(MechanismError) as error:
        build(scenario)
    assert str(error.value) == f"{scenario.source}: {line}"


def test_springs_and_dampers():
    tables = build(pair("revolute", stiffness=3, damping=[0.5], rest=0.2)).tables
    assert tables.stiffness.tolist() == [0, 0, 0, 3]
    assert tables.damping.tolist() == [0, 0, 0, 0.5]
    assert tables.rest.tolist() == [0, 0, 0, 0.2]
    tables = build(pair("free", SPATIAL, stiffness=2, rest=[1, 2, 3, 0.6, 0.8, 0, 0])).tables
    assert tables.stiffness.tolist() == [0] * 6 + [2] * 6
    assert tables.rest.tolist() == [0, 0, 0, 1, 0, 0, 0, 1, 2, 3, 0.6, 0.8, 0, 0]


def test_a_stated_position_that_agrees_is_accepted_and_changes_nothing():
    stated = build(pair("revolute", child={"position": [2, 0], "velocity": [0, 0]}))
    left_out = build(pair("revolute"))
    assert stated.q0.tolist() == left_out.q0.tolist()
    assert stated.v0.tolist() == left_out.v0.tolist()
