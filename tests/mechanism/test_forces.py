"""Force elements of a scenario: what the core gets, what is refused."""

import json

import numpy as np
import pytest

from linkwind.dynamics.methods import multibody
from linkwind.errors import MechanismError, ScenarioError
from linkwind.mechanism import build
from linkwind.scenario import from_json

BODY = {"name": "ball", "mass": 1.0, "inertia": 0.1, "position": [3.0, 4.0]}
SPRING = {"type": "spring", "name": "tether", "parent": "world", "child": "ball", "stiffness": 2.0}


def scenario(*forces, **more):
    data = {"name": "case", "time": {"end": 1.0}, "bodies": [BODY], "forces": list(forces)}
    return from_json(json.dumps(data | more), "case.toml")


def test_a_spring_is_at_rest_as_it_starts_unless_it_says_so():
    tables = build(
        scenario(SPRING, SPRING | {"name": "other", "rest": 1.0, "child_point": [0.0, -4.0]})
    ).tables
    assert tables.force_body.tolist() == [[-1, 0], [-1, 0]]
    np.testing.assert_allclose(tables.force_number, [[2.0, 0.0, 5.0], [2.0, 0.0, 1.0]], rtol=1e-15)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"parent_point": [3.0, 4.0]},
            r'forces\[0\] "tether": expected ends apart, because tether pulls .* got 0 m',
        ),
        ({"child_point": [0, 0, 1.0]}, r'forces\[0\] "tether"\.child_point: expected z = 0'),
    ],
)
def test_springs_that_do_not_fit_are_refused(change, message):
    with pytest.raises(MechanismError, match=message):
        build(scenario(SPRING | change))


@pytest.mark.parametrize(
    ("forces", "message"),
    [
        (
            [SPRING | {"child": "bal"}],
            r'forces\[0\] "tether"\.child: expected one of the bodies .*Use "ball"',
        ),
        (
            [SPRING | {"child": "world"}],
            r'forces\[0\] "tether"\.child: expected another body than the parent',
        ),
        ([SPRING, SPRING], r"forces\[1\]\.name: expected a name of its own"),
        (
            [SPRING | {"stiffness": -1.0}],
            r'forces\[0\] "tether"\.stiffness: expected a number of at least 0 \[N/m\]',
        ),
        ([SPRING | {"stifness": 1.0}], r'stifness: expected a key among .*Use "stiffness"'),
    ],
)
def test_wrong_entries_are_refused(forces, message):
    with pytest.raises(ScenarioError, match=message):
        scenario(*forces)


def test_the_paper_has_no_force_elements():
    dynamics = {"method": "incremental", "integrator": "euler"}
    case = scenario(SPRING, dynamics=dynamics)
    with pytest.raises(MechanismError, match=r'dynamics\.method: force "tether": expected none'):
        multibody(build(case), case)
