"""What a force model is given and what it gives back, and the units that FMUs write these in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from linkwind.fmi.host.facts import Unit

Exponents = tuple[int, int, int, int]  # of kg, m, s and everything else; angles count as numbers

_XYZ = ("x", "y", "z")


@dataclass(frozen=True)
class Quantity:
    """A quantity of a body.

    Attributes:
        meaning: in words, with the SI unit.
        components: names of its components, ("",) for a single number.
        exponents: of its unit.
        turns: whether it can be given in the body frame as well as in the world.
    """

    meaning: str
    components: tuple[str, ...]
    exponents: Exponents
    turns: bool = True

    def label(self, component: int) -> str:
        """Return the name of a component with a dot before it, or nothing."""
        return f".{self.components[component]}" if self.components[component] else ""


_LENGTH, _SPEED, _RATE = (0, 1, 0, 0), (0, 1, -1, 0), (0, 0, -1, 0)

INPUTS: dict[str, Quantity] = {
    "position": Quantity("position [m]", _XYZ, _LENGTH, turns=False),
    "orientation": Quantity(
        "unit quaternion, body to world", ("w", "x", "y", "z"), (0, 0, 0, 0), turns=False
    ),
    "velocity": Quantity("velocity [m/s]", _XYZ, _SPEED),
    "angular_velocity": Quantity("angular velocity [rad/s]", _XYZ, _RATE),
    "relative_velocity": Quantity("velocity relative to the wind [m/s]", _XYZ, _SPEED),
    "wind": Quantity("undisturbed wind at the body [m/s]", _XYZ, _SPEED),
    "acceleration": Quantity("acceleration, differenced over the last step [m/s²]", _XYZ, (0, 1, -2, 0)),
    "angular_acceleration": Quantity(
        "angular acceleration, differenced over the last step [rad/s²]", _XYZ, (0, 0, -2, 0)
    ),
    "angle": Quantity("angle about z, unwrapped [rad]", ("",), (0, 0, 0, 0), turns=False),
    "density": Quantity("density of the fluid [kg/m³]", ("",), (1, -3, 0, 0), turns=False),
}

OUTPUTS: dict[str, Quantity] = {
    "force": Quantity("force on the body [N]", _XYZ, (1, 1, -2, 0)),
    "torque": Quantity("torque on the body [N·m]", _XYZ, (1, 2, -2, 0)),
    "added_inertia": Quantity(
        "added inertia, body frame, force rows first [kg, kg·m, kg·m²]",
        tuple(f"{row},{column}" for row in range(1, 7) for column in range(1, 7)),
        (1, 0, 0, 0),
        turns=False,
    ),
    "point": Quantity("point of application of the force, in the world [m]", _XYZ, _LENGTH, turns=False),
}

_RPM = 2.0 * math.pi / 60.0

# Units by name, for FMUs that name a unit without defining it.
KNOWN_UNITS: dict[str, tuple[float, Exponents]] = {
    **dict.fromkeys(("1", "-", "rad"), (1.0, (0, 0, 0, 0))),
    "deg": (math.pi / 180.0, (0, 0, 0, 0)),
    "m": (1.0, _LENGTH),
    "mm": (1e-3, _LENGTH),
    "m/s": (1.0, _SPEED),
    "km/h": (1.0 / 3.6, _SPEED),
    **dict.fromkeys(("rad/s", "1/s"), (1.0, _RATE)),
    "deg/s": (math.pi / 180.0, _RATE),
    **dict.fromkeys(("rpm", "rev/min", "1/min"), (_RPM, _RATE)),
    **dict.fromkeys(("m/s2", "m/s^2"), (1.0, (0, 1, -2, 0))),
    **dict.fromkeys(("rad/s2", "rad/s^2"), (1.0, (0, 0, -2, 0))),
    "N": (1.0, (1, 1, -2, 0)),
    "kN": (1e3, (1, 1, -2, 0)),
    **dict.fromkeys(("N.m", "N*m", "Nm", "N m", "N·m"), (1.0, (1, 2, -2, 0))),
    **dict.fromkeys(("kN.m", "kNm"), (1e3, (1, 2, -2, 0))),
    "kg": (1.0, (1, 0, 0, 0)),
    **dict.fromkeys(("kg.m", "kg*m"), (1.0, (1, 1, 0, 0))),
    **dict.fromkeys(("kg.m2", "kg*m2", "kg.m^2"), (1.0, (1, 2, 0, 0))),
    **dict.fromkeys(("kg/m3", "kg/m^3"), (1.0, (1, -3, 0, 0))),
}


def exponents(name: str, component: int) -> Exponents:
    """Return the exponents of a component's unit; those of the added inertia differ by block."""
    quantity = {**INPUTS, **OUTPUTS}[name]
    if name != "added_inertia":
        return quantity.exponents
    row, column = divmod(component, 6)
    return (1, (row > 2) + (column > 2), 0, 0)


def known(name: str) -> Unit | None:
    """Return a unit by its usual name."""
    if name not in KNOWN_UNITS:
        return None
    factor, exps = KNOWN_UNITS[name]
    return Unit(name, factor, 0.0, exps)


def to_si(unit: Unit | None, wanted: Exponents) -> tuple[float, float] | str:
    """Return factor and offset from a unit to the SI, or what is wrong with it.

    Args:
        unit: of a variable; None is taken as the SI's.
        wanted: exponents of the quantity.
    """
    if unit is None:
        return 1.0, 0.0
    defined = unit if unit.exponents is not None else known(unit.name)
    if defined is None:
        return f'unit "{unit.name}", which the FMU does not define'
    if defined.exponents != wanted:
        return f'unit "{unit.name}"'
    return defined.factor, defined.offset


def unit_names(wanted: Exponents) -> str:
    """Return the known units of a dimension, for an error."""
    return ", ".join(name for name, (_, exps) in KNOWN_UNITS.items() if exps == wanted)


def all_quantities() -> Mapping[str, Quantity]:
    """Return inputs and outputs."""
    return {**INPUTS, **OUTPUTS}
