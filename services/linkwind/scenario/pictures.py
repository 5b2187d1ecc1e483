"""What is drawn of a body in place of its shape, or of the surroundings: no force model sees it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, field_validator

from linkwind.scenario.problems import ProblemError
from linkwind.scenario.quantities import Quaternion, Section, Vector, Vector3, quantity

_KIND = "The kind of picture"


class _Placed(Section):
    position: Vector = quantity(
        "Where its middle is, in the body frame from the centre of mass; of environment: in the world",
        "m",
        (0.0, 0.0, 0.0),
    )
    orientation: Quaternion = quantity(
        "How it is turned: unit quaternion [w, x, y, z], picture to body, or to world",
        "1",
        (1.0, 0.0, 0.0, 0.0),
    )


class _Sized(_Placed):
    size: Vector = quantity("Extent along its x, y and z axes", "m")

    @field_validator("size")
    @classmethod
    def _has_size(cls, size: Vector3) -> Vector3:
        if min(size) < 0.0 or not any(size):
            raise ProblemError.value("3 numbers of at least 0, not all 0", list(size), "Correct it.")
        return size

    @property
    def extent(self) -> float:
        """Longest extent [m]."""
        return max(self.size)


class _Round(_Placed):
    diameter: float = quantity("Diameter", "m", gt=0.0)
    length: float = quantity("Length along z; of a capsule without the half balls", "m", ge=0.0)

    @property
    def extent(self) -> float:
        """Longest extent [m], half balls or not."""
        return self.length + self.diameter

    @property
    def axis(self) -> Vector3:
        """Direction of its z axis in the body frame."""
        w, x, y, z = self.orientation
        return 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)


class Box(_Sized):
    """A box."""

    type: Literal["box"] = Field(description=_KIND)


class Ellipsoid(_Sized):
    """An ellipsoid, a ball where its sizes are equal."""

    type: Literal["ellipsoid"] = Field(description=_KIND)


class Cylinder(_Round):
    """A circular cylinder along its z axis."""

    type: Literal["cylinder"] = Field(description=_KIND)


class Capsule(_Round):
    """A circular cylinder along its z axis, with half a ball on each end."""

    type: Literal["capsule"] = Field(description=_KIND)


class Mesh(_Placed):
    """A mesh in a file, drawn by Foxglove."""

    type: Literal["mesh"] = Field(description=_KIND)
    file: str = Field(description="Its address: file://…, package://… or https://…")
    scale: Vector = quantity("Factors along its x, y and z axes", "1", (1.0, 1.0, 1.0))

    @property
    def extent(self) -> float:
        """Not known."""
        return 0.0


Picture = Box | Ellipsoid | Cylinder | Capsule | Mesh
Pictures = tuple[Annotated[Picture, Field(discriminator="type")], ...]

_ANY: TypeAdapter[Pictures] = TypeAdapter(Annotated[Pictures, Field(strict=False)])


def pictures_of(data: Mapping[str, Any]) -> Pictures:
    """Return the pictures of a body, or of the environment, that a resolved scenario holds as data."""
    return _ANY.validate_python(data.get("picture", ()))
