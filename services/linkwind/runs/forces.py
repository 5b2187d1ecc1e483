"""The forces on the bodies in two logs of one motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from linkwind.log.compare import match
from linkwind.log.contents import STATE, WRENCH
from linkwind.log.reader import Log
from linkwind.spatial import Array

QUANTITIES = {"force": ("N", slice(0, 3)), "torque": ("N·m", slice(3, 6))}


class ForceDifference(NamedTuple):
    """How the total force, or torque, on a body differs.

    Attributes:
        body: its name.
        quantity: ``force`` or ``torque``.
        unit: of the numbers.
        recorded: root of the mean square over the communication points, of the recorded run.
        live: the same, of the live provider.
        difference: the same, of the difference.
        largest: difference.
        t: simulation time of that [s].
    """

    body: str
    quantity: str
    unit: str
    recorded: float
    live: float
    difference: float
    largest: float
    t: float


def force_differences(recorded: Log, live: Log, bodies: Sequence[str]) -> Iterator[ForceDifference]:
    """Yield how the total wrenches in the states of two logs differ, for each of ``bodies``.

    Raises:
        LogError: a log has no state.
    """
    matched = match(recorded.columns(STATE), live.columns(STATE))
    one, other = (side["wrench"].reshape(len(side["wrench"]), -1, 6) for side in (matched.one, matched.other))
    for body in bodies:
        place = recorded.bodies.index(body)
        for quantity, (unit, part) in QUANTITIES.items():
            was, now = one[:, place, part], other[:, place, part]
            off = np.linalg.norm(now - was, axis=1)
            worst = int(np.argmax(off))
            sizes = _rms(was), _rms(now), _rms(now - was), float(off[worst])
            yield ForceDifference(body, quantity, unit, *sizes, float(matched.time_ns[worst]) / 1e9)


def same_answers(recorded: Log, live: Log, provider: str) -> tuple[int, int]:
    """Return how many answers of a provider have the same bits in two logs, and how many both have."""
    topic = WRENCH + provider
    pairs = zip(recorded.raw(topic), live.raw(topic), strict=False)
    same = [one == other for one, other in pairs]
    return sum(same), len(same)


def _rms(vectors: Array) -> float:
    return float(np.sqrt((vectors**2).sum(axis=1).mean()))
