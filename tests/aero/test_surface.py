"""Where the markers of bodies in space lie: how far apart and drawn in, and at edges that bodies share."""

import numpy as np
import pytest

from linkwind.aero.flow.nearness import distance, from_line, inside
from linkwind.aero.flow.outline import SPACING, inset
from linkwind.aero.flow.rings import CLOSEST
from linkwind.aero.flow.surface import CLOSED_INSET, EDGE_INSET, surface_markers
from linkwind.scenario.bodies import Body, Joint

CELL = 0.25
VISCOSITY = 0.01
AT_REST = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
FREE, CLOSED = inset(EDGE_INSET, VISCOSITY), inset(CLOSED_INSET, VISCOSITY)


def body(shape, name="body"):
    return Body(name=name, mass=1.0, inertia=1.0, shape=shape)


def plate(chord, span, name="body"):
    """A plate of a size in cells."""
    return body({"type": "plate", "length": chord * CELL, "span": span * CELL}, name)


def cells(size):
    return tuple(CELL * length for length in size)


def alone(shape, viscosity=VISCOSITY):
    return surface_markers([body(shape)], [], AT_REST[None], CELL, viscosity)


def nearest(points):
    """The distance of each point to the nearest other one."""
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(apart, np.inf)
    return apart.min(axis=1)


def test_a_plate_is_a_grid_drawn_in_at_its_free_edges():
    markers = surface_markers([plate(24, 60)], [], AT_REST[None], CELL, VISCOSITY)
    low, high = markers.point.min(axis=0), markers.point.max(axis=0)
    np.testing.assert_allclose(high, [12 - FREE, 0, 30 - FREE])
    np.testing.assert_allclose(low, -high)
    chord, span = (round((size - 2 * FREE) / SPACING) for size in (24, 60))  # patches
    assert len(markers.body) == (chord + 1) * (span + 1)
    assert len(markers.face) == chord * span
    assert np.abs(nearest(markers.point) - SPACING).max() < 0.05
    sides = markers.point[markers.face] - markers.point[np.roll(markers.face, 1, axis=1)]
    assert np.linalg.norm(sides, axis=2).max() < SPACING + 0.05  # corners follow each other around the patch


def test_a_small_plate_keeps_two_markers_each_way():
    markers = surface_markers([plate(3, 3)], [], AT_REST[None], CELL, 1e-6)
    assert inset(EDGE_INSET, 1e-6) > 1.5  # more than there is
    half = SPACING / 2
    np.testing.assert_allclose(np.abs(markers.point), np.tile([half, 0, half], (4, 1)))


def hinged(parent, child, parent_point, child_point, kind="revolute"):
    axis = (0.0, 0.0, 1.0)
    return Joint(
        name="joint", type=kind, parent=parent.name, child=child.name, axis=axis,
        parent_point=parent_point, child_point=child_point,
    )  # fmt: skip


@pytest.mark.parametrize("kind", ["revolute", "spherical"])
def test_the_edge_of_a_hinge_is_drawn_in_by_half_the_distance_of_markers(kind):
    one, two = plate(20, 12, "one"), plate(10, 12, "two")
    joint = hinged(one, two, (10 * CELL, 0.0, 0.0), (-5 * CELL, 0.0, 0.0), kind)
    turned = np.array([10 * CELL, 5 * CELL, 0.0, np.cos(np.pi / 4), 0.0, 0.0, np.sin(np.pi / 4)])
    markers = surface_markers([one, two], [joint], np.array([AT_REST, turned]), CELL, VISCOSITY)
    first, second = (markers.point[markers.body == k] for k in (0, 1))
    np.testing.assert_allclose([first[:, 0].min(), first[:, 0].max()], [FREE - 10, 10 - SPACING / 2])
    np.testing.assert_allclose([second[:, 0].min(), second[:, 0].max()], [SPACING / 2 - 5, 5 - FREE])
    for point in (first, second):
        np.testing.assert_allclose(np.abs(point[:, 2]).max(), 6 - FREE)
    assert np.array_equal(markers.joined, [[0, 1], [1, 0]])
    apart = surface_markers([one, two], [], np.array([AT_REST, turned]), CELL, VISCOSITY)
    assert apart.point[apart.body == 0][:, 0].max() == pytest.approx(10 - FREE)  # free without a joint


