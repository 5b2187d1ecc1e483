"""What differs between the frames of a fluid in two logs; one frame of each is in memory at a time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwind.frames import Frame, WakeFrame
from linkwind.log.compare import FieldDifference, deviation, largest
from linkwind.log.difference import Difference, single_ulp
from linkwind.log.reader import Log

GRID = "grid"  # in the place of a field, where the cells, or the rings, of two frames are not the same


@dataclass
class _Found:
    """What has been found of a field so far."""

    first: Difference
    absolute: float
    t: float
    frames: int


def frame_differences(one: Log, other: Log, topic: str, rtol: float) -> list[FieldDifference]:
    """Return what differs by more than ``rtol`` times the largest value of a field.

    Args:
        one: a log.
        other: another one.
        topic: of frames that both have.
        rtol: 0 for every bit.
    """
    scales = _scales(one, other, topic)
    found: dict[str, _Found] = {}
    for left, right in _pairs(one, other, topic):
        if not _same_cells(left, right, rtol):
            _note(found, topic, GRID, left, (None, _where(left), _where(right), None), math.inf)
        if left.shape != right.shape:
            continue
        for field in left.ARRAYS:
            worst = _worst(getattr(left, field), getattr(right, field), rtol * scales[field], rtol)
            if worst is not None:
                _note(found, topic, field, left, worst[0], worst[1])
    return [
        FieldDifference(
            topic, field, each.first, each.absolute,
            each.absolute / scales[field] if scales.get(field) else math.inf, each.t, None, each.frames,
        )
        for field, each in found.items()
    ]  # fmt: skip


def _pairs(one: Log, other: Log, topic: str) -> Iterator[tuple[Frame, Frame]]:
    """Yield the frames that both logs have of the same time."""
    mine, theirs = one.shown(topic), other.shown(topic)
    left, right = next(mine, None), next(theirs, None)
    while left is not None and right is not None:
        if left.time_ns == right.time_ns:
            yield left, right
        step_left, step_right = left.time_ns <= right.time_ns, right.time_ns <= left.time_ns
        left = next(mine, None) if step_left else left
        right = next(theirs, None) if step_right else right


def _scales(one: Log, other: Log, topic: str) -> dict[str, float]:
    scales: dict[str, float] = {}
    for log in (one, other):
        for frame in log.shown(topic):
            for field in frame.ARRAYS:
                scales[field] = max(scales.get(field, 0.0), largest(getattr(frame, field)))
    return scales


def _same_cells(left: Frame, right: Frame, rtol: float) -> bool:
    """Tell whether two grids are the same but for ``rtol`` of a cell's side, or as many rings."""
    if left.shape != right.shape:
        return False
    if isinstance(left, WakeFrame) or isinstance(right, WakeFrame):
        return getattr(left, "bound", None) == getattr(right, "bound", None)
    off = np.abs(np.subtract(left.origin, right.origin)).max()
    return bool(max(off, abs(left.cell - right.cell)) <= rtol * left.cell)


def _where(frame: Frame) -> str:
    if isinstance(frame, WakeFrame):
        return f"{frame.shape} rings, {frame.bound} rows of them on the wing"
    return str(frame.extent)


def _worst(one: Any, other: Any, limit: float, rtol: float) -> tuple[tuple[Any, ...], float] | None:
    """Return element, both values and ULP of the first difference, and the largest one; None for none."""
    bits = [np.ascontiguousarray(side).ravel().view(np.int32) for side in (one, other)]
    distance = deviation(one.astype(np.float64).ravel(), other.astype(np.float64).ravel())
    beyond = distance > limit if rtol else bits[0] != bits[1]
    if not beyond.any():
        return None
    i = int(np.argmax(beyond))
    values = one.flat[i].item(), other.flat[i].item()
    place = (i, *values, single_ulp(*(int(side[i]) for side in bits)))
    return place, float(distance[beyond].max())


def _note(
    found: dict[str, _Found], topic: str, field: str, frame: Frame, place: tuple[Any, ...], size: float
) -> None:
    t = frame.time_ns / 1e9
    if field not in found:
        element, recorded, again, ulp = place
        at = (topic, frame.step, frame.time_ns, 0, field)
        found[field] = _Found(Difference(*at, element, None, recorded, again, ulp), size, t, 1)
        return
    each = found[field]
    each.frames += 1
    if size > each.absolute:
        each.absolute, each.t = size, t
