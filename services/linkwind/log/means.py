"""Means of a table's columns over a range of time, such as a beat or a period of shedding."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwind.errors import InputError

_TIME = "t [s]"
_ROWS = ("step", _TIME, "iteration")  # what they are, of which a mean says nothing


def means(
    columns: Mapping[str, NDArray[Any]], begin: float | None, end: float | None, where: str
) -> dict[str, float]:
    """Return the mean of each column by the trapezoidal rule; at the ends of the range by straight lines.

    Args:
        columns: of a table, with ``t [s]``, each of shape (rows,).
        begin: of the range [s]; None for that of the table.
        end: of the range [s]; None for that of the table.
        where: file of the table, for the error.

    Returns:
        means by title, in the units of the titles; NaN where a value within the range is.

    Raises:
        InputError: the range is none, or reaches beyond the table.
    """
    t = columns[_TIME]
    begin = float(t[0]) if begin is None else begin
    end = float(t[-1]) if end is None else end
    slack = 1e-9 * max(abs(t[0]), abs(t[-1]))  # of a sum of steps
    if not (t[0] - slack <= begin < end <= t[-1] + slack):
        raise InputError(
            f"{where}: expected a range of time within {t[0]:g} to {t[-1]:g} s, which it holds; got "
            f"{begin:g} to {end:g} s"
        )
    inside = t[(t > begin) & (t < end)]
    at = np.concatenate([[begin], inside, [end]])
    weights = 0.5 * (np.diff(at, prepend=begin) + np.diff(at, append=end)) / (end - begin)
    return {
        title: float(np.sum(weights * np.interp(at, t, column)))
        for title, column in columns.items()
        if title not in _ROWS
    }
