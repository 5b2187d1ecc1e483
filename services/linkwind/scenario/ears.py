"""Polygons as triangles, by cutting off their ears (G. H. Meisters 1975)."""

from __future__ import annotations

from linkwind.spatial import Array


def triangles(outline: Array) -> list[tuple[int, int, int]]:
    """Return the triangles that fill a polygon, as indices of its points.

    Args:
        outline: of a polygon whose sides do not cross, counter-clockwise, shape (n, 2).
    """
    left, found = list(range(len(outline))), []
    while len(left) > 3:
        corners = [(left[i - 1], left[i], left[(i + 1) % len(left)]) for i in range(len(left))]
        ear = next((ear for ear in corners if _is_ear(outline, ear, left)), corners[0])
        found.append(ear)
        left.remove(ear[1])
    return [*found, (left[0], left[1], left[2])]


def _is_ear(outline: Array, corner: tuple[int, int, int], left: list[int]) -> bool:
    """Return whether the corner sticks out and holds no other point."""
    a, b, c = (outline[i] for i in corner)
    if _side(a, b, c) <= 0.0:
        return False
    others = (outline[i] for i in left if i not in corner)
    return not any(min(_side(a, b, p), _side(b, c, p), _side(c, a, p)) >= 0.0 for p in others)


def _side(a: Array, b: Array, p: Array) -> float:
    """Return twice the area of the triangle a b p, above 0 where p is to the left of the way from a to b."""
    return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))
