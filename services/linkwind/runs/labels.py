"""What the numbers of a log are called that belong to joints, events and force elements."""

from __future__ import annotations

from linkwind.errors import InputError
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded
from linkwind.mechanism import build
from linkwind.mechanism.labels import labels


def labels_of(log: Log) -> dict[str, tuple[str, ...]]:
    """Return the names by field, as in :mod:`linkwind.mechanism.labels`; nothing if no scenario tells."""
    try:
        return labels(build(recorded(log)))
    except InputError:
        return {}
