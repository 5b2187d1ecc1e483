"""Events from a scenario: what they become, and which are refused."""

import json

import pytest

from linkwind.errors import LinkwindError
from linkwind.mechanism import build
from linkwind.native.multibody import ACTIONS, OCCASIONS
from linkwind.scenario import from_json

BODIES = [{"name": name, "mass": 1.0, "inertia": 0.1} for name in "abc"]
ENDS = {"parent_point": [1, 0], "child_point": [-1, 0]}
HINGES = [
    {"name": "ab", "type": "revolute", "parent": "a", "child": "b"} | ENDS,
    {"name": "bc", "type": "revolute", "parent": "b", "child": "c"} | ENDS,
    {"name": "ac", "type": "distance", "parent": "a", "child": "c"},
]


def scenario(*events, joints=HINGES):
    data = {"name": "case", "time": {"end": 1.0}, "bodies": BODIES, "joints": joints, "events": list(events)}
    return from_json(json.dumps(data))


def event(**stated):
    return {"name": "e", "joint": "bc", "action": "release"} | stated


def test_events_come_in_order_and_stops_after_them():
    stopped = [HINGES[0] | {"stop": [-0.5, 1.5], "restitution": 0.3}, *HINGES[1:]]
    mechanism = build(
        scenario(
            event(name="later", at=0.25),
            event(name="strained", joint="ac", when="force", above=7.0),
            event(name="told", action="lock"),
            joints=stopped,
        )
    )
    tables = mechanism.tables
    assert mechanism.events == ("later", "strained", "told", "ab.low", "ab.high")
    assert tables.event_joint.tolist() == [2, 3, 2, 1, 1]
    assert tables.event_action.tolist() == [
        ACTIONS[a] for a in ("release", "release", "lock", "stop", "stop")
    ]
    assert tables.event_occasion.tolist() == [
        OCCASIONS[o] for o in ("time", "force", "command", "position", "position")
    ]
    assert tables.event_side.tolist() == [1, 1, -1, -1, 1]
    assert tables.event_threshold.tolist() == [0.25, 7.0, 0.0, -0.5, 1.5]
    assert tables.event_restitution.tolist() == [0.0, 0.0, 0.0, 0.3, 0.3]


def test_only_joints_that_may_be_released_have_room():
    plain, roomy = build(scenario()), build(scenario(event(at=0.1)))
    assert len(roomy.q0) == len(plain.q0) + 6
    assert len(roomy.v0) == len(plain.v0) + 5
    locked = build(scenario(event(action="lock", at=0.1)))
    assert len(locked.q0) == len(plain.q0)


WRONG = [
    ([event(joint="bd")], 'events[0] "e".joint: expected one of the joints ab, bc, ac; got "bd". Use one of '
     'these.'),
    ([event(at=0.1, when="force", above=1.0)],
     'events[0] "e".at: expected a time (at) or a condition (when), not both; got at besides when. '
     "Write two events, or remove one of them."),
    ([event(when="force")],
     'events[0] "e".when: expected one of above and below with it; got neither. Write for example '
     'when = "force", above = 10.0.'),
    ([event(above=3.0)],
     'events[0] "e".above: expected when besides it; got nothing. '
     'Add for example when = "force", or remove above.'),
    ([event(joint="ac", when="position", above=1.0)],
     'events[0] "e".when: expected force, torque or distance, because ac (distance) has no single '
     'coordinate; '
     'got "position". Choose another.'),
    ([event(), event()],
     'events[1].name: expected a name of its own (events[0] has it); got "e". Rename one of the two.'),
    ([event(joint="ac", action="lock", at=0.1)],
     'events[0] "e".action: expected release, because ac closes a loop; got "lock". Move ac before the other '
     "joint of its child in the file, so that that one closes the loop."),
]  # fmt: skip


@pytest.mark.parametrize(("events", "line"), WRONG)
def test_a_wrong_event_gets_its_line(events, line):
    with pytest.raises(LinkwindError) as caught:
        build(scenario(*events))
    assert str(caught.value).split(": ", 1)[1] == line


def test_wrong_stops_get_their_line():
    for stop, line in (
        (
            [1.0, -1.0],
            'joints[0] "ab".stop: expected two numbers, the lower one first; got [1.0, -1.0]. Swap them.',
        ),
        ([1.0], 'joints[0] "ab".stop: expected a list of 2 numbers; got [1.0]. Write [lowest, highest].'),
    ):
        with pytest.raises(LinkwindError) as caught:
            build(scenario(joints=[HINGES[0] | {"stop": stop}]))
        assert str(caught.value).split(": ", 1)[1] == line
    with pytest.raises(
        LinkwindError, match=r'joints\[2\] "ac"\.stop: expected none, because ac \(distance\) has no'
    ):
        build(scenario(joints=[*HINGES[:2], HINGES[2] | {"stop": [0, 1]}]))


@pytest.mark.parametrize(
    ("stop", "angle", "refused"),
    [
        ([0.5, 1.5], 0.0, True),
        ([0.5, 1.5], 57.2957795131, False),
        ([-2.0, -0.5], 0.0, True),
        ([0.0, 1.0], 0.0, False),
        ([0.0, 1.0], 57.29577951308233, False),
        ([3.0, 4.0], 200.0, False),
        ([3.0, 4.0], -160.0, True),
    ],
)
def test_a_joint_that_starts_beyond_a_stop_is_refused(stop, angle, refused):
    """There it would stay for ever. Angles are as stated: -160° is not 200°, though it looks alike."""
    bodies = [BODIES[0], BODIES[1] | {"angle_deg": angle}, BODIES[2] | {"angle_deg": 0.0}]
    data = {"name": "case", "time": {"end": 1.0}, "bodies": bodies}
    text = json.dumps(data | {"joints": [HINGES[0] | {"stop": stop}, HINGES[1]]})
    if not refused:
        build(from_json(text))
        return
    expected = r'joints\[0\] "ab".stop: expected the start between them, at .* rad; got'
    with pytest.raises(LinkwindError, match=expected):
        build(from_json(text))
