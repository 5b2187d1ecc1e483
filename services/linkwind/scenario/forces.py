"""Force elements of the mechanism as a scenario states them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from linkwind.scenario.quantities import Name, Section, Vector, quantity


class Spring(Section):
    """A spring and damper between two points: tension = stiffness (length - rest) + damping d(length)/dt."""

    type: Literal["spring"] = Field(description="Spring and damper between two points")
    name: Name = Field(description="Name, a letter followed by letters, digits and _")
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


Force = Spring
