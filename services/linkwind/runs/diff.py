"""Compare two logs: what differs, where it starts, how it grows."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from linkwind.errors import LogError
from linkwind.log.compare import FieldDifference, Matched, deviation, differences, match
from linkwind.log.contents import FRAMES, MOTION, STATE, STEP, WRENCH
from linkwind.log.difference import Difference, printable
from linkwind.log.reader import Log, open_log
from linkwind.log.scenarios import recorded
from linkwind.mechanism import build
from linkwind.runs.comparison import finder
from linkwind.runs.framediff import frame_differences
from linkwind.spatial import Array

INTERVALS = 8  # of time, into which the growth is divided
GROWING = ("motion.position", "motion.orientation", "motion.linear", "motion.angular", "wrench")


@dataclass(frozen=True)
class Growth:
    """The largest differences of the accepted states within intervals of time.

    Attributes:
        fields: of State.
        rows: end of each interval [s], and the largest absolute difference of each field within it.
    """

    fields: tuple[str, ...]
    rows: tuple[tuple[float, tuple[float, ...]], ...]


@dataclass(frozen=True)
class Curves:
    """The largest difference of the accepted states at each communication point.

    Attributes:
        t: simulation time [s], shape (k,).
        distance: absolute difference by field of State, each of shape (k,).
    """

    t: Array
    distance: dict[str, Array]


@dataclass(frozen=True)
class Compared:
    """What differs between two logs.

    Attributes:
        first: the first difference, None if there is none.
        fields: all fields that differ.
        growth: from the first difference on; None if there is none.
        curves: the same at every communication point.
        points: communication points that both logs have.
        remarks: in which way the two runs cannot be the same, and what was not compared.
    """

    first: Difference | None
    fields: tuple[FieldDifference, ...]
    growth: Growth | None
    curves: Curves | None
    points: int
    remarks: tuple[str, ...]

    @property
    def identical(self) -> bool:
        """Whether nothing differs in what was compared."""
        return self.first is None

    def as_json(self) -> dict[str, Any]:
        """Return the comparison with the keys of ``linkwind diff --json``."""
        largest = {
            f"{d.topic} {d.field}": {
                "absolute": printable(d.absolute),
                "relative": printable(d.relative),
                "t": d.t,
                "body": d.body,
            }
            for d in self.fields
        }
        first = None if self.first is None else self.first.as_json()
        return {"identical": self.identical, "first_difference": first, "max_difference": largest or None}


def diff(one: Path, other: Path, *, rtol: float = 0.0) -> Compared:
    """Compare two logs over what both of them have.

    Args:
        one: a log.
        other: another one, of the same bodies.
        rtol: differences up to this part of a field's largest value count as none; 0 for every bit.

    Raises:
        LogError: a file is no log, or the two are of other bodies.
    """
    logs = open_log(one), open_log(other)
    left, right = (recorded(log) for log in logs)
    _refuse_other_bodies(*logs)
    remarks = list(_remarks(*logs))
    same_step = left.coupling.step_ns == right.coupling.step_ns
    if not same_step:
        remarks.append("the step sizes differ: only the accepted states are compared, at common times")
    elif rtol:
        remarks.append("/step is not compared: its numbers are themselves differences, which have no scale")
    names = finder(left, build(left))
    topics = _topics(*logs, same_step, rtol)
    matched = {topic: match(*(log.columns(topic) for log in logs)) for topic in topics}
    fields = [
        found
        for topic, pairs in matched.items()
        for found in differences(
            topic, pairs, names, rtol=rtol, skip=frozenset() if same_step else frozenset({"step"})
        )
    ]
    if same_step:
        for topic in _shown(*logs):
            fields += frame_differences(*logs, topic, rtol)
    states = matched.get(STATE)
    if states is None or not len(states.time_ns):
        raise LogError(f"{other}: expected a time in common with {one}; got none. Compare runs that overlap.")
    first = min((found.first for found in fields), key=lambda d: d.time_ns, default=None)
    if same_step and all(log.complete for log in logs) and (end := _end(states, *logs)) is not None:
        first = first or end
    curves = _curves(states) if fields else None
    growth = _growth(states, fields, curves) if curves else None
    return Compared(first, tuple(fields), growth, curves, len(states.time_ns), tuple(remarks))


def _shown(one: Log, other: Log) -> list[str]:
    """Return the topics of frames that both logs have."""
    return sorted(topic for topic in {*one.topics} & {*other.topics} if topic.startswith(FRAMES))


def _refuse_other_bodies(one: Log, other: Log) -> None:
    if one.bodies != other.bodies:
        raise LogError(
            f"{other.path}: expected the bodies of {one.path}, {', '.join(one.bodies)}; got "
            f"{', '.join(other.bodies)}. Compare two runs of the same bodies."
        )


def _topics(one: Log, other: Log, same_step: bool, rtol: float) -> list[str]:
    """Return the topics to compare, in the order in which a step makes their messages."""
    wrenches = [f"{WRENCH}{name}" for name in one.provider_bodies]
    topics = [MOTION, *wrenches, STATE, *([] if rtol else [STEP])] if same_step else [STATE]
    return [topic for topic in topics if topic in one.topics and topic in other.topics]


def _remarks(one: Log, other: Log) -> Iterator[str]:
    """Yield in which way the two runs are not the same from the start."""
    for log in (one, other):
        if log.damage is not None:
            yield f"{log.path} is not complete: {log.damage.text}"
        elif not log.complete:
            yield f"{log.path} is not complete: {log.error or 'the run was cut off'}"
    left, right = (dict(_flat(json.loads(log.scenario_json), "")) for log in (one, other))
    for key in sorted(left.keys() | right.keys()):
        values = left.get(key, "nothing"), right.get(key, "nothing")
        if values[0] != values[1] and key != "bus.transport":
            yield f"scenario: {key}: {values[0]} | {values[1]}"
    for name in sorted(one.versions.keys() & other.versions.keys()):
        if one.versions[name] != other.versions[name]:
            yield f"made with: {name}: {one.versions[name]} | {other.versions[name]}"
    library = one.metadata.get("library_sha256"), other.metadata.get("library_sha256")
    if library[0] != library[1]:
        yield "made with: another build of the C library"
    yield from _not_compared(one, other)


def _not_compared(one: Log, other: Log) -> Iterator[str]:
    for topic in sorted(one.topics.keys() ^ other.topics.keys()):
        yield f"only {one.path if topic in one.topics else other.path} has {topic}"


def _flat(value: Any, prefix: str) -> Iterator[tuple[str, Any]]:
    """Yield every leaf of a scenario with its dotted key."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, item in items:
            yield from _flat(item, f"{prefix}.{key}" if prefix else str(key))
    else:
        yield prefix, value


