"""Functions of one or several variables as a scenario states them: expressions, or tables of points."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import (
    BeforeValidator,
    Field,
    GetJsonSchemaHandler,
    ValidationError,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import CoreSchema

from linkwind.scenario.points import Points, wrong
from linkwind.scenario.problems import Problem, ProblemError, show
from linkwind.scenario.quantities import Name, Section, numbers, quantity, vector
from linkwind.scenario.translation import problems


class Function(Section):
    """An expression, or a curve through points over the first variable; a text alone is the expression."""

    expression: str | None = Field(default=None, description="Expression of the variables")
    table: Points | None = quantity(
        "Points [variable, value] with ascending variables, or a CSV file of these two columns; beyond the "
        "ends their values hold",
        "SI units",
        None,
        strict=False,
        min_length=2,
    )
    interpolation: Literal["linear", "cubic", "spline"] = Field(
        default="linear",
        description="linear; cubic: monotone between points, without kinks; spline: with a continuous second "
        "derivative, the default of a motion",
    )
    periodic: bool = Field(default=False, description="The table begins again where it ends")

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the schema of a table that a text or a number may stand for."""
        reference = handler(core)
        handler.resolve_ref_schema(reference)["type"] = ["object", "string", "number"]
        return reference

    @model_validator(mode="after")
    def _one_of_two(self) -> Function:
        if (self.expression is None) == (self.table is None):
            got = "neither" if self.table is None else "both"
            raise ProblemError([Problem((), "an expression or a table", got, "Give one of the two.")])
        points = self.table or ()
        if unfit := list(wrong(points, periodic=self.periodic)):
            raise ProblemError([problem.below(("table",)) for problem in unfit])
        if self.periodic and points and points[-1][1] != points[0][1]:
            closed = (*points[:-1], (points[-1][0], points[0][1]))
            return self.model_copy(update={"table": closed})
        return self


def _function(value: Any) -> Any:
    if isinstance(value, bool):
        raise ProblemError.value("an expression, a number or a table", value, 'For example "2*sin(t)".')
    if isinstance(value, int | float):
        return {"expression": repr(value)}
    return {"expression": value} if isinstance(value, str) else value


def _motion(value: Any) -> Any:
    """Return a function whose table has, unless it says otherwise, the derivatives that a motion needs."""
    value = _function(value)
    if isinstance(value, dict) and value.get("table") is not None:
        return {"interpolation": "spline"} | value
    return value


def _components(value: Any) -> Any:
    """Return the components of a vector: numbers, and functions where they are none; z may be left out."""
    if not isinstance(value, list | tuple) or len(value) not in (2, 3):
        expected = "a list of 2 or 3 components, each a number, an expression or a table"
        raise ProblemError.value(expected, value, "Write [x, y, z], or [x, y] where z is 0.")
    if not any(isinstance(component, str | dict | Function) for component in value):
        return vector(value)
    components = [_component(component, index) for index, component in enumerate(value)]
    return (*components, 0.0) if len(components) == 2 else tuple(components)


def _component(value: Any, index: int) -> float | Function:
    if isinstance(value, Function):
        return value
    if isinstance(value, bool) or not isinstance(value, int | float | str | dict):
        expected = "a number, an expression or a table"
        advice = 'For example -5.0, "-5*(y/10)**0.14", or { table = "wind.csv" }.'
        raise ProblemError([Problem((index,), expected, show(value), advice)])
    try:
        if isinstance(value, int | float):
            return numbers(value, "numbers")[0]
        return Function.model_validate({"expression": value} if isinstance(value, str) else value)
    except ValidationError as error:
        raise ProblemError(problem.below((index,)) for problem in problems(error, Function)) from None
    except ProblemError as error:
        raise ProblemError(problem.below((index,)) for problem in error.problems) from None


class _TwoOrThree:
    """The schema of a list of which the last entry may be left out."""

    def __get_pydantic_json_schema__(self, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return it."""
        entry = handler(core)["prefixItems"][0]
        return {"type": "array", "items": entry, "minItems": 2, "maxItems": 3}


AnyFunction = Annotated[Function, BeforeValidator(_function)]
AnyMotion = Annotated[Function, BeforeValidator(_motion)]

Component = float | Function
Components = Annotated[tuple[Component, Component, Component], BeforeValidator(_components), _TwoOrThree()]
"""Three components of a vector, each a number or a function; two are padded with z = 0."""

Inputs = Annotated[
    dict[Name, float],
    WithJsonSchema({"type": "object", "additionalProperties": {"type": "number"}}),
]
"""Names that expressions may use, and their values."""
