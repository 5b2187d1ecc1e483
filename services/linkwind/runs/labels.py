"""What the numbers of a log are called that belong to joints, events and force elements."""

from __future__ import annotations

from linkwind.errors import InputError
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded
from linkwind.mechanism import build
from linkwind.mechanism.labels import labels, units


def labels_of(log: Log) -> dict[str, tuple[str, ...]]:
    """Return titles by field, names and units: ``hinge.q [rad]``; nothing if no scenario tells.

    The names are those of :mod:`linkwind.mechanism.labels`.
    """
    try:
        mechanism = build(recorded(log))
    except InputError:
        return {}
    known = units(mechanism)
    return {
        field: tuple(f"{n} [{u}]" if u else n for n, u in zip(names, known[field], strict=True))
        for field, names in labels(mechanism).items()
    }
