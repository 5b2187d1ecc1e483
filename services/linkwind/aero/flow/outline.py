"""The markers that stand for the bodies in the fluid: where they lie on the outlines.

The 3 × 3 cells that a marker pushes make an outline act as if it were thicker, by a part of a cell where the
layers of sheared fluid are resolved, by more where they are not: then the whole stencil moves with the body.
Outlines are drawn in by that much, ``inset``, so that added mass and drag are those of the shape itself.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from linkwind.native.boundary import Indices, Markers
from linkwind.scenario.bodies import Body, Joint
from linkwind.scenario.shapes import AnyShape, Plate
from linkwind.spatial import Array

SPACING = 1.1  # cells from marker to marker: with 2 the fluid leaks, below 1 the forces alternate
PLATE_INSET = (1.1, 0.60, 0.42, 2.8)  # cells by which a free edge of a plate is drawn in, see `inset`
OUTLINE_INSET = (0.35, -0.1, 0.28, 1.08)  # cells by which a closed outline is drawn in
CROSSED = 0.05  # cells nearer to the outline than it was moved by: a point on the wrong side of a tip
AT_END = 0.5  # cells within which a joint's point counts as the end of a plate


def inset(law: tuple[float, float, float, float], viscosity: float) -> float:
    """Return by how many cells an outline is drawn in: ``law`` has the least, its value by the logarithm at
    viscosity 1, what it is more for each decade below, and the most.

    Calibrated on a circle that oscillates in a fluid at rest, against G. G. Stokes' force (1851), for
    viscosities from 1e-6 to 0.1 cells² a step, and on a plate: against its added mass and added inertia
    without viscosity, against itself with finer grids with some.
    """
    least, at_one, decade, most = law
    return min(max(at_one - decade * math.log10(viscosity), least), most)


def markers(bodies: list[Body], joints: list[Joint], cell: float, viscosity: float) -> Markers:
    """Return the markers of bodies with shapes.

    Two plates on a revolute joint at their ends share a marker there, so that nothing leaks between them.

    Args:
        bodies: of the flow.
        joints: all of the scenario.
        cell: side of a cell [m].
        viscosity: of the fluid [cells²/step].
    """
    hinges = _hinges(bodies, joints, cell)
    points = [_points(body, cell, viscosity, hinges[i]) for i, body in enumerate(bodies)]
    carriers: list[list[int]] = []
    places: list[list[Array]] = []
    following: list[int] = []
    shared: dict[str, int] = {}
    for index, (body, own) in enumerate(zip(bodies, points, strict=True)):
        names = hinges[index]
        numbers = []
        for k, point in enumerate(own):
            joint = names.get(k - len(own) if k else 0)
            known = shared.get(joint) if joint else None
            if known is not None:
                carriers[known][1], places[known][1] = index, point
            else:
                known = len(carriers)
                carriers.append([index, -1])
                places.append([point, np.zeros(2)])
                following.append(-1)
                if joint:
                    shared[joint] = known
            numbers.append(known)
        closed = body.shape is not None and body.shape.closed
        chain = [*numbers, numbers[0]] if closed else numbers
        _link(following, chain)
    return _in_order(
        np.array(carriers, np.int32), np.array(following, np.int32), np.array(places), joined(bodies, joints)
    )


def joined(bodies: list[Body], joints: list[Joint]) -> Indices:
    """Return which bodies may touch, shape (n, n): there are joints between them, and no body of the flow."""
    beside: dict[str, set[str]] = {}
    for joint in joints:
        if joint.parent != "world":
            beside.setdefault(joint.parent, set()).add(joint.child)
            beside.setdefault(joint.child, set()).add(joint.parent)
    names = [body.name for body in bodies]

    def reached(start: str) -> set[str]:
        found, ahead = {start}, [start]
        while ahead:
            new = beside.get(ahead.pop(), set()) - found
            found |= new
            ahead += [name for name in new if name not in names]
        return found - {start}

    return np.array([[name in found for name in names] for found in map(reached, names)], np.int32)


def _link(following: list[int], chain: list[int]) -> None:
    """Note who is beside whom; a shared marker that has a neighbour already is its neighbour's."""
    for a, b in pairwise(chain):
        if following[a] < 0:
            following[a] = b
        else:
            following[b] = a


