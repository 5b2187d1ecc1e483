"""Pydantic's errors in the scenario's words: item, expected, got, what to do."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from linkwind.scenario.problems import Path, Problem, ProblemError, choice, nearest, show

_KINDS = {
    "float_type": "a number",
    "finite_number": "a finite number",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "int_parsing_size": "a smaller whole number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "string_too_long": "a shorter text",
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "tuple_type": "a list",
}
_LIMITS = {
    "greater_than": ("above", "gt"),
    "greater_than_equal": ("of at least", "ge"),
    "less_than_equal": ("of at most", "le"),
}


def problems(error: ValidationError, model: type[BaseModel]) -> list[Problem]:
    """Return what pydantic found wrong with the data of ``model``, in its order."""
    details = error.errors(include_url=False)
    missing = {detail["loc"] for detail in details if detail["type"] == "missing"}
    meant: set[Path] = set()  # missing keys that a misspelled one explains
    found: list[Problem] = []
    for detail in details:
        path: Path = detail["loc"]
        cause = detail.get("ctx", {}).get("error")
        if isinstance(cause, ProblemError):
            found += [problem.below(path) for problem in cause.problems]
        elif detail["type"] == "extra_forbidden":
            found.append(_unknown_key(path, model))
            near = nearest(str(path[-1]), _keys(path, model))
            meant |= missing & {(*path[:-1], near or "")}
        elif detail["type"] == "too_short" and any(_inside(other["loc"], path) for other in details):
            pass  # pydantic does not count entries that have errors of their own
        else:
            found.append(_problem(detail, path, model))
    return [
        replace(problem, path=_as_written(problem.path, model))
        for problem in found
        if problem.path not in meant
    ]


def _inside(path: Path, table: Path) -> bool:
    return len(path) > len(table) and path[: len(table)] == table


def _problem(detail: ErrorDetails, path: Path, model: type[BaseModel]) -> Problem:
    kind, got = detail["type"], show(detail["input"])
    field = _field(model, path)
    unit = _unit(field)
    if kind == "missing":
        described = f" ({field.description})" if field else ""
        return Problem(path, f"a value{described}", "nothing", f"Add {_header(model, path)}.")
    if kind == "union_tag_not_found":
        words = list(_kinds(_annotation(model, path)))
        return Problem((*path, "type"), f"one of {', '.join(words)}", "nothing", "Add type.")
    if kind == "union_tag_invalid":
        words = list(_kinds(_annotation(model, path)))
        return choice((*path, "type"), "one of", words, detail["input"]["type"])
    if kind == "literal_error":
        expected = str(detail["ctx"]["expected"])
        words = re.findall(r"'([^']*)'", expected)
        if words:
            return choice(path, "one of", words, detail["input"])
        numbers = "Write the number alone, without quotes." if isinstance(detail["input"], str) else ""
        return Problem(path, expected, got, numbers or "Use one of these.")
    if kind in _LIMITS:
        words_of, key = _LIMITS[kind]
        limit = detail["ctx"][key]
        return Problem(path, f"a number {words_of} {limit:g}{unit}", got, "Change the value.")
    if kind in ("too_short", "too_long"):
        leave_out = "" if field is None or field.is_required() else ", or leave the key out"
        return Problem(path, "at least one entry", got, f"Add an entry{leave_out}.")
    if kind == "string_pattern_mismatch":
        advice = "Start with a letter; go on with letters, digits and _."
        return Problem(path, "a name", got, advice)
    if kind in _KINDS:
        return Problem(path, _KINDS[kind] + unit, got, _advice(kind, detail["input"], unit))
    return Problem(path, f"a valid value ({detail['msg']})", got, "Change the value.")


def _header(model: type[BaseModel], path: Path) -> str:
    """Return how a file writes what is at a path: as a table, a list of tables, or a key."""
    annotation = _annotation(model, path)
    if _plain(annotation) is not None:
        return f"[{path[-1]}]"
    return f"[[{path[-1]}]]" if _plain(_entry(annotation)) is not None else str(path[-1])


def _advice(kind: str, value: Any, unit: str) -> str:
    if kind in ("float_type", "int_type") and isinstance(value, str):
        return "Write the number alone, without quotes" + (" and unit." if unit else ".")
    examples = {
        "int_from_float": "Write it without a decimal point.",
        "int_type": "Write it without a decimal point.",
        "bool_type": "Write true or false, without quotes.",
        "string_type": 'Write it as "…".',
        "model_type": "Write it as [table] or { key = value }.",
        "model_attributes_type": "Write it as [table] or { key = value }.",
        "dict_type": "Write it as [table] or { key = value }.",
        "tuple_type": "Write it as [[table]] or [a, b].",
    }
    return examples.get(kind, "Change the value.")


def _unknown_key(path: Path, model: type[BaseModel]) -> Problem:
    keys, word = _keys(path, model), str(path[-1])
    near = nearest(word, keys)
    advice = f'Use "{near}".' if near else "Remove it."
    return Problem(path, f"a key among {', '.join(keys)}", show(word), advice)


def _keys(path: Path, model: type[BaseModel]) -> list[str]:
    """Return the keys that the table around a path may have."""
    owner = _model(model, path[:-1]) or model
    return [*owner.model_fields, "aero"] if "providers" in owner.model_fields else list(owner.model_fields)


def _unit(field: FieldInfo | None) -> str:
    extra: Mapping[str, Any] | Callable[..., None] | None = field.json_schema_extra if field else None
    unit = extra.get("unit") if isinstance(extra, Mapping) else None
    return f" [{unit}]" if unit else ""


def _field(model: type[BaseModel], path: Path) -> FieldInfo | None:
    """Return the field that a path ends in, or None where it ends in an entry of a list or table."""
    owner = _model(model, path[:-1])
    return owner.model_fields.get(str(path[-1])) if owner and path else None


def _model(model: type[BaseModel], path: Path) -> type[BaseModel] | None:
    """Return the model of the table at a path, which may name the kind of a table that has several."""
    return _plain(_annotation(model, path))


def _annotation(model: type[BaseModel], path: Path) -> Any:
    """Return the annotation of what is at a path."""
    annotation: Any = model
    for part in path:
        kinds, owner = _kinds(annotation), _plain(annotation)
        if isinstance(part, str) and owner is not None and part in owner.model_fields:
            annotation = owner.model_fields[part].annotation
        elif part in kinds:
            annotation = kinds[str(part)]
        else:  # an index into a list, or a name in a table of tables
            annotation = _entry(annotation)
    return annotation


def _as_written(path: Path, model: type[BaseModel]) -> Path:
    """Return a path without the kinds that pydantic puts in: shape.plate.length is shape.length."""
    kinds = [_kinds(_annotation(model, path[:at])) for at in range(len(path))]
    return tuple(part for part, known in zip(path, kinds, strict=True) if part not in known)


def _kinds(annotation: Any) -> dict[str, type[BaseModel]]:
    """Return the models that an annotation is a choice of, by their ``type``; none where it has one."""
    parts = [part for part in get_args(annotation) if isinstance(part, type)]
    models = [part for part in parts if issubclass(part, BaseModel)]
    if len(models) < 2:
        return {}
    return {get_args(model.model_fields["type"].annotation)[0]: model for model in models}


def _plain(annotation: Any) -> type[BaseModel] | None:
    """Return the one model that an annotation is, or is besides None."""
    options = [annotation, *get_args(annotation)] if type(None) in get_args(annotation) else [annotation]
    models = [part for part in options if isinstance(part, type) and issubclass(part, BaseModel)]
    return models[0] if len(models) == 1 else None


def _entry(annotation: Any) -> Any:
    """Return the annotation of the entries of a list or a table."""
    parts = [part for part in get_args(annotation) if part is not Ellipsis]
    entry = parts[-1] if parts else None
    return get_args(entry)[0] if hasattr(entry, "__metadata__") else entry  # a choice has its key with it
