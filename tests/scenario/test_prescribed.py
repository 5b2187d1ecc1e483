"""Which bodies move as stated: by a mechanism of each kind."""

import pytest

from linkwind.scenario import load, loads
from linkwind.scenario.prescribed import prescribed

ARM = """
name = "arm"
[time]
end = 1.0
[[bodies]]
name = "base"
mass = 1.0
inertia = 1.0
[[bodies]]
name = "wing"
mass = 1.0
inertia = 1.0
[[joints]]
name = "rail"
type = "prismatic"
parent = "world"
child = "base"
[[joints]]
name = "hinge"
type = "revolute"
parent = "base"
child = "wing"
"""
RAIL = '\n[[forces]]\ntype = "motion"\nname = "a"\njoint = "rail"\nposition = "sin(t)"\n'
HINGE = RAIL.replace('"a"', '"b"').replace("rail", "hinge")
RELEASE = '\n[[events]]\nname = "go"\njoint = "rail"\naction = "release"\nat = 0.5\n'


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (ARM, set()),
        (ARM + RAIL, {"base"}),
        (ARM + HINGE, set()),  # on a body that is free to move
        (ARM + RAIL + HINGE, {"base", "wing"}),
        (ARM.replace("prismatic", "fixed") + HINGE + RELEASE, set()),
        (ARM.replace("prismatic", "fixed") + HINGE, {"base", "wing"}),
        (ARM.replace("prismatic", "planar") + RAIL + HINGE, set()),  # two coordinates of the base are free
    ],
)
def test_joints_that_are_driven_all_the_way_from_the_world(text, expected):
    assert prescribed(loads(text, "arm")) == expected


def test_the_wings_of_a_fly_that_is_free_are_not_prescribed():
    assert prescribed(load("fruit_fly")) == set()
