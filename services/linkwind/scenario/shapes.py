"""Shapes of bodies: what a scenario may say of them, and their outline in the body frame.

An outline lies in the body's x, y plane, centred at the centre of mass, counter-clockwise, its first point
not repeated; the body reaches half its ``span`` to each side of that plane, as a cylinder but for ellipsoids.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import BeforeValidator, Field, TypeAdapter, WithJsonSchema, field_validator, model_validator

from linkwind.scenario.problems import Problem, ProblemError, show
from linkwind.scenario.quantities import Section, Vector, Vector3, numbers, quantity
from linkwind.spatial import Array

Point = tuple[float, float]

ROUND = 48  # points of a round outline, where the caller does not say

_KIND = "The kind of shape"


def _span() -> Any:
    return quantity("Width along the body's z axis", "m", 1.0, gt=0.0)


class Plate(Section):
    """A flat plate without thickness through the centre of mass: chord along x, span along z."""

    closed: ClassVar[bool] = False  # whether the outline encloses an area

    type: Literal["plate"] = Field(description=_KIND)
    length: float = quantity("Length along the body's x axis, the chord", "m", gt=0.0)
    span: float = _span()

    @property
    def reference_length(self) -> float:
        """Longest extent in the x, y plane [m]."""
        return self.length

    def outline(self, n: int = 2) -> Array:
        """Return ``n`` points from one edge to the other [m], shape (n, 2)."""
        return np.column_stack([np.linspace(-0.5, 0.5, n) * self.length, np.zeros(n)])


class Ellipse(Section):
    """An elliptic cylinder, its axes along x and y."""

    closed: ClassVar[bool] = True

    type: Literal["ellipse"] = Field(description=_KIND)
    length: float = quantity("Axis along the body's x axis", "m", gt=0.0)
    width: float = quantity("Axis along the body's y axis", "m", gt=0.0)
    span: float = _span()

    @property
    def reference_length(self) -> float:
        """Longest extent in the x, y plane [m]."""
        return max(self.length, self.width)

    def outline(self, n: int = ROUND) -> Array:
        """Return ``n`` points of the outline [m], shape (n, 2)."""
        return 0.5 * np.array([self.length, self.width]) * _circle(n)


class Circle(Section):
    """A circular cylinder."""

    closed: ClassVar[bool] = True

    type: Literal["circle"] = Field(description=_KIND)
    diameter: float = quantity("Diameter", "m", gt=0.0)
    span: float = _span()

    @property
    def reference_length(self) -> float:
        """Longest extent in the x, y plane [m]."""
        return self.diameter

    def outline(self, n: int = ROUND) -> Array:
        """Return ``n`` points of the outline [m], shape (n, 2)."""
        return 0.5 * self.diameter * _circle(n)


class Rectangle(Section):
    """A rectangular cylinder, its sides along x and y, sharp or with rounded corners."""

    closed: ClassVar[bool] = True

    type: Literal["rectangle"] = Field(description=_KIND)
    length: float = quantity("Side along the body's x axis", "m", gt=0.0)
    width: float = quantity("Side along the body's y axis", "m", gt=0.0)
    radius: float = quantity("Radius of the corners; half the width makes round ends", "m", 0.0, ge=0.0)
    span: float = _span()

    @model_validator(mode="after")
    def _corners_fit(self) -> Rectangle:
        most = 0.5 * min(self.length, self.width)
        if self.radius > most:
            expected = f"at most half the shorter side, {most:.6g} m"
            raise ProblemError([Problem(("radius",), expected, show(self.radius), "Make it smaller.")])
        return self

    @property
    def reference_length(self) -> float:
        """The longer side [m]."""
        return max(self.length, self.width)

    def outline(self, n: int = ROUND) -> Array:
        """Return the corners, each as about ``n`` / 4 points if they are round [m], shape (m, 2)."""
        quarter = np.linspace(0.0, 0.5 * np.pi, max(2, n // 4) if self.radius else 1)
        turn = quarter + 0.5 * np.pi * np.arange(4)[:, None]
        centre = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]])[:, None]
        corner = 0.5 * np.array([self.length, self.width]) - self.radius
        around = self.radius * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        outline: Array = (centre * corner + around).reshape(-1, 2)
        apart = np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1)
        distinct: Array = outline[apart > 1e-9 * self.reference_length]  # round ends: two corners share one
        return distinct


class Ellipsoid(Section):
    """An ellipsoid, a ball where its sizes are equal; of a mechanism in space."""

    closed: ClassVar[bool] = True

    type: Literal["ellipsoid"] = Field(description=_KIND)
    size: Vector = quantity("Whole lengths along the body's axes x, y and z", "m")

    @field_validator("size")
    @classmethod
    def _has_volume(cls, size: Vector3) -> Vector3:
        if min(size) <= 0.0:
            raise ProblemError.value("3 numbers above 0", list(size), "Correct it.")
        return size

    @property
    def span(self) -> float:
        """Extent along the body's z axis [m]."""
        return self.size[2]

    @property
    def reference_length(self) -> float:
        """Longest extent in the x, y plane [m]."""
        return max(self.size[:2])

    def outline(self, n: int = ROUND) -> Array:
        """Return ``n`` points of its cut with the x, y plane [m], shape (n, 2)."""
        return 0.5 * np.array(self.size[:2]) * _circle(n)


