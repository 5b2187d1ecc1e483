"""Bodies as triangles: their volumes, and what planes cut of them."""

import numpy as np
import pytest

from linkwind.report.faces import PIECES, cut, faces
from linkwind.scenario.shapes import shape_of

L_SHAPE = [[0, 0], [0.4, 0], [0.4, 0.1], [0.1, 0.1], [0.1, 0.3], [0, 0.3]]


def volume(triangles):
    a, b, c = np.moveaxis(triangles, 1, 0)
    return (np.cross(a, b) * c).sum() / 6.0


@pytest.mark.parametrize(
    ("shape", "expected"),
    [
        ({"type": "ellipsoid", "size": [0.4, 0.2, 0.6]}, np.pi / 6 * 0.048),
        ({"type": "circle", "diameter": 0.2, "span": 0.5}, np.pi / 4 * 0.02),
        ({"type": "rectangle", "length": 0.3, "width": 0.2, "span": 0.5}, 0.03),
        ({"type": "polygon", "points": L_SHAPE, "span": 2.0}, 2.0 * (0.04 + 0.02)),
    ],
)
def test_a_body_has_its_volume_and_faces_outwards(shape, expected):
    triangles = faces(shape_of(shape))
    assert volume(triangles) == pytest.approx(expected, rel=0.01)
    sides = np.linalg.norm(np.roll(triangles, 1, axis=1) - triangles, axis=-1)
    assert sides.max() <= max(np.ptp(triangles.reshape(-1, 3), axis=0)) / PIECES * 1.0001


def test_a_plate_is_one_sheet():
    triangles = faces(shape_of({"type": "plate", "length": 0.5, "span": 1.2}))
    a, b, c = np.moveaxis(triangles, 1, 0)
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(0.6)
    assert np.abs(triangles[..., 1]).max() == 0.0


def test_a_wing_is_its_planform():
    """A dart, whose notch no triangle covers, off its centre of mass."""
    points = [[1.0, 0.0], [2.0, 3.0], [1.0, 1.0], [0.0, 3.0]]
    triangles = faces(shape_of({"type": "wing", "points": points}))
    a, b, c = np.moveaxis(triangles, 1, 0)
    assert 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() == pytest.approx(1.0)
    assert np.abs(triangles[..., 1]).max() == 0.0
    pieces = cut(triangles, 2, 2.0)  # at z = 2: from x = 0.333 to 0.5 and from 1.5 to 1.667
    assert np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1).sum() == pytest.approx(1.0 / 3.0)
    assert pieces[..., 0].min() == pytest.approx(1.0 / 3.0)


@pytest.mark.parametrize(
    ("axis", "at", "area"), [(2, 0.3, 0.06), (2, 1.5, 0.0), (0, 0.05, 0.6), (1, 0.05, 0.8)]
)
def test_a_cut_runs_around_its_area(axis, at, area):
    """By Green's theorem, from the pieces in any order: they all run the same way around."""
    pieces = cut(faces(shape_of({"type": "polygon", "points": L_SHAPE, "span": 2.0})), axis, at)
    assert pieces.shape[1:] == (2, 3)
    assert pieces[..., axis] == pytest.approx(at)
    u, v = (pieces[..., i] for i in range(3) if i != axis)
    assert abs(0.5 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]).sum()) == pytest.approx(area)


def test_the_cut_of_a_plate_is_a_line():
    pieces = cut(faces(shape_of({"type": "plate", "length": 0.5, "span": 1.2})), 2, 0.1)
    assert np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1).sum() == pytest.approx(0.5)
