"""Rows of a CSV file that a scenario names: cells, and in which line they stand."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from linkwind.scenario.problems import Problem, ProblemError


def cells(path: Path, content: str) -> list[tuple[int, list[str]]]:
    """Return lines and their cells, without empty lines and those that begin with #.

    Args:
        path: of the file, in UTF-8.
        content: what is expected in it, "the columns t and q", for errors.

    Raises:
        ProblemError: there is no such file, or no text in it.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, ValueError) as error:  # ValueError: no UTF-8, or a null byte in the path
        reason = error.strerror if isinstance(error, OSError) else "no text in UTF-8"
        raise ProblemError(
            [Problem((), f"a file with {content}", f"{path}: {reason}", "Check the path.")]
        ) from None
    return [
        (number, [cell.strip() for cell in next(csv.reader([line]))])
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.startswith("#")
    ]


def refuse_wrong(problems: Iterable[Problem], name: str, places: Sequence[str]) -> None:
    """Raise what is wrong with the rows of a file.

    Args:
        problems: at the index of the row; at no path what is wrong with all.
        name: of the file.
        places: of each row, "in line 3 of wing.csv".

    Raises:
        ProblemError: there are problems.
    """
    wrong = []
    for problem in problems:
        place = places[int(problem.path[0])] if problem.path else f"in {name}"
        wrong.append(replace(problem, path=(), expected=f"{problem.expected} {place}"))
    if wrong:
        raise ProblemError(wrong)
