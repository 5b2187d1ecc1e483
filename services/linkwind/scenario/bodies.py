"""Bodies and joints as a scenario states them."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, WithJsonSchema, field_validator, model_validator

from linkwind.scenario.pictures import Pictures
from linkwind.scenario.problems import Problem, ProblemError, show
from linkwind.scenario.quantities import (
    Interval,
    Name,
    Numbers,
    Quaternion,
    Section,
    TurnRate,
    Vector,
    Vector3,
    numbers,
    quantity,
)
from linkwind.scenario.shapes import Circle, Ellipse, Ellipsoid, Plate, Polygon, Rectangle, Wing

JointType = Literal["fixed", "revolute", "prismatic", "planar", "spherical", "free", "distance"]

Inertia6 = tuple[float, float, float, float, float, float]

_INERTIA = "a number above 0, or 6 numbers [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]"


def _inertia(value: Any) -> float | Inertia6:
    if not isinstance(value, list | tuple):
        (about_z,) = numbers(value, _INERTIA)
        if about_z <= 0.0:
            raise ProblemError.value(_INERTIA, value, "Give the inertia about the centre of mass.")
        return about_z
    if len(value) != 6:
        raise ProblemError.value(_INERTIA, value, "Give one number for a planar body.")
    xx, yy, zz, xy, xz, yz = numbers(value, _INERTIA)
    principal = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]).tolist()
    shown = "principal moments " + ", ".join(f"{moment:.6g}" for moment in principal)
    # A rod has none about itself, a point mass none at all: the joint may keep them from spinning there.
    if principal[0] < -1e-12 * principal[2]:
        advice = "No body has these; check signs and units."
        raise ProblemError([Problem((), "an inertia without negative moments", shown, advice)])
    # A flat body has equality, which round-off must not turn into an error.
    if principal[0] + principal[1] < principal[2] * (1.0 - 1e-9):
        advice = f"No body has these: the largest is at most {principal[0] + principal[1]:.6g}."
        expected = "principal moments of which two add up to at least the third"
        raise ProblemError([Problem((), expected, shown, advice)])
    return xx, yy, zz, xy, xz, yz


Inertia = Annotated[
    float | Inertia6,
    BeforeValidator(_inertia),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "number", "exclusiveMinimum": 0},
                {"type": "array", "items": {"type": "number"}, "minItems": 6, "maxItems": 6},
            ]
        }
    ),
]


class Body(Section):
    """A rigid body, and how it starts.

    The start is stated in the world. A body without a parent joint may state all of it; a jointed one
    states what its joint leaves free (a revolute joint: its angle and angular velocity), and what it
    does not state follows from its parent: parallel to it, at rest relative to it.
    """

    name: Name = Field(description="Name, a letter followed by letters, digits and _")
    mass: float = quantity("Mass", "kg", ge=0.0)
    inertia: Inertia = quantity(
        "Inertia about the centre of mass: one number about z for a planar mechanism, or the matrix "
        "elements [Ixx, Iyy, Izz, Ixy, Ixz, Iyz] in the body frame",
        "kg·m²",
    )
    shape: Plate | Wing | Ellipse | Rectangle | Circle | Polygon | Ellipsoid | None = Field(
        default=None, discriminator="type", description="Shape, for force models and pictures"
    )
    picture: Pictures = Field(
        default=(), strict=False, description="What is drawn in place of the shape; no force model sees it"
    )
    position: Vector | None = quantity("Position of the centre of mass at the start, in the world", "m", None)
    angle_deg: float | None = quantity(
        "Angle at the start, a turn about z from the world's x axis to the body's", "deg", None
    )
    orientation: Quaternion | None = quantity(
        "Orientation at the start, in place of angle_deg: unit quaternion [w, x, y, z], body to world",
        "1",
        None,
    )
    velocity: Vector | None = quantity(
        "Velocity of the centre of mass at the start, in the world", "m/s", None
    )
    angular_velocity: TurnRate | None = quantity(
        "Angular velocity at the start, in the world; one number is about z", "rad/s", None
    )

    @field_validator("name")
    @classmethod
    def _not_the_world(cls, name: str) -> str:
        if name == "world":
            raise ProblemError.value("a name other than world", name, "The world is there already.")
        return name

    @model_validator(mode="after")
    def _one_orientation(self) -> Body:
        if self.angle_deg is not None and self.orientation is not None:
            got = f"{show(self.angle_deg)} besides orientation"
            expected = "angle_deg or orientation, not both"
            raise ProblemError([Problem(("angle_deg",), expected, got, "Remove one of the two.")])
        return self

    @property
    def planar(self) -> bool:
        """Whether the inertia is a single number, about z."""
        return isinstance(self.inertia, float)


class Joint(Section):
    """A joint between a parent (or the world) and a child.

    The joint frame has its z axis along ``axis``; the joint is at zero where the body frames of parent
    and child are parallel and its two points coincide. A joint whose child has a joint before it in the
    file, or would come to carry its own parent, closes a loop; so does every ``distance``. Its axes on the
    child are where they lie at the start.
    """

    name: Name = Field(description="Name, a letter followed by letters, digits and _")
    type: JointType = Field(
        description="What the joint leaves free; distance keeps two points as far apart as they start"
    )
    parent: str = Field(description='Name of a body, or "world"')
    child: str = Field(description="Name of a body; its first joint carries it, more of them close loops")
    parent_point: Vector = quantity(
        "The joint's point in the parent's body frame, from its centre of mass (world: in the world)",
        "m",
        (0.0, 0.0, 0.0),
    )
    child_point: Vector = quantity(
        "The joint's point in the child's body frame, from its centre of mass", "m", (0.0, 0.0, 0.0)
    )
    axis: Vector = quantity(
        "Axis in the parent's body frame: of turning (revolute), of sliding (prismatic), normal of the "
        "plane (planar); any length",
        "1",
        (0.0, 0.0, 1.0),
    )
    stiffness: Numbers = quantity(
        "Spring, force = -stiffness (q - rest): one number, or one for each degree of freedom",
        "N/m or N·m/rad",
        0.0,
    )
    damping: Numbers = quantity(
        "Damper, force = -damping v: one number, or one for each degree of freedom",
        "N·s/m or N·m·s/rad",
        0.0,
    )
    rest: Numbers | None = quantity(
        "Joint coordinates where the spring is relaxed: angle or distance; planar [x, y, angle]; "
        "spherical a quaternion; free position and quaternion; default: the joint's zero",
        "m or rad",
        None,
    )

    stop: Interval | None = quantity(
        "Stops of a joint with one coordinate: the lowest and the highest that it can have", "m or rad", None
    )
    restitution: float = quantity("Rate behind a stop over rate before it", "1", 0.0, ge=0.0, le=1.0)

    @field_validator("stop")
    @classmethod
    def _stops_apart(cls, stop: tuple[float, float] | None) -> tuple[float, float] | None:
        if stop is not None and not stop[0] < stop[1]:
            raise ProblemError.value("two numbers, the lower one first", list(stop), "Swap them.")
        return stop

    @field_validator("axis")
    @classmethod
    def _axis_has_direction(cls, axis: Vector3) -> Vector3:
        if not any(axis):
            raise ProblemError.value("a vector that is not zero", list(axis), "The default is [0, 0, 1].")
        return axis

    @field_validator("stiffness", "damping")
    @classmethod
    def _never_negative(cls, value: float | tuple[float, ...]) -> float | tuple[float, ...]:
        each = value if isinstance(value, tuple) else (value,)
        if min(each, default=0.0) < 0.0:
            raise ProblemError.value("no number below 0", value, "A negative one would feed energy.")
        return value
