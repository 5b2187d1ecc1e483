"""Surfaces of shapes for meshes: closed, outwards, of the right volume or area."""

from collections import Counter
from itertools import pairwise

import numpy as np
import pytest

from linkwind.log.surfaces import surface
from linkwind.scenario.shapes import shape_of

DART = [[0.2, 0.0], [-0.1, 0.1], [0.0, 0.0], [-0.1, -0.1]]


def corners(found):
    """All cells as fans of triangles, shape (m, 3, 3): right for convex ones only."""
    fans = [(cell[0], a, b) for cell in found.cells for a, b in pairwise(cell[1:])]
    return found.point[np.array(fans)]


@pytest.mark.parametrize(
    ("shape", "volume", "off"),
    [
        ({"type": "circle", "diameter": 0.4, "span": 2.0}, np.pi * 0.04 * 2.0, 0.005),
        ({"type": "rectangle", "length": 0.4, "width": 0.2, "span": 3.0}, 0.24, 1e-12),
        ({"type": "polygon", "points": DART, "span": 0.5}, 0.01, 1e-12),
        ({"type": "ellipsoid", "size": [1.0, 0.5, 2.0]}, np.pi / 6, 0.01),
    ],
)
def test_a_closed_surface_has_every_edge_once_each_way_and_its_volume(shape, volume, off):
    found = surface(shape_of(shape))
    edges = Counter((a, b) for cell in found.cells for a, b in zip(cell, [*cell[1:], cell[0]], strict=True))
    assert set(edges.values()) == {1}
    assert all((b, a) in edges for a, b in edges)
    assert len(found.point) - len(edges) // 2 + len(found.cells) == 2  # L. Euler, of a ball
    assert np.linalg.det(corners(found)).sum() / 6.0 == pytest.approx(volume, rel=off)


@pytest.mark.parametrize(
    ("shape", "extent"),
    [
        ({"type": "plate", "length": 0.5, "span": 2.0}, [[-0.25, 0, -1], [0.25, 0, 1]]),
        ({"type": "wing", "points": [[0, 0], [2, 3], [0, 1], [-1, 3]]}, [[-1, 0, 0], [2, 0, 3]]),
    ],
)
def test_a_sheet_lies_in_the_x_z_plane_and_has_its_area(shape, extent):
    found = surface(shape_of(shape))
    a, b, c = np.moveaxis(corners(found), 1, 0)
    across = np.cross(b - a, c - a) / 2.0
    assert not across[:, ::2].any()
    assert abs(across[:, 1].sum()) == pytest.approx(np.abs(across[:, 1]).sum())
    assert np.abs(across[:, 1]).sum() == pytest.approx(1.0 if shape["type"] == "plate" else 1.5)
    assert [found.point.min(axis=0).tolist(), found.point.max(axis=0).tolist()] == extent
