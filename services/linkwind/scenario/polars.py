"""Coefficients of a section over its angle of attack as a scenario states them: rows, or a file of rows."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

from linkwind.scenario.cells import cells, refuse_wrong
from linkwind.scenario.problems import Problem, ProblemError
from linkwind.scenario.quantities import numbers

Row = tuple[float, float, float, float]

COLUMNS = ("alpha_deg", "cl", "cd", "cm")
_ROW = f"[{', '.join(COLUMNS)}]"
# From where to where a table may go; the symmetry of the section gives the rest of the circle.
RANGES = ((-180.0, 180.0), (0.0, 180.0), (0.0, 90.0))
_CLOSE = 1e-6  # to a moment that follows from the drag


def read(data: dict[str, Any], folder: Path | None) -> None:
    """Put the rows of files in the place of their names, wherever plates have tables.

    What is wrong with a file takes that place as well, and is told with what else is wrong with the scenario.

    Args:
        data: a scenario with its providers written out; changed in place.
        folder: where names of files start; None if there may be none, in data from elsewhere.
    """
    providers = data["providers"]
    for provider in providers if isinstance(providers, list) else ():
        plate = provider.get("plate") if isinstance(provider, dict) else None
        if not isinstance(plate, dict) or not isinstance(name := plate.get("table"), str):
            continue
        if folder is None:
            advice = "Name files in a scenario's own file or with --set."
            plate["table"] = ProblemError.value(f"rows {_ROW}", name, advice)
            continue
        try:
            plate["table"] = [list(row) for row in _file(folder / name, name)]
        except ProblemError as error:
            plate["table"] = error


def _file(path: Path, name: str) -> list[Row]:
    """Return the rows of a file, its columns by name in any order; lines that begin with # say nothing."""
    lines = cells(path, f"the columns {', '.join(COLUMNS)}")
    head = lines[0][1] if lines else []
    for column in COLUMNS:
        if head.count(column) != 1:
            expected = f"the columns {', '.join(COLUMNS)} in the first line of {name}, each once"
            got, advice = ", ".join(head) or "nothing", f'Correct "{column}".'
            raise ProblemError([Problem((), expected, got, advice)])
    places = [f"in line {number} of {name}" for number, _ in lines[1:]]
    rows = [_row(head, row, place) for (_, row), place in zip(lines[1:], places, strict=True)]
    refuse_wrong(_wrong(rows), name, places)
    return rows


def _row(head: Sequence[str], row: Sequence[str], place: str) -> Row:
    if len(row) != len(head):
        expected = f"{len(head)} columns {place}"
        raise ProblemError([Problem((), expected, str(len(row)), "Separate them by commas.")])
    found = {}
    for column in COLUMNS:
        text = row[head.index(column)]
        try:
            found[column] = float(text)
        except ValueError:
            found[column] = math.nan
        if not math.isfinite(found[column]):
            raise ProblemError.value(f"a finite number for {column} {place}", text, "Correct it.")
    return found["alpha_deg"], found["cl"], found["cd"], found["cm"]


def _rows(value: Any) -> tuple[Row, ...]:
    """Return the rows that are written out, or were read."""
    if isinstance(value, ProblemError):
        raise value
    entries = value if isinstance(value, list | tuple) else []
    if not entries or not all(isinstance(entry, list | tuple) and len(entry) == 4 for entry in entries):
        raise ProblemError.value(f"rows {_ROW}", value, "For example [[0, 0, 0.1, 0], [90, 0, 1.9, -0.475]].")
    rows = [numbers(entry, f"rows of 4 numbers {_ROW}") for entry in entries]
    found = tuple((alpha, lift, drag, moment) for alpha, lift, drag, moment in rows)
    if wrong := list(_wrong(found)):
        raise ProblemError(wrong)
    return found


def _wrong(rows: Sequence[Row]) -> Iterator[Problem]:
    """Yield what is wrong with the numbers, at the index of the row; at no path what is wrong with all."""
    for i, (before, after) in enumerate(pairwise(rows), 1):
        if not after[0] > before[0]:
            expected = f"alpha_deg above {before[0]!r} of the row before"
            yield Problem((i,), expected, repr(after[0]), "Sort the rows; each comes once.")
    for i, (_, _, drag, _) in enumerate(rows):
        if drag < 0.0:
            yield Problem((i,), "cd of at least 0", repr(drag), "Drag takes energy: correct the sign.")
    ends = (rows[0][0], rows[-1][0]) if rows else ()
    if ends in RANGES:
        yield from _where_it_closes(rows)
    else:
        expected = "rows from alpha_deg -180 to 180, from 0 to 180 or from 0 to 90"
        got = f"{ends[0]!r} to {ends[1]!r}" if ends else "no rows"
        yield Problem((), expected, got, "A plate that moves meets the air from all sides: add rows.")


def _where_it_closes(rows: Sequence[Row]) -> Iterator[Problem]:
    """The first and the last row are the same, or their own mirror images."""
    last = len(rows) - 1
    if rows[0][0] < 0.0:
        for column, one, other in zip(COLUMNS[1:], rows[0][1:], rows[last][1:], strict=True):
            if one != other:
                expected = f"{column} {one!r} as at -180 degrees"
                yield Problem((last,), expected, repr(other), "It is the same angle: correct one of the two.")
        return
    advice = "Correct it, or write the table from -180 to 180."
    for i, (alpha, lift, drag, moment) in ((0, rows[0]), (last, rows[last])):
        about = -0.25 * drag if alpha == 90.0 else 0.0
        why = " (-cd/4: no moment about the middle of the chord)" if about else ""
        if lift != 0.0:
            yield Problem((i,), f"cl 0 by symmetry at {alpha:g} degrees", repr(lift), advice)
        if abs(moment - about) > _CLOSE:
            yield Problem((i,), f"cm {about:.6g} by symmetry at {alpha:g} degrees{why}", repr(moment), advice)


Rows = Annotated[
    tuple[Row, ...],
    BeforeValidator(_rows),
    WithJsonSchema(
        {
            "anyOf": [
                {"type": "string"},
                {
                    "type": "array",
                    "items": {"type": "array", "items": {"type": "number"}, "minItems": 4, "maxItems": 4},
                    "minItems": 2,
                },
            ]
        }
    ),
]
"""Rows [alpha_deg, cl, cd, cm] that reach around the circle, or to where symmetry goes on."""
