"""Surfaces of fields whose surfaces are known: a ball, a plane, a box."""

from __future__ import annotations

import numpy as np
import pytest

from linkwind.log.isosurface import Surface, between, isosurface, simplified

RADIUS, CENTRE = 12.2, np.array([15.3, 16.1, 17.7])  # along z, y, x, in cells


def grid(shape: tuple[int, int, int]) -> np.ndarray:
    return np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), axis=-1).astype(float)


@pytest.fixture(scope="module")
def ball() -> Surface:
    off = grid((32, 34, 37)) - CENTRE
    return isosurface((RADIUS**2 - (off**2).sum(axis=-1)).astype("f4"), 0.0)


def areas(surface: Surface) -> np.ndarray:
    """Twice the areas as vectors, in x, y, z."""
    a, b, c = np.moveaxis(surface.point.astype(float)[surface.triangle][..., ::-1], 1, 0)
    return np.cross(b - a, c - a)


def area(surface: Surface) -> float:
    return float(0.5 * np.linalg.norm(areas(surface), axis=1).sum())


def edges(surface: Surface) -> np.ndarray:
    """How many triangles each edge has, and whether they run through it either way."""
    ways = np.concatenate([surface.triangle[:, [i, (i + 1) % 3]] for i in range(3)])
    sign = np.where(ways[:, 0] < ways[:, 1], 1, -1)
    _, number = np.unique(np.sort(ways, axis=1), axis=0, return_inverse=True)
    return np.stack([np.bincount(number.ravel()), np.bincount(number.ravel(), sign)])


def test_a_ball_has_its_area_its_volume_and_its_radius(ball: Surface) -> None:
    assert area(ball) == pytest.approx(4.0 * np.pi * RADIUS**2, rel=0.02)
    corner = (ball.point.astype(float)[ball.triangle[:, 0]] - CENTRE)[:, ::-1]
    volume = (areas(ball) * corner).sum() / 6.0  # positive: triangles are counterclockwise from outside
    assert volume == pytest.approx(4.0 / 3.0 * np.pi * RADIUS**3, rel=0.02)
    off = np.linalg.norm(ball.point - CENTRE, axis=1) - RADIUS
    assert off.min() > -0.1  # cells: a vertex lies a little within, where chords do
    assert off.max() < 1e-3


def test_a_ball_is_closed(ball: Surface) -> None:
    count, balance = edges(ball)
    assert (count == 2).all()
    assert (balance == 0).all()
    # Euler: corners − edges + faces.
    assert len(ball.point) - count.size + len(ball.triangle) == 2


def test_a_plane_is_met_exactly_and_open_at_the_faces_of_the_grid() -> None:
    place = grid((9, 10, 11))
    surface = isosurface((place @ [0.0, 1.0, 0.0]).astype("f4"), 4.3)
    np.testing.assert_allclose(surface.point[:, 1], 4.3, atol=1e-6)
    assert area(surface) == pytest.approx(7 * 9)  # from the middles of the outer cubes: 9 − 2 by 11 − 2
    assert (areas(surface)[:, 1] < 0.0).all()  # seen from below, where the field is
    count, _ = edges(surface)
    assert set(count.tolist()) == {1, 2}


@pytest.mark.parametrize("values", [np.zeros((3, 4, 5)), np.full((2, 2, 2), np.nan), np.ones((3, 3, 3))])
def test_where_no_level_is_passed_there_is_nothing(values: np.ndarray) -> None:
    surface = isosurface(values.astype("f4"), 0.5)
    assert (surface.point.shape, surface.triangle.shape) == ((0, 3), (0, 3))


def test_what_is_no_number_is_outside() -> None:
    values = np.full((5, 5, 5), np.nan, "f4")
    values[2, 2, 2] = 3.0
    surface = isosurface(values, 1.0)
    assert len(surface.triangle) == 12  # a box around the one point
    assert np.abs(surface.point - 2.0).max() < 1.0
    values[2, 2, 2] = np.inf
    assert len(isosurface(values, 1.0).triangle) == 12


@pytest.mark.parametrize("most", [2000, 500, 60])
def test_fewer_triangles_keep_the_ball(ball: Surface, most: int) -> None:
    coarse = simplified(ball, most)
    assert 0.3 * most < len(coarse.triangle) <= most < len(ball.triangle)
    assert area(coarse) == pytest.approx(area(ball), rel=0.5 / np.sqrt(most / 12.0))
    assert coarse.triangle.max() < len(coarse.point)
    assert simplified(ball, 10**6) is ball


def test_between_grid_points_values_are_trilinear() -> None:
    place = grid((4, 5, 6))
    z, y, x = np.moveaxis(place, -1, 0)
    values = np.stack([1.0 + 2.0 * x - y + 3.0 * x * y * z, z * y], axis=-1).astype("f4")
    at = np.array([[0.25, 3.5, 4.75], [3.0, 4.0, 5.0], [0.0, 0.0, 0.0]], "f4")
    z, y, x = at.T
    expected = np.stack([1.0 + 2.0 * x - y + 3.0 * x * y * z, z * y], axis=-1)
    np.testing.assert_allclose(between(values, at), expected, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(between(values[..., 1], at), expected[:, 1], rtol=1e-6, atol=1e-6)