def test_only_that_part_of_an_edge_is_not_free_which_lies_on_the_other_body():
    """A fin of 8 cells at the end, 20 cells high, of a plate of 40 by 20 cells, which it meets in a line."""
    hull, fin = plate(40, 20, "hull"), plate(8, 20, "fin")
    upright = np.array([16 * CELL, 10 * CELL, 10 * CELL, np.sqrt(0.5), np.sqrt(0.5), 0.0, 0.0])
    joint = hinged(hull, fin, (16 * CELL, 0.0, 10 * CELL), (0.0, 0.0, 10 * CELL), "fixed")
    markers = surface_markers([hull, fin], [joint], np.array([AT_REST, upright]), CELL, VISCOSITY)
    hull_at, fin_at = (markers.point[markers.body == k] for k in (0, 1))
    columns = markers.face[0, 3] - markers.face[0, 0]
    along, _, reached = hull_at.reshape(-1, columns, 3)[-1].T
    under = (along > 12) & (along < 20)
    assert 5 < under.sum() < 9
    np.testing.assert_allclose(reached[under], 10 - SPACING / 2)
    np.testing.assert_allclose(reached[along < 11], 10 - FREE)
    np.testing.assert_allclose([fin_at[:, 2].min(), fin_at[:, 2].max()], [FREE - 10, 10 - SPACING / 2])


def wing(points, name="body"):
    """A wing whose corners are in cells."""
    return body({"type": "wing", "points": (CELL * np.array(points, float)).tolist()}, name)


TURN = np.linspace(0, 2 * np.pi, 48, endpoint=False)
DISC = 10 * np.column_stack([np.cos(TURN), np.sin(TURN)])
DELTA = [[-8, -8], [-8, 8], [8, 0]]  # from z towards x: the other way around
SWEPT = [[0, 0], [3, 14], [-3, 14], [-9, 0], [-3, -14], [3, -14]]
NECK = [[-1, 0], [1, 0], [1, 6], [5, 9], [5, 20], [-5, 20], [-5, 9], [-1, 6]]
WAIST = [[-5, 0], [5, 0], [0.8, 7], [0.8, 12], [5, 18], [-5, 18], [-0.8, 12], [-0.8, 7]]


def markers_of(points, viscosity=VISCOSITY):
    return surface_markers([wing(points)], [], AT_REST[None], CELL, viscosity)


def test_a_rectangular_wing_has_the_markers_of_a_plate():
    made = markers_of([[-12, -30], [12, -30], [12, 30], [-12, 30]]).point
    wanted = surface_markers([plate(24, 60)], [], AT_REST[None], CELL, VISCOSITY).point
    assert len(made) == len(wanted)
    off = np.linalg.norm(made[:, None] - wanted, axis=2).min(axis=1)
    assert off.max() < 1e-6


@pytest.mark.parametrize("points", [DISC, DELTA, SWEPT, NECK, WAIST])
@pytest.mark.parametrize("viscosity", [0.1, VISCOSITY, 1e-5])
def test_markers_of_a_wing_are_spread_evenly_and_drawn_in(points, viscosity):
    found = markers_of(points, viscosity)
    spread, flat = nearest(found.point), found.point[:, ::2]
    assert not found.point[:, 1].any()
    assert spread.min() >= CLOSEST
    assert spread.max() < 1.35 * SPACING
    corners = np.array(points, float)
    assert inside(corners, flat).all()
    drawn = inset(EDGE_INSET, viscosity)
    if points is not NECK and points is not WAIST:  # whose narrow parts have a row all the same
        assert from_line(corners, flat).min() > min(drawn, 1.4) - 0.02
    rng = np.random.default_rng(2)
    tried = rng.uniform(corners.min(axis=0), corners.max(axis=0), size=(4000, 2))
    tried = tried[inside(corners, tried)]
    tried = tried[from_line(corners, tried) > drawn + SPACING]
    holes = np.linalg.norm(flat[:, None] - tried, axis=2).min(axis=0)
    assert holes.max(initial=0.0) < 1.15


