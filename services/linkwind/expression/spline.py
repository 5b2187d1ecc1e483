"""Slopes of the cubic spline with two continuous derivatives; plain floats, so that the bits are the same.

With widths h and slopes d of the chords, the second derivative is continuous between two pieces where

    h₁ s₋ + 2 (h₀ + h₁) s + h₀ s₊ = 3 (h₁ d₀ + h₀ d₁)

C. de Boor, A Practical Guide to Splines, 1978, chapter IV.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

Row = tuple[float, float, float, float]  # coefficients of the slope before, here, after; right-hand side


def slopes(points: Sequence[tuple[float, float]], *, periodic: bool = False) -> list[float]:
    """Return the derivatives at the points.

    A spline that is not periodic has one cubic in its first two pieces, and one in its last two (not a knot):
    of fourth order up to the ends, where the natural one, without curvature there, is of second. Where its
    first or last two values are the same it rests: that piece is flat, and the others meet it at rate zero.

    Args:
        points: places, ascending, and values; at least two.
        periodic: whether it begins again where it ends, with the same value.
    """
    if periodic:
        return _periodic(points)
    last = len(points) - 1
    low = 1 if points[0][1] == points[1][1] else 0
    high = last - 1 if points[last - 1][1] == points[last][1] else last
    if low >= high:
        return [0.0] * len(points)
    moving = _open(points[low : high + 1], rests=(low > 0, high < last))
    return [0.0] * low + moving + [0.0] * (last - high)


def _open(points: Sequence[tuple[float, float]], rests: tuple[bool, bool]) -> list[float]:
    """Return the slopes between two ends, at which it rests or that are no knots."""
    h, d = _chords(points)
    if len(h) == 1 and not any(rests):
        return [d[0], d[0]]
    _, here, after, right = (0.0, 1.0, 0.0, 0.0) if rests[0] else _end(h, d)
    first = (0.0, here, after, right)
    _, here, before, right = (0.0, 1.0, 0.0, 0.0) if rests[1] else _end(h[::-1], d[::-1])
    return _thomas([first, *_inner(h, d), (before, here, 0.0, right)])


def _end(h: Sequence[float], d: Sequence[float]) -> Row:
    """Return the row of a first point: the two first pieces are one cubic, or a lone one a parabola."""
    if len(h) < 3:
        return 0.0, 1.0, 1.0, 2.0 * d[0]
    both = h[0] + h[1]
    return 0.0, h[1], both, ((h[0] + 2.0 * both) * h[1] * d[0] + h[0] * h[0] * d[1]) / both


def _periodic(points: Sequence[tuple[float, float]]) -> list[float]:
    """Return the slopes of a spline that closes; those of the others are a + b s with s of the first."""
    h, d = _chords(points)
    rows = _inner(h, d)
    a, b = [0.0], [1.0]
    if rows:
        share = [0.0] * len(rows)
        share[0] -= rows[0][0]
        share[-1] -= rows[-1][2]
        a += _thomas(rows)
        b += _thomas([(*row[:3], right) for row, right in zip(rows, share, strict=True)])
    before, here, after, right = _knot(h[-1], h[0], d[-1], d[0])
    second = 1 % len(a)
    s = (right - before * a[-1] - after * a[second]) / (here + before * b[-1] + after * b[second])
    return [*(own + part * s for own, part in zip(a, b, strict=True)), s]


def _chords(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    h = [right[0] - left[0] for left, right in pairwise(points)]
    return h, [(right[1] - left[1]) / width for (left, right), width in zip(pairwise(points), h, strict=True)]


def _inner(h: Sequence[float], d: Sequence[float]) -> list[Row]:
    return [_knot(*sides) for sides in zip(h[:-1], h[1:], d[:-1], d[1:], strict=True)]


def _knot(h0: float, h1: float, d0: float, d1: float) -> Row:
    return h1, 2.0 * (h0 + h1), h0, 3.0 * (h1 * d0 + h0 * d1)


def _thomas(rows: Sequence[Row]) -> list[float]:
    """Return the solution of a tridiagonal system; what its first and last row have outside is not read."""
    after, right = [0.0], [0.0]
    for i, (left, here, beyond, value) in enumerate(rows):
        left = left if i else 0.0
        pivot = here - left * after[-1]
        after.append(beyond / pivot)
        right.append((value - left * right[-1]) / pivot)
    found = [right[-1]]
    for share, value in zip(after[-2:0:-1], right[-2:0:-1], strict=True):
        found.append(value - share * found[-1])
    return found[::-1]