def _end(states: Matched, one: Log, other: Log) -> Difference | None:
    """Return the first communication point that only the longer one of two complete runs has."""
    steps = one.steps, other.steps
    if steps[0] == steps[1]:
        return None
    step, time_ns = int(states.one["step"][-1, 0]) + 1, int(states.time_ns[-1])
    there = ["one" if step <= count else "none" for count in steps]
    step_ns = time_ns // (step - 1) if step > 1 else 0
    return Difference(STATE, step, time_ns + step_ns, 0, "message", None, None, there[0], there[1], None)


def _curves(states: Matched) -> Curves:
    names = [name for name in GROWING if name in states.one and states.one[name].size]
    distance = {name: deviation(states.one[name], states.other[name]).max(axis=1) for name in names}
    return Curves(states.time_ns / 1e9, distance)


def _growth(states: Matched, fields: list[FieldDifference], curves: Curves) -> Growth:
    """Return the largest differences of the states in intervals from the first difference to the end."""
    start = min(found.first.time_ns for found in fields)
    edges = np.linspace(start, max(start, int(states.time_ns[-1])), INTERVALS + 1)
    rows = []
    for i, (low, high) in enumerate(pairwise(edges)):
        after = states.time_ns >= low if i == 0 else states.time_ns > low
        inside = after & (states.time_ns <= high)
        if inside.any():
            largest = tuple(float(values[inside].max()) for values in curves.distance.values())
            rows.append((float(high) / 1e9, largest))
    return Growth(tuple(curves.distance), tuple(rows))
