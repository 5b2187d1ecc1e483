"""From a file, a built-in name or JSON to a validated scenario."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any, NoReturn

from pydantic import ValidationError

from linkwind.errors import ScenarioError
from linkwind.scenario import points, polars, translation
from linkwind.scenario.agreement import disagreements
from linkwind.scenario.model import Scenario
from linkwind.scenario.overrides import override
from linkwind.scenario.problems import Problem, ProblemError, nearest
from linkwind.scenario.shorthand import Source, expand
from linkwind.scenario.sound import sound

SHOWN = 5  # problems that one error reports, a line each

_PACKAGE = files("linkwind.scenario")


def builtin_names() -> list[str]:
    """Return the names of the scenarios that come with linkwind."""
    library = _PACKAGE.joinpath("library").iterdir()
    return sorted(entry.name.removesuffix(".toml") for entry in library if entry.name.endswith(".toml"))


def builtin_text(name: str) -> str:
    """Return a scenario that comes with linkwind as TOML.

    Raises:
        ScenarioError: there is none of this name.
    """
    if name not in builtin_names():
        near = nearest(name, builtin_names())
        advice = f'Use "{near}".' if near else "Choose one."
        raise ScenarioError(
            f"{name}: expected the name of a built-in scenario, {', '.join(builtin_names())}; got another. "
            f"{advice}"
        )
    return _PACKAGE.joinpath("library", f"{name}.toml").read_text(encoding="utf-8")


def load(source: str | Path, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario of a TOML file or of a built-in name.

    Args:
        source: path of a file, or the name of a built-in; a built-in goes before a file without suffix.
        overrides: ``KEY=VALUE`` arguments, see ``overrides.override``.

    Raises:
        ScenarioError: there is no such file or name, or something in it is wrong; one line a problem.
    """
    if isinstance(source, str) and source in builtin_names():
        return loads(builtin_text(source), f"{source}.toml", overrides)
    path = Path(source)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        if error.object.startswith(b"\x89MCAP"):
            raise ScenarioError(
                f"{path}: expected a scenario; got a log. linkwind verify does its run again, linkwind "
                "resume goes on with it."
            ) from None
        raise ScenarioError(
            f"{path}: expected text in UTF-8; got a wrong byte at position {error.start}. Save it as UTF-8."
        ) from None
    except (OSError, ValueError) as error:  # ValueError: a null byte in the path
        near = nearest(str(source), builtin_names()) if isinstance(error, FileNotFoundError) else None
        reason = error.strerror if isinstance(error, OSError) else str(error)
        advice = f'Use "{near}".' if near else "Check the path."
        raise ScenarioError(
            f"{source}: expected a file or one of {', '.join(builtin_names())}; got: {reason}. {advice}"
        ) from None
    return loads(text, str(path), overrides)


def loads(text: str, name: str, overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario of a TOML text; ``name`` is what errors call it, with or without a path.

    Raises:
        ScenarioError: something in it is wrong; one line a problem.
    """
    try:
        data = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        if text.lstrip().startswith("<"):
            raise ScenarioError(
                f"{name}: expected a scenario; got XML. Make one of a robot: linkwind mechanism import {name}"
            ) from None
        raise ScenarioError(
            f"{name}: expected valid TOML; got: {_flat(error)}{_quoted(error, text)}. {_advice(error)}"
        ) from None
    scenario = _scenario(data, name, overrides, Path(name).parent)
    scenario.called(name)
    return scenario


def from_json(text: str, name: str = "scenario.json", overrides: Sequence[str] = ()) -> Scenario:
    """Return the scenario that ``Scenario.to_json`` wrote, equal to the original without ``overrides``.

    Raises:
        ScenarioError: this is not JSON, or something in it is wrong; one line a problem.
    """
    try:
        data = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ScenarioError(f"{name}: expected valid JSON; got: {_flat(error)}. Correct it.") from None
    if not isinstance(data, dict):
        raise ScenarioError(f"{name}: expected an object; got {type(data).__name__}. Correct it.")
    return _scenario(data, name, overrides, None)


def template() -> str:
    """Return the commented scenario that ``linkwind init`` writes: every key, its unit and default."""
    return _PACKAGE.joinpath("template.toml").read_text(encoding="utf-8")


def _flat(error: Exception) -> str:
    return " ".join(str(error).split())


def _quoted(error: Exception, text: str) -> str:
    """Return the line of a text in which an error is, ready to follow its message."""
    at = re.search(r"at line (\d+)", str(error))
    line = text.replace("\r\n", "\n").split("\n")[int(at[1]) - 1].strip() if at else ""
    return f": {line if len(line) <= 60 else f'{line[:59]}…'}" if line else ""


def _advice(error: Exception) -> str:
    if re.match("Invalid value|Expected newline", str(error)):
        return "Write text in quotes, numbers with a point and without unit."
    return "Correct it."


def _scenario(data: dict[str, Any], name: str, overrides: Sequence[str], folder: Path | None) -> Scenario:
    """Return the scenario of plain data; names of files in it start in ``folder``, in overrides here."""
    source = Source(name, shorthand=False, overridden={}, data=data)
    try:
        data, shorthand = expand(copy.deepcopy(data), Path(name).stem)
        source = Source(name, shorthand, {}, data)
        polars.read(data, folder)
        points.read(data, folder)
        for argument in overrides:
            try:
                source.overridden[override(data, argument)] = argument
            except ProblemError as error:
                _refuse(error.problems, replace(source, file=f"--set {argument}", overridden={}))
        polars.read(data, Path())
        points.read(data, Path())
    except ProblemError as error:
        _refuse(error.problems, source)
    tables: dict[str, Any] = {}
    try:
        scenario = Scenario.model_validate(data, context=tables)
        problems = []
    except ValidationError as error:
        problems = translation.problems(error, Scenario)
    problems += disagreements(*sound(data, tables, problems))
    if problems:
        _refuse(problems, source)
    return scenario


def _refuse(problems: Sequence[Problem], source: Source) -> NoReturn:
    lines = [source.line(problem) for problem in problems[:SHOWN]]
    if len(problems) > SHOWN:
        lines.append(f"{source.file}: and {len(problems) - SHOWN} more")
    raise ScenarioError("\n".join(lines)) from None
