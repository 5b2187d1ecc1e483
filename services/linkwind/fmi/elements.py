"""Force elements as variables of an FMU: their parameters, what they do, and what that depends on."""

from __future__ import annotations

from linkwind.fmi import units
from linkwind.fmi.coordinates import force_names
from linkwind.fmi.units import Quantity
from linkwind.mechanism import Mechanism
from linkwind.native.multibody import FORCE_TYPES, JOINT_TYPES

# Of each type: parameters at their places among the three numbers of ``force_number``.
_PARAMETERS: dict[str, tuple[tuple[str, Quantity, str], ...]] = {
    "spring": (
        ("stiffness", units.STIFFNESS, "Stiffness"),
        ("damping", units.DAMPING, "Damping"),
        ("rest", units.LENGTH, "Length without tension"),
    ),
    "buoyancy": (
        ("volume", units.VOLUME, "Volume"),
        ("density", units.DENSITY, "Density of the fluid"),
    ),
}
_STORED = ("stiffness", "rest", "volume", "density")  # that energies depend on
_NAMES = {code: name for name, code in FORCE_TYPES.items()}


class Elements:
    """The force elements of a mechanism.

    Attributes:
        names: that they have in the FMU.
        types: of them.
        bodies: of them, one for each; two with springs tell which bodies belong together.
        moved: bodies whose joint a motion prescribes.
        inputs: element and name of each input, in the order of the tables.
    """

    def __init__(self, mechanism: Mechanism) -> None:
        tables = mechanism.tables
        self._tables = tables
        self.names = force_names(mechanism)
        self.types = [_NAMES[code] for code in tables.force_type.tolist()]
        rows = list(zip(self.types, tables.force_body.tolist(), strict=True))
        self.bodies = [max(pair) if kind == "spring" else pair[0] for kind, pair in rows]
        self.pairs = [pair for kind, pair in rows if kind == "spring" and min(pair) >= 0]
        self.inputs = [(i, f"{self.names[i]}.{name}") for i, name in mechanism.inputs]
        self.moved = {pair[0] for kind, pair in rows if kind == "motion"}
        self._coordinates = [pair[1] for _, pair in rows]

    def parameters(self, i: int) -> tuple[tuple[str, Quantity, str], ...]:
        """Return name, quantity and description of the parameters of element i, in their order."""
        return _PARAMETERS.get(self.types[i], ())

    def parameter_names(self, bodies: list[int], *, stored: bool = False) -> list[str]:
        """Return the parameters of all elements on some bodies; ``stored``: those that energies depend on."""
        return [
            f"{name}.{what}"
            for i, name in enumerate(self.names)
            for what, _, _ in self.parameters(i)
            if self.bodies[i] in bodies and (not stored or what in _STORED)
        ]

    def input_names(self, bodies: list[int]) -> list[str]:
        """Return the inputs of all elements on some bodies."""
        return [name for i, name in self.inputs if self.bodies[i] in bodies]

    def in_time(self, bodies: list[int]) -> bool:
        """Return whether an element on some bodies has an expression, which may be one of time."""
        length = self._tables.force_start[1:] - self._tables.force_start[:-1]
        return any(length[i] > 0 and body in bodies for i, body in enumerate(self.bodies))

    def quantity(self, i: int) -> Quantity:
        """Return what the effort of element i is."""
        if self.types[i] not in ("actuator", "motion"):
            return units.FORCE
        slides = {JOINT_TYPES["prismatic"]: 1, JOINT_TYPES["planar"]: 2}  # of its coordinates
        turns = self._coordinates[i] >= slides.get(int(self._tables.joint_type[self.bodies[i]]), 0)
        return units.TORQUE if turns else units.FORCE
