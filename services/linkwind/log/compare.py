"""What differs between the messages of two logs, field by field, over all that both have."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.log.difference import Difference, Finder, ulp
from linkwind.spatial import Array

Columns = Mapping[str, NDArray[Any]]

KEYS = ("time_ns", "iteration", "final")  # tell which message of one run belongs to which of the other


class FieldDifference(NamedTuple):
    """How one field differs.

    Attributes:
        topic: of the log.
        field: of the message, dotted.
        first: where it begins.
        absolute: largest difference, in the field's unit.
        relative: that over the field's largest value in both logs.
        t: simulation time of the largest difference [s].
        body: of the largest difference, None for none.
        messages: in how many messages the field differs.
    """

    topic: str
    field: str
    first: Difference
    absolute: float
    relative: float
    t: float
    body: str | None
    messages: int


class Matched(NamedTuple):
    """Messages of one topic that two logs have in common, in order.

    Attributes:
        time_ns: simulation times [ns], shape (k,).
        one: columns of the first log, k rows each.
        other: columns of the second log, k rows each.
    """

    time_ns: NDArray[np.int64]
    one: Columns
    other: Columns


def match(one: Columns, other: Columns) -> Matched:
    """Pair the messages of two logs by simulation time, iteration and whether they end the run."""
    _, rows, others = np.intersect1d(_keys(one), _keys(other), return_indices=True)
    order = np.argsort(rows)
    mine = {name: values[rows[order]] for name, values in one.items()}
    theirs = {name: values[others[order]] for name, values in other.items()}
    return Matched(mine["time_ns"][:, 0].astype(np.int64), mine, theirs)


def _keys(columns: Columns) -> NDArray[Any]:
    names = [name for name in KEYS if name in columns]
    keys = np.empty(len(columns["time_ns"]), [(name, np.int64) for name in names])
    for name in names:
        keys[name] = columns[name][:, 0]
    return keys


def deviation(one: NDArray[Any], other: NDArray[Any]) -> Array:
    """Return |other − one|, 0 where the bits are the same, infinite where only one is finite."""
    same = bits(one) == bits(other)
    with np.errstate(invalid="ignore"):
        distance = np.abs(other.astype(np.float64) - one.astype(np.float64))
    return np.where(same, 0.0, np.where(np.isnan(distance), np.inf, distance))


def bits(values: NDArray[Any]) -> NDArray[Any]:
    """Return float64 as the integers that their bits make, integers as they are."""
    return np.ascontiguousarray(values).view(np.uint64) if values.dtype == np.float64 else values


def differences(
    topic: str, matched: Matched, finder: Finder, *, rtol: float, skip: frozenset[str] = frozenset()
) -> Iterator[FieldDifference]:
    """Yield what differs in a topic's messages by more than ``rtol`` times the largest value of the field.

    Args:
        topic: of both logs.
        matched: its messages.
        finder: names the bodies.
        rtol: 0 for every bit.
        skip: fields that are not compared.
    """
    for field in matched.one:
        if field in skip or not len(matched.time_ns):
            continue
        one, other = matched.one[field], matched.other.get(field, np.empty((len(matched.time_ns), 0)))
        if one.shape != other.shape:
            yield _other_size(topic, field, matched, one.shape[1], other.shape[1])
            continue
        if not one.size:
            continue
        distance = deviation(one, other)
        # A gap is a difference of positions, round-off most of the time.
        scale = largest(one, other, *_positions(matched) if field == "joint_gap" else ())
        beyond = distance > rtol * scale if rtol else bits(one) != bits(other)
        if beyond.any():
            yield _field(topic, field, matched, finder, np.where(beyond, distance, 0.0), beyond, scale)


def _positions(matched: Matched) -> list[NDArray[Any]]:
    return [side["motion.position"] for side in (matched.one, matched.other)]


def largest(*arrays: NDArray[Any]) -> float:
    """Return the largest absolute value that is finite, 0 if there is none."""
    values = np.abs(np.concatenate([array.ravel().astype(np.float64) for array in arrays]))
    return float(np.max(values, where=np.isfinite(values), initial=0.0))


def _other_size(topic: str, field: str, matched: Matched, one: int, other: int) -> FieldDifference:
    """Return the difference of a field that does not have the same number of values in both logs."""
    values = (f"{one} values", f"{other} values")
    first = Difference(*_at(topic, matched, 0), field, None, None, *values, None)
    everywhere = len(matched.time_ns)
    return FieldDifference(topic, field, first, math.inf, math.inf, first.time_ns / 1e9, None, everywhere)


def _at(topic: str, matched: Matched, row: int) -> tuple[str, int, int, int]:
    """Return topic, step, simulation time [ns] and iteration of a message."""
    columns = matched.one
    iteration = int(columns["iteration"][row, 0]) if "iteration" in columns else 0
    return topic, int(columns["step"][row, 0]), int(matched.time_ns[row]), iteration


def _field(
    topic: str,
    field: str,
    matched: Matched,
    finder: Finder,
    distance: Array,
    beyond: NDArray[np.bool_],
    scale: float,
) -> FieldDifference:
    row, column = (int(i) for i in np.argwhere(beyond)[0])
    worst, place = (int(i) for i in np.unravel_index(np.argmax(distance), distance.shape))
    one, other = (side[field][row, column].item() for side in (matched.one, matched.other))
    numbers = isinstance(one, float) and isinstance(other, float)
    element = None if distance.shape[1] == 1 else column
    first = Difference(
        *_at(topic, matched, row),
        field,
        element,
        finder.body(topic, field, element),
        one,
        other,
        ulp(one, other) if numbers else None,
    )
    absolute = float(distance[worst, place])
    return FieldDifference(
        topic,
        field,
        first,
        absolute,
        absolute / scale if scale else float("inf"),
        float(matched.time_ns[worst]) / 1e9,
        finder.body(topic, field, None if distance.shape[1] == 1 else place),
        int(beyond.any(axis=1).sum()),
    )
