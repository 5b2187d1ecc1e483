"""Force providers: which model puts a wrench on which bodies."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from linkwind.scenario.problems import ProblemError
from linkwind.scenario.quantities import Name, Section

AeroModel = Literal["none", "field", "plate"]
PlateCoefficients = Literal["ristroph", "andersen"]


def _let(value: Any) -> dict[str, Any]:
    """Return the definitions in their order, from a table or from pairs as JSON carries them."""
    expected = 'a table of expressions, such as { speed = "sqrt(vx*vx + vy*vy)" }'
    if isinstance(value, dict):
        return value
    if isinstance(value, list) and all(isinstance(pair, list) and len(pair) == 2 for pair in value):
        names = [name for name, _ in value]
        if all(isinstance(name, str) for name in names) and len(set(names)) == len(names):
            return dict(value)
    raise ProblemError.value(expected, value, "Write it as a table.")


def _pairs(definitions: dict[str, str]) -> list[list[str]]:
    return [list(pair) for pair in definitions.items()]


Definitions = Annotated[
    dict[Name, str],
    BeforeValidator(_let),
    # Pairs, because the order counts and canonical JSON sorts its keys.
    PlainSerializer(_pairs, when_used="json"),
    WithJsonSchema({"type": "object", "additionalProperties": {"type": "string"}}),
]

_VARIABLES = (
    "of t x y z vx vy vz wx wy wz theta (SI, world, at the centre of mass; theta: angle about z, unwrapped)"
)


def _component(what: str, unit: str) -> Any:
    return Field(default="0", description=f"{what} [{unit}], an expression {_VARIABLES}")


class FieldExpressions(Section):
    """The wrench on one body as expressions of time and of the body's motion, in the world."""

    let: Definitions = Field(
        default_factory=dict,
        description="Named sub-expressions, evaluated in this order; each may use those before it",
    )
    fx: str = _component("Force along x", "N")
    fy: str = _component("Force along y", "N")
    fz: str = _component("Force along z", "N")
    tx: str = _component("Torque about x", "N·m")
    ty: str = _component("Torque about y", "N·m")
    tz: str = _component("Torque about z", "N·m")


class PlateModel(Section):
    """Settings of the quasi-steady flat plate."""

    coefficients: PlateCoefficients = Field(
        default="ristroph",
        description="Coefficients: ristroph (Li et al. 2022), andersen (Andersen, Pesavento & Wang 2005)",
    )


class Provider(Section):
    """A participant that answers a motion with the wrench on its bodies."""

    name: Name = Field(description="Name, a letter followed by letters, digits and _")
    model: AeroModel = Field(description="Force model")
    bodies: tuple[Name, ...] = Field(
        default=(), strict=False, min_length=1, description="Names of the bodies it acts on; default: all"
    )
    plate: PlateModel = Field(default=PlateModel(), description="Settings of the model plate")
    field: dict[str, FieldExpressions] = Field(
        default={}, description="The model field: a table for each body, by its name"
    )