def _hinges(bodies: list[Body], joints: list[Joint], cell: float) -> list[dict[int, str]]:
    """Return the joints at the ends of each plate: 0 for its first end (x < 0), -1 for its last."""
    names = [body.name for body in bodies]
    found: list[dict[int, str]] = [{} for _ in bodies]
    for joint in joints:
        if joint.type != "revolute" or joint.parent not in names or joint.child not in names:
            continue
        ends = []
        for name, point in ((joint.parent, joint.parent_point), (joint.child, joint.child_point)):
            index = names.index(name)
            end = _end(bodies[index], point, cell)
            if end is not None and end not in found[index]:
                ends.append((index, end))
        if len(ends) == 2:
            for index, end in ends:
                found[index][end] = joint.name
    return found


def _end(body: Body, point: tuple[float, ...], cell: float) -> int | None:
    if not isinstance(body.shape, Plate) or abs(point[1]) > AT_END * cell:
        return None
    if abs(abs(point[0]) - 0.5 * body.shape.length) > AT_END * cell:
        return None
    return 0 if point[0] < 0.0 else -1


def _points(body: Body, cell: float, viscosity: float, hinges: dict[int, str]) -> Array:
    """Return the markers of a body in its frame [cells], shape (k, 2)."""
    shape = body.shape
    assert shape is not None  # the scenario has been checked
    if isinstance(shape, Plate):
        half = 0.5 * shape.length / cell
        drawn = half - inset(PLATE_INSET, viscosity)
        low, high = (half if end in hinges else drawn for end in (0, -1))
        count = max(2, 1 + round((low + high) / SPACING))
        return np.column_stack([np.linspace(-low, high, count), np.zeros(count)])
    return around(shape, cell, viscosity)


def around(shape: AnyShape, cell: float, viscosity: float) -> Array:
    """Return the markers on a closed outline, drawn in, in the body frame [cells], shape (k, 2)."""
    return even(_drawn_in(_fine(shape.outline(720) / cell), inset(OUTLINE_INSET, viscosity)), SPACING)


def _fine(corners: Array) -> Array:
    """Return points at most a quarter of a cell apart on a closed outline."""
    points = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, int(np.ceil(4.0 * np.hypot(*(b - a)))))
        points.append(a + (b - a) * (np.arange(count) / count)[:, None])
    return np.concatenate(points)


def _drawn_in(points: Array, by: float) -> Array:
    """Move the points of a closed, counter-clockwise outline inwards along its normals.

    At a tip sharper than that they cross, and those that come too close to the outline are left out.
    """
    tangent = np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    moved = points + by * np.column_stack([-tangent[:, 1], tangent[:, 0]])
    near = [float(np.hypot(*(points - point).T).min()) for point in moved]
    return moved[np.array(near) > by - CROSSED]


def even(points: Array, spacing: float, least: int = 3) -> Array:
    """Return points at equal distances of about ``spacing`` along a closed curve, in the plane or in space.

    Args:
        points: along the curve, shape (k, 2) or (k, 3).
        spacing: between two of the new ones.
        least: of them.
    """
    closed = np.vstack([points, points[:1]])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = max(least, round(length[-1] / spacing))
    at = length[-1] * np.arange(count) / count
    return np.column_stack([np.interp(at, length, values) for values in closed.T])


def _in_order(body: Indices, following: Indices, point: Array, joined: Indices) -> Markers:
    """Number the markers so that neighbours are near each other: the factor of the mobility stays narrow.

    From one end along the outlines, a closed one both ways at once (E. Cuthill, J. McKee 1969).
    """
    count = len(body)
    beside: list[set[int]] = [set() for _ in range(count)]
    for k, other in enumerate(following.tolist()):
        if other >= 0:
            beside[k].add(other)
            beside[other].add(k)
    order: list[int] = []
    seen = [False] * count
    for start in sorted(range(count), key=lambda k: (len(beside[k]), k)):
        queue = [] if seen[start] else [start]
        seen[start] = True
        while queue:
            k = queue.pop(0)
            order.append(k)
            for other in sorted(beside[k]):
                if not seen[other]:
                    seen[other] = True
                    queue.append(other)
    number = np.empty(count, np.int32)
    number[order] = np.arange(count, dtype=np.int32)
    new_following = np.where(following[order] >= 0, number[following[order]], -1).astype(np.int32)
    body, point = np.ascontiguousarray(body[order]), np.ascontiguousarray(point[order])
    return Markers(body, new_following, point, joined)
