"""``--set KEY=VALUE``: one key of a scenario, changed from outside the file."""

from __future__ import annotations

import tomllib
from typing import Any

from linkwind.scenario.problems import Path, Problem, ProblemError, choice, show

# Lists that a file may leave out, and what they are then.
LISTS: dict[Path, list[float]] = {
    ("bodies",): [],
    ("joints",): [],
    ("events",): [],
    ("forces",): [],
    ("providers",): [],
    ("environment", "gusts"): [],
    ("environment", "wind"): [0.0, 0.0, 0.0],
}


def override(data: dict[str, Any], argument: str) -> Path:
    """Set one key of ``data`` in place and return the path that was set.

    ``KEY`` is the path with dots; an entry of a list is named by its index or its name, as in
    ``bodies.0.mass`` and ``bodies.link1.mass``; ``aero`` means ``providers.aero``. ``VALUE`` is a TOML
    value; what is not one is taken as a string, so that ``coupling.scheme=explicit`` needs no quotes.
    Whether the key exists and the value fits is left to the validation that follows.

    Raises:
        ProblemError: the argument is not KEY=VALUE, or the path leads through something that has no keys.
    """
    key, equals, text = argument.partition("=")
    parts = [part.strip() for part in key.split(".")]
    if not equals or not all(parts):
        raise ProblemError.value("KEY=VALUE", argument, "For example coupling.step=5e-4.")
    if parts[0] == "aero":
        parts.insert(0, "providers")
    container: Any = data
    path: Path = ()
    for part in parts[:-1]:
        step = _entry(container, path, part)
        path = (*path, step)
        if isinstance(step, str):
            container = container.setdefault(step, list(LISTS[path]) if path in LISTS else {})
        else:
            container = container[step]
    last = _entry(container, path, parts[-1])
    container[last] = _value(text)
    return (*path, last)


def _entry(container: Any, path: Path, part: str) -> str | int:
    """Return the key or index that ``part`` stands for in ``container``, which lies at ``path``."""
    if isinstance(container, dict):
        return part
    if not isinstance(container, list):
        advice = "Set it as a whole, or name one of its own keys."
        raise ProblemError([Problem(path, f"a table with the key {part}", show(container), advice)])
    if part.isascii() and part.isdigit() and int(part) < len(container):
        return int(part)
    names = [entry.get("name") if isinstance(entry, dict) else None for entry in container]
    if part in names:
        return names.index(part)
    known = [name for name in names if isinstance(name, str)]
    if known or not container:
        raise ProblemError([choice(path, "the index or name of an entry:", known, part)])
    expected = f"an index from 0 to {len(container) - 1}"
    raise ProblemError([Problem(path, expected, show(part), "Use one of these.")])


def _value(text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text.strip()
    # A line break could smuggle in a second key.
    return parsed["value"] if list(parsed) == ["value"] else text.strip()
