"""Functions of one or several variables as a scenario states them: expressions, or tables of points."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, GetJsonSchemaHandler, WithJsonSchema, model_validator
from pydantic_core import CoreSchema

from linkwind.scenario.problems import Problem, ProblemError, show
from linkwind.scenario.quantities import Section, numbers, quantity


def _point(value: Any) -> tuple[float, float]:
    expected = "a list of 2 numbers [variable, value]"
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ProblemError.value(expected, value, "For example [0.1, -2.0].")
    place, result = numbers(value, expected)
    return place, result


Point = Annotated[
    tuple[float, float],
    BeforeValidator(_point),
    WithJsonSchema({"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}),
]


class Function(Section):
    """An expression, or a curve through points over the first variable; a text alone is the expression."""

    expression: str | None = Field(default=None, description="Expression of the variables")
    table: tuple[Point, ...] | None = quantity(
        "Points [variable, value] with ascending variables; beyond the ends their values hold",
        "SI units",
        None,
        strict=False,
        min_length=2,
    )
    interpolation: Literal["linear", "cubic"] = Field(
        default="linear", description="linear; cubic: monotone between points, without kinks"
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
        for index, (before, after) in enumerate(pairwise(points)):
            if not after[0] > before[0]:
                expected = f"a variable above that of the point before, {before[0]!r}"
                got, path = show(list(after)), ("table", index + 1)
                raise ProblemError([Problem(path, expected, got, "Sort the points; each comes once.")])
        if self.periodic and points and points[0][1] != points[-1][1]:
            expected = f"a last value that is the first, {points[0][1]!r}, because it is periodic"
            path = ("table", len(points) - 1)
            raise ProblemError([Problem(path, expected, show(list(points[-1])), "Correct it.")])
        return self


def _function(value: Any) -> Any:
    if isinstance(value, bool):
        raise ProblemError.value("an expression, a number or a table", value, 'For example "2*sin(t)".')
    if isinstance(value, int | float):
        return {"expression": repr(value)}
    return {"expression": value} if isinstance(value, str) else value


AnyFunction = Annotated[Function, BeforeValidator(_function)]