def test_a_disc_has_as_many_markers_as_its_area_asks_for():
    points = markers_of(DISC).point
    rim = np.hypot(*points[:, ::2].T).max()
    assert rim == pytest.approx(10 - FREE, abs=0.05)
    within = np.pi * rim**2 / SPACING**2 + np.pi * rim / SPACING  # half of the rim's lie outside their share
    assert len(points) == pytest.approx(within, rel=0.05)


def test_patches_of_a_wing_lie_flat_on_it_and_do_not_cover_more():
    found = markers_of(DISC)
    a, b, c, d = np.moveaxis(found.point[found.face][:, :, ::2], 1, 0)
    area = 0.5 * np.abs(_cross(c - a, d - b))
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (a, c))]
    assert max(side.max() for side in sides) < 2.5
    assert area.min() > 0.2
    assert 0.7 < area.sum() / (np.pi * (10 - FREE) ** 2) < 1.0


def _cross(u, v):
    return u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]


def test_a_narrow_part_between_wide_ones_keeps_a_row_in_its_middle():
    flat = markers_of(WAIST).point[:, ::2]
    neck = flat[(flat[:, 1] > 7) & (flat[:, 1] < 12)]
    assert np.abs(neck[:, 0]).max() < 0.3
    assert len(neck) == pytest.approx(5 / SPACING, abs=1)


@pytest.mark.parametrize("width", [0.4, 1.8])
def test_a_wing_that_is_narrow_everywhere_keeps_one_row_or_two(width):
    half = width / 2
    flat = markers_of([[-half, 0], [half, 0], [half, 16], [-half, 16]]).point[:, ::2]
    rows = 1 if width < CLOSEST else 2
    assert len(flat) == pytest.approx(rows * (1 + 16 / SPACING), abs=rows)
    assert np.ptp(flat[:, 1]) > 14


def test_the_edge_of_a_wing_on_another_body_is_drawn_in_by_half_the_distance_of_markers():
    one = wing([[-8, 0], [8, 0], [4, 20], [-8, 20]], "one")
    two = plate(16, 12, "two")
    joint = hinged(one, two, (0.0, 0.0, 0.0), (0.0, 0.0, 6 * CELL))
    below = np.array([0.0, 0.0, -6 * CELL, 1.0, 0.0, 0.0, 0.0])
    markers = surface_markers([one, two], [joint], np.array([AT_REST, below]), CELL, VISCOSITY)
    first, second = (markers.point[markers.body == k] for k in (0, 1))
    np.testing.assert_allclose([first[:, 2].min(), first[:, 2].max()], [SPACING / 2, 20 - FREE], atol=0.02)
    assert second[:, 2].max() == pytest.approx(6 - SPACING / 2)
    free = surface_markers([one, two], [], np.array([AT_REST, below]), CELL, VISCOSITY)
    assert free.point[free.body == 0][:, 2].min() == pytest.approx(FREE, abs=0.02)


