"""Physical quantities of FMU variables: name, unit, base units, display unit."""

from __future__ import annotations

import math
from dataclasses import dataclass

DEGREES = 180.0 / math.pi


@dataclass(frozen=True)
class Unit:
    """A unit of the SI, which is what the values are in.

    Attributes:
        name: as tools show it, ``N.m``.
        exponents: of kg, m, s and rad, by name.
        display: name of a unit to show values in, such as ``deg``; empty for none.
        factor: display value = factor times value.
    """

    name: str
    exponents: tuple[tuple[str, int], ...]
    display: str = ""
    factor: float = 1.0


@dataclass(frozen=True)
class Quantity:
    """What a variable measures.

    Attributes:
        name: of the type in the model description, such as ``Torque``.
        unit: None for numbers without one.
    """

    name: str
    unit: Unit | None = None


def _unit(name: str, display: str = "", **exponents: int) -> Unit:
    return Unit(name, tuple(exponents.items()), display, DEGREES if display else 1.0)


COORDINATE = Quantity("Coordinate")
TIME_OF_EVENT = Quantity("EventTime", _unit("s", s=1))
ANGLE = Quantity("Angle", _unit("rad", "deg", rad=1))
ANGULAR_VELOCITY = Quantity("AngularVelocity", _unit("rad/s", "deg/s", rad=1, s=-1))
ANGULAR_ACCELERATION = Quantity("AngularAcceleration", _unit("rad/s2", "deg/s2", rad=1, s=-2))
POSITION = Quantity("Position", _unit("m", m=1))
LENGTH = Quantity("Length", POSITION.unit)
VELOCITY = Quantity("Velocity", _unit("m/s", m=1, s=-1))
ACCELERATION = Quantity("Acceleration", _unit("m/s2", m=1, s=-2))
FORCE = Quantity("Force", _unit("N", kg=1, m=1, s=-2))
TORQUE = Quantity("Torque", _unit("N.m", kg=1, m=2, s=-2))
POWER = Quantity("Power", _unit("W", kg=1, m=2, s=-3))
ENERGY = Quantity("Energy", _unit("J", kg=1, m=2, s=-2))
MASS = Quantity("Mass", _unit("kg", kg=1))
FIRST_MOMENT = Quantity("FirstMomentOfMass", _unit("kg.m", kg=1, m=1))
INERTIA = Quantity("MomentOfInertia", _unit("kg.m2", kg=1, m=2))
STIFFNESS = Quantity("Stiffness", _unit("N/m", kg=1, s=-2))
ROTATIONAL_STIFFNESS = Quantity("RotationalStiffness", _unit("N.m/rad", kg=1, m=2, s=-2, rad=-1))
DAMPING = Quantity("Damping", _unit("N.s/m", kg=1, s=-1))
ROTATIONAL_DAMPING = Quantity("RotationalDamping", _unit("N.m.s/rad", kg=1, m=2, s=-1, rad=-1))
VOLUME = Quantity("Volume", _unit("m3", m=3))
DENSITY = Quantity("Density", _unit("kg/m3", kg=1, m=-3))
QUATERNION = Quantity("UnitQuaternion")
QUATERNION_RATE = Quantity("UnitQuaternionRate", _unit("1/s", s=-1))
TIME = Quantity("Time", _unit("s", s=1))
COUNT = Quantity("Count")
INPUT = Quantity("Input")
SWITCH = Quantity("Switch")
TOLERANCE = Quantity("Tolerance")
ADDED_INERTIA = Quantity("AddedInertia")
