"""What is perhaps not what was meant: what everybody writes by mistake, and what is good."""

import pytest

from linkwind.mechanism.doubts import doubts
from linkwind.scenario import builtin_names, load, loads

ROTOR = """
name = "rotor"
[time]
end = 2.0
[[bodies]]
name = "blade"
mass = 1.0
inertia = 1.0
position = [0.0, 0.0]
[[joints]]
name = "hub"
type = "revolute"
parent = "world"
child = "blade"
[[forces]]
type = "motion"
name = "drive"
joint = "hub"
position = "0.5*sin(2*pi*5*t)"
"""


def told(*changes):
    return list(doubts(loads(ROTOR, "rotor.toml", list(changes))))


@pytest.mark.parametrize(
    ("position", "expected"),
    [
        ('"30*sin(2*pi*5*t)"', "to and fro through 60 rad, 9.5 turns. If it is meant in degrees, multiply"),
        ("{ table = [[0, 0], [0.25, 40], [0.75, -40], [1, 0]], periodic = true }", "fro through 80"),
        ('"5*sin(2*pi*5*t)"', "to and fro through 10 rad"),
        ('"3*sin(2*pi*5*t)"', None),  # less than a turn
        ('"2*pi*50*t + 0.1*sin(2*pi*5*t)"', None),  # a propeller
        ('"-2*pi*50*t"', None),
        ('"0.3"', None),
        ('"0.2*sqrt(t*t)"', None),  # no second derivative at 0
    ],
)
def test_an_angle_that_looks_like_degrees(position, expected):
    found = told(f"forces.drive.position={position}")
    assert bool(found) == (expected is not None), found
    assert expected is None or 'forces[0] "drive".position: it goes to' in found[0]
    assert expected is None or expected in found[0]


@pytest.mark.parametrize(
    ("mass", "inertia", "length", "told_of"),
    [
        (0.05, 0.05 * 0.2**2 / 12, 0.2, False),  # a rod
        (0.05, 0.05 * 0.2**2 / 12, 200.0, True),  # in mm
        (50.0, 0.05 * 0.2**2 / 12, 0.2, True),  # in g
        (0.05, 50.0 * 200.0**2 / 12, 0.2, True),  # in g·mm²
        (2.0, 1.4, 0.5, False),  # the paper's links
    ],
)
def test_a_body_in_other_units(mass, inertia, length, told_of):
    shape = f"{{ type = 'plate', length = {length} }}"
    blade = {"mass": mass, "inertia": inertia, "shape": shape}
    found = told(*(f"bodies.blade.{key}={value}" for key, value in blade.items()))
    assert bool(found) == told_of, found
    assert not told_of or 'rotor.toml: bodies[0] "blade".inertia: ' in found[0]


@pytest.mark.parametrize(("period", "told_of"), [(0.2, False), (20.0, False), (200.0, True)])
def test_a_table_in_milliseconds(period, told_of):
    rows = [[0.0, 0.0], [0.25 * period, 0.5], [0.75 * period, -0.5], [period, 0.0]]
    found = told(f"forces.drive.position={{ table = {rows}, periodic = true }}")
    assert bool(found) == told_of
    assert not told_of or "position.table: it begins again after 200 s, and the run takes 2 s" in found[0]


def test_the_angle_of_a_planar_joint_may_be_in_degrees():
    plane = ("joints.hub.type=planar", 'forces.drive.position="30*sin(t*10)"')
    assert told(*plane, "forces.drive.coordinate=0") == []
    assert "If it is meant in degrees" in told(*plane, "forces.drive.coordinate=2")[0]


def test_metres_are_not_taken_for_degrees():
    assert (
        told("joints.hub.type=prismatic", "joints.hub.axis=[1,0,0]", 'forces.drive.position="30*sin(t)"')
        == []
    )


@pytest.mark.parametrize(("step", "expected"), [(0.05, True), (0.04, True), (0.025, False), (0.02, False)])
def test_a_beat_of_few_steps(step, expected):
    """Of a sine of 5 Hz, 8 steps a beat are 0.025 s: a sampling at its own rhythm does not hide it."""
    found = told(f"coupling.step={step}")
    assert bool(found) == expected
    if expected:
        assert f"as fast as in a beat of 0.2 s, which takes {0.2 / step:.2g} steps of {step:g} s" in found[0]
        assert "Use a coupling.step of 0.025 s or less." in found[0]


def test_a_beat_as_long_as_a_step_is_seen():
    assert len(told("coupling.step=0.2", "time.end=4", 'forces.drive.position="0.5*sin(2*pi*5*t)"')) == 1


@pytest.mark.parametrize("name", builtin_names())
def test_the_built_in_motions_are_no_doubt(name):
    assert list(doubts(load(name))) == []