@pytest.mark.parametrize(
    "shape",
    [
        {"type": "circle", "diameter": 12 * CELL, "span": 9 * CELL},
        {"type": "rectangle", "length": 12 * CELL, "width": 7 * CELL, "span": 20 * CELL},
    ],
)
def test_a_cylinder_is_closed_at_its_ends(shape):
    markers, span = alone(shape), shape["span"] / CELL
    level = markers.point[:, 2]
    assert level.max() == pytest.approx(span / 2 - CLOSED)
    assert level.min() == -level.max()
    assert len(np.unique(level)) == 1 + round((span - 2 * CLOSED) / SPACING)
    deep = np.array([distance(body(shape).shape, CELL * point[None])[0] for point in markers.point])
    assert not deep.any()  # all are inside
    spread = nearest(markers.point)
    assert spread.min() > SPACING / 2**0.5 - 0.01  # around a corner
    assert spread.max() < 1.2 * SPACING
    top = markers.point[level == level.max()][:, :2]
    rng = np.random.default_rng(1)
    tried = rng.uniform(-1, 1, size=(2000, 2)) * top.max(axis=0)
    if shape["type"] == "circle":
        tried = tried[np.hypot(*tried.T) < top.max()]
    assert max(np.linalg.norm(top - point, axis=1).min() for point in tried) < 1.3  # no holes in the end
    assert (
        len(markers.face) == len(np.unique(markers.face)) - (level == level.min())[markers.face[:, 0]].sum()
    )


@pytest.mark.parametrize("size", [(24, 24, 24), (24, 12, 8), (24, 24, 5), (5, 40, 6), (6, 5, 30)])
def test_markers_of_an_ellipsoid_are_spread_evenly_and_drawn_in_along_its_normals(size):
    viscosity = 0.1  # drawn in by the least: by more than that, tips 5 cells thick would be all curvature
    drawn, half = inset(CLOSED_INSET, viscosity), np.array(size) / 2
    markers = alone({"type": "ellipsoid", "size": cells(size)}, viscosity)
    points = markers.point
    spread = nearest(points)
    assert spread.min() >= CLOSEST - 1e-9
    assert spread.max() < 1.2 * SPACING
    assert np.abs(points).max(axis=0) == pytest.approx(half - drawn, abs=0.6)
    fine = _fibonacci(half, 20000)
    for point in points[:: max(1, len(points) // 50)]:
        assert np.linalg.norm(fine - point, axis=1).min() == pytest.approx(drawn, abs=0.06)
    area = _area(half - drawn)
    assert len(points) == pytest.approx(area / SPACING**2, rel=0.12)


def _fibonacci(half, count):
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, np.pi * (1 + 5**0.5) * k
    around = np.sqrt(1 - z * z)
    return half * np.column_stack([around * np.cos(turn), around * np.sin(turn), z])


def _area(half):
    """K. Thomsen's formula for the area of an ellipsoid, which errs by 1.1 % at most."""
    p = 1.6075
    a, b, c = half**p
    return 4 * np.pi * ((a * b + a * c + b * c) / 3) ** (1 / p)


def test_the_triangles_of_a_ball_cover_it():
    markers = alone({"type": "ellipsoid", "size": cells((24, 24, 24))})
    corners = markers.point[markers.face]
    assert np.array_equal(markers.face[:, 2], markers.face[:, 3])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(across, axis=1).sum() / 2 == pytest.approx(4 * np.pi * (12 - CLOSED) ** 2, rel=0.05)


def test_distances_from_shapes():
    flat = plate(8, 4).shape
    points = CELL * np.array([[0, 2, 0], [4, 0, 2], [7, 4, 0], [4, 3, 6]])
    np.testing.assert_allclose(distance(flat, points), CELL * np.array([2, 0, 5, 5]))
    box = body({"type": "rectangle", "length": 8 * CELL, "width": 4 * CELL, "span": 4 * CELL}).shape
    points = CELL * np.array([[0, 1, 1], [0, 2.5, 0], [7, 6, 0], [0, 5, 6]])
    np.testing.assert_allclose(distance(box, points), CELL * np.array([0, 0.5, 5, 5]))
    ball = body({"type": "ellipsoid", "size": cells((4, 4, 4))}).shape
    np.testing.assert_allclose(distance(ball, CELL * np.array([[0, 3, 4], [1, 1, 1]])), [3 * CELL, 0])
    delta = wing(DELTA).shape
    points = CELL * np.array([[0, 3, 0], [-7.9, 0, 7.9], [-11, 4, 0], [-8, 0, 12], [11, 0, 0]])
    np.testing.assert_allclose(distance(delta, points), CELL * np.array([3, 0, 5, 4, 3]))
