"""The kinds of value a scenario is written in: numbers with a unit, vectors, quaternions, names."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, StringConstraints, WithJsonSchema

from linkwind.scenario.problems import ProblemError

Vector3 = tuple[float, float, float]

_NUMBER = {"type": "number"}
WRITE_NUMBERS = "Write numbers without units or quotes."


class Section(BaseModel):
    """A table of the scenario: frozen, no unknown keys, no conversions between types."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def quantity(description: str, unit: str, default: Any = ..., **constraints: Any) -> Any:
    """Return a field that holds numbers, its unit kept for the schema and the error messages."""
    text = f"{description} [{unit}]"
    return Field(default=default, description=text, json_schema_extra={"unit": unit}, **constraints)


def numbers(value: Any, expected: str) -> tuple[float, ...]:
    """Return the finite numbers of a list, or the only one."""
    items = value if isinstance(value, list | tuple) else [value]
    finite = []
    for number in items:
        if isinstance(number, bool) or not isinstance(number, int | float):
            raise ProblemError.value(expected, value, WRITE_NUMBERS)
        try:
            finite.append(float(number))
        except OverflowError:
            raise ProblemError.value(expected, value, "Write a number below 1.8e308.") from None
    if not all(map(math.isfinite, finite)):
        raise ProblemError.value(
            expected.replace("numbers", "finite numbers"), value, "Write finite numbers."
        )
    return tuple(finite)


def vector(value: Any) -> Vector3:
    """Return the three numbers of a list of 2 or 3."""
    expected = "a list of 2 or 3 numbers"
    if not isinstance(value, list | tuple) or len(value) not in (2, 3):
        raise ProblemError.value(expected, value, "Write [x, y, z], or [x, y] where z is 0.")
    x, y, *z = numbers(value, expected)
    return x, y, z[0] if z else 0.0


def _turn_rate(value: Any) -> Vector3:
    if isinstance(value, list | tuple):
        if len(value) == 3:
            x, y, z = numbers(value, "3 numbers")
            return x, y, z
        advice = "Write [x, y, z], or one number for a turn about z."
        raise ProblemError.value("a number or a list of 3 numbers", value, advice)
    return 0.0, 0.0, numbers(value, "a number or a list of 3 numbers")[0]


def _quaternion(value: Any) -> tuple[float, float, float, float]:
    expected = "a unit quaternion of 4 numbers [w, x, y, z]"
    if not isinstance(value, list | tuple) or len(value) != 4:
        raise ProblemError.value(expected, value, "Write [w, x, y, z], body to world.")
    w, x, y, z = numbers(value, expected)
    norm = math.hypot(w, x, y, z)
    if abs(norm - 1.0) > 1e-6:
        if norm == 0.0:
            raise ProblemError.value(expected, value, "No turn is [1, 0, 0, 0].")
        unit = ", ".join(f"{part / norm:.17g}" for part in (w, x, y, z))
        raise ProblemError.value(expected, value, f"Its norm is {norm:.6g}; use [{unit}].")
    return w, x, y, z


def _pair(value: Any) -> tuple[float, float]:
    expected = "a list of 2 numbers"
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ProblemError.value(expected, value, "Write [lowest, highest].")
    low, high = numbers(value, expected)
    return low, high


def _one_or_more(value: Any) -> float | tuple[float, ...]:
    values = numbers(value, "a number or a list of numbers")
    return values if isinstance(value, list | tuple) else values[0]


def _array(least: int, most: int) -> dict[str, Any]:
    return {"type": "array", "items": _NUMBER, "minItems": least, "maxItems": most}


Vector = Annotated[Vector3, BeforeValidator(vector), WithJsonSchema(_array(2, 3))]
"""Three numbers; two are padded with z = 0."""

TurnRate = Annotated[Vector3, BeforeValidator(_turn_rate), WithJsonSchema({"anyOf": [_NUMBER, _array(3, 3)]})]
"""Three numbers; a single one is a turn about z."""

Quaternion = Annotated[
    tuple[float, float, float, float], BeforeValidator(_quaternion), WithJsonSchema(_array(4, 4))
]
"""A unit quaternion (w, x, y, z)."""

Interval = Annotated[tuple[float, float], BeforeValidator(_pair), WithJsonSchema(_array(2, 2))]
"""Two numbers."""

Numbers = Annotated[
    float | tuple[float, ...],
    BeforeValidator(_one_or_more),
    WithJsonSchema({"anyOf": [_NUMBER, {"type": "array", "items": _NUMBER}]}),
]
"""One number for every degree of freedom, or a list with a number for each."""

Name = Annotated[str, StringConstraints(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=64)]
"""A name that can stand in a key, a topic and an expression."""
