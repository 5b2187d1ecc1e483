"""Points of a function of one variable as a scenario states them: written out, or a file of rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

from linkwind.scenario.cells import cells, refuse_wrong
from linkwind.scenario.problems import Problem, ProblemError, show
from linkwind.scenario.quantities import numbers

FUNCTIONS = ("position", "force", "fx", "fy", "fz", "tx", "ty", "tz")  # keys of force elements
CLOSE = 1e-9  # between first and last value of a table that begins again, in parts of its range


def read(data: dict[str, Any], folder: Path | None) -> None:
    """Put the points of files in the place of their names, wherever force elements or the wind have tables.

    What is wrong with a file takes that place as well, and is told with what else is wrong with the scenario.

    Args:
        data: a scenario as plain data; changed in place.
        folder: where names of files start; None if there may be none, in data from elsewhere.
    """
    for function in _functions(data):
        if not isinstance(name := function.get("table"), str):
            continue
        if folder is None:
            advice = "Name files in a scenario's own file or with --set."
            function["table"] = ProblemError.value("points [variable, value]", name, advice)
            continue
        try:
            points = _file(folder / name, name, periodic=function.get("periodic") is True)
            function["table"] = [list(point) for point in points]
        except ProblemError as error:
            function["table"] = error


def _functions(data: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the functions of a scenario that are written as tables of keys."""
    forces, environment = data.get("forces"), data.get("environment")
    for force in forces if isinstance(forces, list) else ():
        entries = [force.get(key) for key in FUNCTIONS] if isinstance(force, dict) else []
        yield from (function for function in entries if isinstance(function, dict))
    wind = environment.get("wind") if isinstance(environment, dict) else None
    for component in wind if isinstance(wind, list) else ():
        if isinstance(component, dict):
            yield component


def wrong(points: Sequence[tuple[float, float]], *, periodic: bool) -> Iterator[Problem]:
    """Yield what is wrong with the numbers, at the index of the point."""
    for index, (before, after) in enumerate(pairwise(points), 1):
        if not after[0] > before[0]:
            expected = f"a variable above {before[0]!r} of the point before"
            yield Problem((index,), expected, show(list(after)), "Sort the points; each comes once.")
    if periodic and points and not _closed(points):
        expected = f"the first value again, {points[0][1]!r} (periodic)"
        yield Problem((len(points) - 1,), expected, show(list(points[-1])), "Correct it.")


def _closed(points: Sequence[tuple[float, float]]) -> bool:
    """Return whether first and last value are the same but for round-off, that of sin(2*pi) say."""
    values = [value for _, value in points]
    return abs(values[-1] - values[0]) <= CLOSE * (max(values) - min(values))


def _file(path: Path, name: str, *, periodic: bool) -> list[tuple[float, float]]:
    """Return the points of a file of two columns; a first line without numbers is their names."""
    lines = cells(path, "the columns variable and value")
    if lines and not any(map(_is_number, lines[0][1])):
        lines = lines[1:]
    places = [f"in line {number} of {name}" for number, _ in lines]
    points = [_pair(row, place) for (_, row), place in zip(lines, places, strict=True)]
    if len(points) < 2:
        raise ProblemError.value(f"at least 2 points in {name}", len(points), "Add rows: variable, value.")
    refuse_wrong(wrong(points, periodic=periodic), name, places)
    return points


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _pair(row: Sequence[str], place: str) -> tuple[float, float]:
    if len(row) != 2:
        expected = f"2 columns, variable and value, {place}"
        raise ProblemError([Problem((), expected, str(len(row)), "Separate them by a comma.")])
    for text in row:
        if not _is_number(text) or not math.isfinite(float(text)):
            raise ProblemError.value(f"finite numbers {place}", text, "Correct it.")
    return float(row[0]), float(row[1])


def _point(value: Any) -> tuple[float, float]:
    expected = "a list of 2 numbers [variable, value]"
    if not isinstance(value, list | tuple) or len(value) != 2:
        raise ProblemError.value(expected, value, "For example [0.1, -2.0].")
    place, result = numbers(value, expected)
    return place, result


def _points(value: Any) -> Any:
    """Return what stands for points, unless it is what is wrong with their file."""
    if isinstance(value, ProblemError):
        raise value
    return value


_SCHEMA = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
Point = Annotated[tuple[float, float], BeforeValidator(_point), WithJsonSchema(_SCHEMA)]
Points = Annotated[
    tuple[Point, ...],
    BeforeValidator(_points),
    WithJsonSchema({"anyOf": [{"type": "string"}, {"type": "array", "items": _SCHEMA, "minItems": 2}]}),
]
"""Points [variable, value] with ascending variables, or the name of a CSV file of them."""
