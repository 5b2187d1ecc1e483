"""What is known of a scenario of which some tables are wrong, so that the rest can be checked as well."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any

from linkwind.scenario.model import Scenario
from linkwind.scenario.problems import Problem


@dataclass(frozen=True)
class Named:
    """An entry of a list of tables of which only the name is known."""

    name: str


def sound(
    data: Mapping[str, Any], tables: Mapping[str, Any], problems: Collection[Problem]
) -> tuple[Scenario, set[str]]:
    """Return the part of a scenario that is right in itself, and what is known of it.

    Args:
        data: the whole, as plain data.
        tables: those of its tables that are right in themselves.
        problems: what is wrong with the others.

    Returns:
        A scenario that has only the tables that are known. Known are a table, ``joints``, or at least what
        its entries are called, ``joints.name``: enough to say whether others refer to one that is there.
    """
    fields = Scenario.model_fields
    misspelled = any(key not in fields for key in data)  # then what is not there may be meant by it
    absent = {key for key, field in fields.items() if key not in data and not field.is_required()}
    known = set(tables) if misspelled else set(tables) | absent
    unnamed = {problem.path[0] for problem in problems if problem.path[2:] == ("name",)}
    named: dict[str, Any] = {
        key: names for key in data if key not in known | unnamed and (names := _names(data[key]))
    }
    known |= {f"{key}.name" for key in (*named, *known)}
    return Scenario.model_construct(**{**tables, **named}), known


def _names(entries: Any) -> tuple[Named, ...]:
    """Return what is known of the entries of a list; nothing if one of them has no name."""
    if not isinstance(entries, list):
        return ()
    names = [entry.get("name") if isinstance(entry, dict) else None for entry in entries]
    found = tuple(Named(name) for name in names if isinstance(name, str))
    return found if len(found) == len(names) else ()
