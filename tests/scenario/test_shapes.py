"""Shapes: what a file may say, and the outlines against formulas for area and distance."""

import numpy as np
import pytest

from linkwind.errors import ScenarioError
from linkwind.scenario import from_json, loads
from linkwind.scenario.shapes import shape_of, signed_area
from tests.scenario.texts import SMALL, TWO_LINK, edited

PLATE = 'shape = { type = "plate", length = 0.5, span = 1.0 }'
TRIANGLE = [[-0.1, -0.1], [0.2, -0.1], [-0.1, 0.2]]
DART = [[0.2, 0.0], [-0.1, 0.1], [0.0, 0.0], [-0.1, -0.1]]  # not convex
KINDS = {
    "plate": ({"length": 0.5}, 0.0, 0.5),
    "ellipse": ({"length": 0.5, "width": 0.2}, np.pi * 0.25 * 0.1, 0.5),
    "circle": ({"diameter": 0.3}, np.pi * 0.15**2, 0.3),
    "rectangle": ({"length": 0.5, "width": 0.2}, 0.1, 0.5),
    "polygon": ({"points": TRIANGLE}, 0.045, 0.3 * np.sqrt(2.0)),
}


def body(text):
    return loads(SMALL + f"shape = {text}\n", "s.toml").bodies[0]


def made(kind, **values):
    return shape_of({"type": kind, **KINDS[kind][0], **values})


@pytest.mark.parametrize("kind", KINDS)
def test_area_reference_length_and_span(kind):
    values, area, length = KINDS[kind]
    shape = shape_of({"type": kind, **values})
    assert signed_area(shape.outline(2000)) == pytest.approx(area, rel=1e-5)
    assert shape.reference_length == pytest.approx(length)
    assert shape.span == 1.0
    assert shape.closed == (kind != "plate")


@pytest.mark.parametrize("kind", ["plate", "ellipse", "circle"])
def test_an_outline_has_the_points_that_were_asked_for(kind):
    assert made(kind).outline(10).shape == (10, 2)


def test_an_ellipsoid_is_cut_by_the_plane():
    shape = shape_of({"type": "ellipsoid", "size": [0.5, 0.2, 0.8]})
    assert signed_area(shape.outline(2000)) == pytest.approx(np.pi * 0.25 * 0.1, rel=1e-5)
    assert (shape.reference_length, shape.span) == (0.5, 0.8)
    assert body('{ type = "ellipsoid", size = [0.5, 0.2, 0.8] }').shape == shape


def test_a_wing_has_chords():
    """A delta: its chord falls from 0.6 m in the middle to none at the tips; teeth are met twice."""
    delta = shape_of({"type": "wing", "points": [[0.4, 0.0], [-0.2, -0.5], [-0.2, 0.5]]})
    assert signed_area(delta.planform) == pytest.approx(0.3)
    assert (delta.reference_length, delta.span) == (pytest.approx(0.6), 1.0)
    for z in (-0.4, -0.25, 0.0, 0.1):
        low, high = delta.chord(z)
        assert (low, high) == (pytest.approx(-0.2), pytest.approx(0.4 - 0.6 * abs(z) / 0.5))
    assert delta.chord(0.6) is None

    comb = [[0.0, -0.5], [0.3, 0.5], [0.2, 0.5], [0.0, 0.0], [-0.2, 0.5], [-0.3, 0.5]]
    assert shape_of({"type": "wing", "points": comb}).chord(0.25) is None
    np.testing.assert_array_equal(delta.outline(), [[-0.2, 0.0], [0.4, 0.0]])


def test_rounded_corners_lie_at_their_radius():
    r, half = 0.06, np.array([0.25, 0.1])
    outline = made("rectangle", radius=r).outline(400)
    distance = np.linalg.norm(np.maximum(np.abs(outline) - (half - r), 0.0), axis=1)
    np.testing.assert_allclose(distance, r, rtol=1e-12)
    assert signed_area(outline) == pytest.approx(0.1 - (4.0 - np.pi) * r**2, rel=1e-4)


def test_round_ends_repeat_no_point():
    outline = made("rectangle", radius=0.1).outline(40)
    assert np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).min() > 1e-3
    assert np.abs(outline[:, 0]).max() == pytest.approx(0.25)


