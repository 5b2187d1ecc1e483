"""The scenarios that a log holds: the one that its run was made from, and those that it went on with."""

from __future__ import annotations

from collections.abc import Sequence

from linkwind.errors import ScenarioError
from linkwind.log.reader import Log
from linkwind.log.versions import versions
from linkwind.scenario import Scenario, from_json


def recorded(log: Log, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario that the run of a log was made from, with other settings if there are any.

    Raises:
        ScenarioError: it is one of another version of linkwind, or a setting is wrong.
    """
    return _read(log, log.scenario_json, overrides)


def recorded_changes(log: Log, overrides: Sequence[str] = ()) -> dict[int, Scenario]:
    """Return the scenarios that a resumed run went on with, each by the step after which it counts.

    Raises:
        ScenarioError: as ``recorded``.
    """
    return {step: _read(log, text, overrides) for step, text in log.changes.items()}


def last_recorded(log: Log) -> Scenario:
    """Return the scenario that counted at the end of the run."""
    return [recorded(log), *recorded_changes(log).values()][-1]


def _read(log: Log, text: str, overrides: Sequence[str]) -> Scenario:
    name = f"{log.path}: scenario"
    try:
        from_json(text, name)
    except ScenarioError as error:
        made_by, here = log.versions.get("linkwind", "another version"), versions()["linkwind"]
        raise ScenarioError(
            f"{log.path}: expected a log of this linkwind, {here}; got one of {made_by}, whose scenario is "
            f"another. Use that version, or make the run again.\n{error}"
        ) from None
    return from_json(text, name, overrides)
