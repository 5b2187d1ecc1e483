"""One side of a run recorded, the other live: what both kinds have in common, and what their logs say."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

from linkwind.log.contents import CHANGES, RECORD, SUBSTITUTED
from linkwind.log.reader import Log
from linkwind.log.scenarios import recorded, recorded_changes
from linkwind.scenario import Scenario


def changed(log: Log, overrides: Sequence[str]) -> tuple[Scenario, dict[int, Scenario]]:
    """Return the scenarios of a log with other settings: the first, and the later ones by step.

    Raises:
        ScenarioError: a setting is wrong.
    """
    return recorded(log, overrides), recorded_changes(log, overrides)


def metadata(log: Log, live: str, changes: Mapping[int, Scenario]) -> dict[str, str]:
    """Return what the new log says of where it comes from; ``live`` is the side that was live."""
    record = {SUBSTITUTED: live, RECORD: str(log.path)}
    if changes:
        record[CHANGES] = json.dumps({str(step): each.to_json() for step, each in changes.items()})
    return record
