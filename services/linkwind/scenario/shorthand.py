"""What a file may leave out or write shorter: its name, and ``[aero]`` for one provider named aero."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

from linkwind.scenario.problems import Path, Problem, ProblemError, show


@dataclass(frozen=True)
class Source:
    """Where a scenario comes from, to name its parts in errors the way the user wrote them.

    Attributes:
        file: what an error starts with.
        shorthand: whether ``providers[0]`` was written as ``[aero]``, or left out.
        overridden: ``--set`` arguments by the path that they set.
        data: the scenario as plain data, in which the names of entries are looked up.
    """

    file: str
    shorthand: bool
    overridden: dict[Path, str]
    data: dict[str, Any]

    def written(self, path: Path) -> Path:
        """Return the path as it stands in the file."""
        if self.shorthand and len(path) > 1 and path[0] == "providers" and isinstance(path[1], int):
            return ("aero", *path[2:]) if path[1] == 0 else ("providers", path[1] - 1, *path[2:])
        return path

    def line(self, problem: Problem) -> str:
        """Return the problem as one line, with the file or the override that it comes from."""
        path, origin = problem.path, self.file
        for overridden, argument in self.overridden.items():
            shorter = min(len(path), len(overridden))
            if path and path[:shorter] == overridden[:shorter]:
                origin = f"--set {argument}"
        text = f"{origin}: {replace(problem, path=self.written(path)).line(entry_name(self.data, path))}"
        return " ".join(text.splitlines())


def entry_name(data: dict[str, Any], path: Path) -> str | None:
    """Return the name of the entry of a list of tables that a path leads to or through, if it has one."""
    try:
        name = data[str(path[0])][path[1]]["name"]
    except (LookupError, TypeError):
        return None
    return name if isinstance(name, str) else None


def expand(data: dict[str, Any], stem: str) -> tuple[dict[str, Any], bool]:
    """Return the data with name and providers written out, and whether providers[0] is ``[aero]``.

    A scenario without any provider gets one that exerts no force, so that every run has one.

    Raises:
        ProblemError: ``[aero]`` cannot become an entry of providers.
    """
    data = dict(data)
    data.setdefault("name", re.sub(r"^[^\w]|[^\w.-]", "_", stem) or "scenario")
    providers = data.get("providers", [])
    if not isinstance(providers, list):
        problem = Problem(("providers",), "a list of tables", show(providers), "Write [[providers]].")
        raise ProblemError([problem])
    if "aero" not in data and providers:
        return data, False
    aero = data.pop("aero", {"model": "none"})
    if isinstance(aero, dict):
        if "name" in aero:
            advice = "Remove it, or write [[providers]]."
            raise ProblemError(
                [Problem(("aero", "name"), "no name besides aero", show(aero["name"]), advice)]
            )
        aero = {"name": "aero", **aero}
    data["providers"] = [aero, *providers]
    return data, True