@pytest.mark.parametrize("points", [TRIANGLE, DART])
def test_a_polygon_may_run_either_way_around(points):
    one, other = (made("polygon", points=order) for order in (points, points[::-1]))
    assert signed_area(one.outline()) > 0.0
    assert {*map(tuple, one.outline())} == {*map(tuple, other.outline())} == {*map(tuple, points)}
    assert signed_area(other.outline()) == pytest.approx(signed_area(one.outline()))


@pytest.mark.parametrize("kind", KINDS)
def test_a_scenario_keeps_its_shape(kind):
    values = ", ".join(f"{key} = {value}" for key, value in KINDS[kind][0].items())
    scenario = loads(SMALL + f'shape = {{ type = "{kind}", {values}, span = 2 }}\n', "s.toml")
    assert scenario.bodies[0].shape == made(kind, span=2.0)
    assert from_json(scenario.to_json()) == scenario


WRONG = [
    ("{}",
     "type: expected one of plate, wing, ellipse, rectangle, circle, polygon, ellipsoid; "
     "got nothing. Add type."),
    ('{ type = "ellips" }',
     "type: expected one of plate, wing, ellipse, rectangle, circle, polygon, ellipsoid; "
     'got "ellips". Use "ellipse".'),
    ('{ type = "ellipsoid", size = [0.1, 0.1] }',
     "size: expected 3 numbers above 0; got [0.1, 0.1, 0.0]. Correct it."),
    ('{ type = "circle" }', "diameter: expected a value (Diameter [m]); got nothing. Add diameter."),
    ('{ type = "circle", diameter = "1" }',
     'diameter: expected a number [m]; got "1". Write the number alone, without quotes and unit.'),
    ('{ type = "ellipse", length = 1, widht = 1 }',
     'widht: expected a key among type, length, width, span; got "widht". Use "width".'),
    ('{ type = "ellipse", length = 1, width = 0 }',
     "width: expected a number above 0 [m]; got 0. Change the value."),
    ('{ type = "rectangle", length = 1, width = 0.1, radius = 0.06 }',
     "radius: expected at most half the shorter side, 0.05 m; got 0.06. Make it smaller."),
    ('{ type = "polygon", points = [[0, 0], [1, 1]] }',
     "points: expected a list of at least 3 points [x, y]; got [[0, 0], [1, 1]]. "
     "Write [[x, y], [x, y], [x, y]], in the body frame from the centre of mass."),
    ('{ type = "polygon", points = [[0, 0], [1, 0], [1, "a"]] }',
     'points: expected a list of at least 3 points [x, y]; got [1, "a"]. '
     "Write numbers without units or quotes."),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line"), WRONG)
def test_a_wrong_shape_gets_its_line(text, line):
    with pytest.raises(ScenarioError) as error:
        body(text)
    assert str(error.value) == f's.toml: bodies[0] "a".shape.{line}'


@pytest.mark.parametrize(
    ("points", "sides"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], (0, 2)),  # a bow
        ([[0, 0], [2, 0], [2, 1], [1, 0], [0, 1]], (0, 2)),  # a corner on a side
        ([[0, 0], [1, 0], [1, 0], [0, 1]], (0, 1)),  # a corner twice
        ([[0, 0], [2, 0], [1, 0], [1, 1]], (0, 1)),  # back along the same side
        ([[0, 0], [1, 0], [2, 0]], (0, 2)),  # no area
    ],
)
def test_sides_that_meet_are_named(points, sides):
    with pytest.raises(
        ScenarioError, match="points: expected sides that meet only in their corners"
    ) as error:
        body(f'{{ type = "polygon", points = {points} }}')
    named = " and ".join(f"the one from points[{i}] = {[float(x) for x in points[i]]}" for i in sides)
    assert f"; got {named}. " in str(error.value)


def test_the_plate_model_names_what_it_got():
    with pytest.raises(ScenarioError) as error:
        loads(edited(PLATE, 'shape = { type = "circle", diameter = 0.5 }', TWO_LINK), "two_link.toml")
    assert str(error.value) == (
        'two_link.toml: bodies[0] "link1".shape: expected a plate or a wing, which the model of provider '
        '"aero" needs; got type "circle". Write shape = { type = "plate", length = … }.'
    )


def test_an_override_reaches_into_a_shape():
    scenario = loads(TWO_LINK, "two_link.toml", ["bodies.link1.shape.length=0.7"])
    assert scenario.bodies[0].shape.length == 0.7
