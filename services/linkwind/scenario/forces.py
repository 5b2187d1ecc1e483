"""Force elements of the mechanism as a scenario states them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from linkwind.scenario.functions import AnyFunction, AnyMotion, Inputs
from linkwind.scenario.providers import Definitions
from linkwind.scenario.quantities import Name, Section, Vector, quantity

_NAME = "Name, a letter followed by letters, digits and _"
_INPUTS = "Names that the expressions may use, and their values, which the FMU takes as inputs"
_COORDINATE = "Number of the joint's coordinate; of a planar joint 0 is x, 1 y, 2 the angle"


class Spring(Section):
    """A spring and damper between two points: tension = stiffness (length - rest) + damping d(length)/dt."""

    type: Literal["spring"] = Field(description="Spring and damper between two points")
    name: Name = Field(description=_NAME)
    parent: str = Field(description='Name of a body, or "world"')
    child: str = Field(description='Name of another body, or "world"')
    parent_point: Vector = quantity(
        "The spring's end in the parent's body frame, from its centre of mass (world: in the world)",
        "m",
        (0.0, 0.0, 0.0),
    )
    child_point: Vector = quantity(
        "The spring's end in the child's body frame, from its centre of mass", "m", (0.0, 0.0, 0.0)
    )
    stiffness: float = quantity("Stiffness", "N/m", 0.0, ge=0.0)
    damping: float = quantity("Damping", "N·s/m", 0.0, ge=0.0)
    rest: float | None = quantity("Length without tension; default: that at the start", "m", None, ge=0.0)
    force: AnyFunction | None = Field(
        default=None, description="Tension on top of that, N, of length, rate, t; a table: of length"
    )


class Actuator(Section):
    """A force or torque along a joint's coordinate."""

    type: Literal["actuator"] = Field(description="Force or torque along a joint's coordinate")
    name: Name = Field(description=_NAME)
    joint: str = Field(description="Name of a revolute, prismatic or planar joint that carries a body")
    coordinate: int = Field(default=0, ge=0, le=2, description=_COORDINATE)
    inputs: Inputs = quantity(_INPUTS, "any unit", {})
    force: AnyFunction = Field(
        description="Force or torque, N or N·m, of t, q, v and the inputs; a table: of t"
    )


class Motion(Section):
    """A joint's coordinate that is stated for all times; the force that it takes is reported."""

    type: Literal["motion"] = Field(description="A joint's coordinate, stated for all times")
    name: Name = Field(description=_NAME)
    joint: str = Field(description="Name of a revolute, prismatic or planar joint that carries a body")
    coordinate: int = Field(default=0, ge=0, le=2, description=_COORDINATE)
    position: AnyMotion = Field(
        description="Angle or displacement, rad or m, of t; a table: of t, periodic, or from 0 to the end of "
        "the run, or to a rest: two equal values"
    )


class PointForce(Section):
    """A force and a torque on a body, at a point of it."""

    type: Literal["point_force"] = Field(description="Force and torque on a body, at a point of it")
    name: Name = Field(description=_NAME)
    body: str = Field(description="Name of the body")
    point: Vector = quantity(
        "Where the force acts, in the body frame from the centre of mass", "m", (0.0, 0.0, 0.0)
    )
    frame: Literal["world", "body"] = Field(default="world", description="Frame of force and torque")
    inputs: Inputs = quantity(_INPUTS, "any unit", {})
    let: Definitions = Field(
        default_factory=dict,
        description="Named sub-expressions, evaluated in this order; each may use those before it",
    )
    fx: AnyFunction | None = Field(
        default=None, description="Force along x, N, of t x y z vx vy vz wx wy wz theta; a table: of t"
    )
    fy: AnyFunction | None = Field(default=None, description="Force along y, N, likewise")
    fz: AnyFunction | None = Field(default=None, description="Force along z, N, likewise")
    tx: AnyFunction | None = Field(default=None, description="Torque about x, N·m, likewise")
    ty: AnyFunction | None = Field(default=None, description="Torque about y, N·m, likewise")
    tz: AnyFunction | None = Field(default=None, description="Torque about z, N·m, likewise")


class Buoyancy(Section):
    """What a fluid at rest pushes a body up with that displaces it."""

    type: Literal["buoyancy"] = Field(description="Weight of displaced fluid, upwards")
    name: Name = Field(description=_NAME)
    body: str = Field(description="Name of the body")
    point: Vector = quantity(
        "Centre of volume, in the body frame from the centre of mass", "m", (0.0, 0.0, 0.0)
    )
    volume: float | None = quantity("Volume; default: that of the body's shape", "m³", None, gt=0.0)
    density: float | None = quantity(
        "Density of the fluid; default: that of environment", "kg/m³", None, ge=0.0
    )


Force = Annotated[Spring | Actuator | Motion | PointForce | Buoyancy, Field(discriminator="type")]
