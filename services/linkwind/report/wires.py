"""Pictures of bodies as lines, for the animated scene."""

from __future__ import annotations

import numpy as np

from linkwind.mechanism.quaternion import matrix
from linkwind.scenario.pictures import Box, Capsule, Ellipsoid, Mesh, Picture
from linkwind.spatial import Array

Line = tuple[Array, bool]
"""Points in the body frame [m], shape (m, 3), and whether the last is joined to the first."""

ROUND = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
CIRCLE = np.column_stack([np.cos(ROUND), np.sin(ROUND), np.zeros_like(ROUND)])
CORNERS = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
UP = np.array([0.0, 0.0, 1.0])


def wires(picture: Picture) -> list[Line]:
    """Return the edges of a picture; of a mesh nothing."""
    if isinstance(picture, Mesh):
        return []
    if isinstance(picture, Ellipsoid):
        lines = [
            (CIRCLE[:, turned] * 0.5 * picture.size, True) for turned in ([0, 1, 2], [0, 2, 1], [2, 0, 1])
        ]
    elif isinstance(picture, Box):
        lines = _prism(0.5 * CORNERS * picture.size, picture.size[2], 4)
    else:
        lines = _prism(0.5 * picture.diameter * CIRCLE, picture.length, 4)
        if isinstance(picture, Capsule):
            lines += _meridians(picture.diameter, picture.length)
    turn, at = matrix(np.array(picture.orientation)), np.array(picture.position)
    return [(points @ turn.T + at, closed) for points, closed in lines]


def _prism(face: Array, height: float, edges: int) -> list[Line]:
    """Return two faces and lines between them."""
    low, high = face - 0.5 * height * UP, face + 0.5 * height * UP
    between = np.linspace(0, len(face), edges, endpoint=False).astype(int)
    return [(low, True), (high, True), *((np.stack([low[i], high[i]]), False) for i in between)]


def _meridians(diameter: float, length: float) -> list[Line]:
    """Return the outlines of a capsule in its x, z and y, z planes."""
    across, along = 0.5 * diameter * np.cos(ROUND), 0.5 * diameter * np.sin(ROUND)
    along = along + np.copysign(0.5 * length, along)
    zero = np.zeros_like(across)
    return [(np.column_stack([across, zero, along]), True), (np.column_stack([zero, across, along]), True)]