def _corners(plane: str) -> Callable[[Any], tuple[Point, ...]]:
    """Return how the corners of an outline are read, in the plane "x, y" or "x, z"."""

    def read(value: Any) -> tuple[Point, ...]:
        expected = f"a list of at least 3 points [{plane}]"
        advice = f"Write [[{plane}], [{plane}], [{plane}]], in the body frame from the centre of mass."
        entries = value if isinstance(value, list | tuple) else []
        if len(entries) < 3 or not all(isinstance(each, list | tuple) and len(each) == 2 for each in entries):
            raise ProblemError.value(expected, value, advice)
        points = [numbers(each, expected) for each in entries]
        return tuple((x, y) for x, y in points)

    return read


_PAIR = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
_PAIRS = WithJsonSchema({"type": "array", "items": _PAIR, "minItems": 3})

Points = Annotated[tuple[Point, ...], BeforeValidator(_corners("x, y")), _PAIRS]
Planform = Annotated[tuple[Point, ...], BeforeValidator(_corners("x, z")), _PAIRS]


class Polygon(Section):
    """A cylinder over any polygon whose sides do not cross."""

    closed: ClassVar[bool] = True

    type: Literal["polygon"] = Field(description=_KIND)
    points: Points = quantity(
        "Corners [[x, y], …] around the shape, either way, in the body frame from the centre of mass", "m"
    )
    span: float = _span()

    @model_validator(mode="after")
    def _simple(self) -> Polygon:
        _check_corners(self.points)
        return self

    @property
    def reference_length(self) -> float:
        """Largest distance of two corners [m]."""
        points = np.array(self.points)
        return float(np.linalg.norm(points[:, None] - points, axis=2).max())

    def outline(self, n: int = 0) -> Array:
        """Return the corners [m], shape (corners, 2), whatever ``n``."""
        points = np.array(self.points)
        return points if signed_area(points) > 0.0 else points[::-1].copy()


class Wing(Section):
    """A flat wing without thickness, of any planform: chord along the body's x axis, span along z."""

    closed: ClassVar[bool] = False

    type: Literal["wing"] = Field(description=_KIND)
    points: Planform = quantity(
        "Corners [[x, z], …] of the planform, either way, in the body frame from the centre of mass", "m"
    )

    @model_validator(mode="after")
    def _simple(self) -> Wing:
        _check_corners(self.points)
        return self

    @property
    def planform(self) -> Array:
        """Corners (x, z) [m], shape (corners, 2), from x towards z."""
        points = np.array(self.points)
        return points if signed_area(points) > 0.0 else points[::-1].copy()

    @property
    def reference_length(self) -> float:
        """Extent along the body's x axis [m]."""
        return float(np.ptp(np.array(self.points)[:, 0]))

    @property
    def span(self) -> float:
        """Extent along the body's z axis [m]."""
        return float(np.ptp(np.array(self.points)[:, 1]))

    def outline(self, n: int = 2) -> Array:
        """Return ``n`` points of its view along the span, a line [m], shape (n, 2)."""
        x = np.array(self.points)[:, 0]
        return np.column_stack([np.linspace(x.min(), x.max(), n), np.zeros(n)])

    @property
    def folds(self) -> float | None:
        """Place along the span at which a line along the chord meets the wing twice [m]; None without."""
        levels = sorted({z for _, z in self.points})
        between = [0.5 * (low + high) for low, high in pairwise(levels)]
        return next((z for z in between if self.chord(z) is None), None)

    def chord(self, z: float) -> tuple[float, float] | None:
        """Return where a line along the chord enters and leaves the wing [m].

        Args:
            z: place along the span [m].

        Returns:
            The least and the largest x; None where the line misses the wing, or meets it more than once.
        """
        a, b = self.planform, np.roll(self.planform, -1, axis=0)
        low, high = np.minimum(a[:, 1], b[:, 1]), np.maximum(a[:, 1], b[:, 1])
        met = (low <= z) & (z < high)  # a corner counts for the side above it
        if np.count_nonzero(met) != 2:
            return None
        a, b = a[met], b[met]
        x = a[:, 0] + (z - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
        return float(x.min()), float(x.max())


AnyShape = Plate | Wing | Ellipse | Rectangle | Circle | Polygon | Ellipsoid

_ANY: TypeAdapter[AnyShape] = TypeAdapter(Annotated[AnyShape, Field(discriminator="type")])


def shape_of(data: Mapping[str, Any] | None) -> AnyShape | None:
    """Return the shape that a resolved scenario holds as data; None where there is none."""
    return None if data is None else _ANY.validate_python(data)


def signed_area(points: Array) -> float:
    """Return the area of a polygon [m²], negative where its points, shape (n, 2), run clockwise."""
    (x, y), (x1, y1) = points.T, np.roll(points, -1, axis=0).T
    return 0.5 * float((x * y1 - x1 * y).sum())  # no BLAS: the same bits on every machine


def _circle(n: int) -> Array:
    angle = np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _check_corners(points: tuple[Point, ...]) -> None:
    crossing = _crossing(np.array(points))
    if crossing:
        sides = " and ".join(f"the one from points[{i}] = {show(points[i])}" for i in crossing)
        advice = "Put the corners in their order around the shape, each once."
        raise ProblemError([Problem(("points",), "sides that meet only in their corners", sides, advice)])


def _crossing(points: Array) -> tuple[int, int] | None:
    """Return two sides that meet in more than a corner they share, each by its first corner."""
    n, following = len(points), np.roll(points, -1, axis=0)
    for i in range(n):
        for j in range(i + 1, n):
            a, b, c, d = points[i], following[i], points[j], following[j]
            if (j - i) % n in (1, n - 1):  # neighbours: one folds back on the other, or has no length
                shared, one, other = (b, a, d) if j == i + 1 else (a, b, c)
                u, v = one - shared, other - shared
                if _cross(u, v) == 0.0 and u @ v >= 0.0:
                    return i, j
            elif _meet(a, b, c, d):
                return i, j
    return None


def _meet(a: Array, b: Array, c: Array, d: Array) -> bool:
    """Return whether the segments a b and c d have a point in common."""
    ends = (_cross(b - a, c - a), _cross(b - a, d - a), _cross(d - c, a - c), _cross(d - c, b - c))
    if ends[0] * ends[1] < 0.0 and ends[2] * ends[3] < 0.0:
        return True
    segments = ((a, b, c), (a, b, d), (c, d, a), (c, d, b))
    on = zip(ends, segments, strict=True)
    return any(side == 0.0 and (p - r) @ (q - r) <= 0.0 for side, (p, q, r) in on)


def _cross(u: Array, v: Array) -> float:
    return float(u[0] * v[1] - u[1] * v[0])
