"""The tables below the plots: the scenario, the versions, the scenario as the log holds it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from html import escape
from typing import Any

from linkwind.report.data import Run

_UNITS = {
    "mass": "kg",
    "inertia": "kg·m²",
    "position": "m",
    "angle_deg": "°",
    "velocity": "m/s",
    "angular_velocity": "rad/s",
    "parent_point": "m",
    "child_point": "m",
    "gravity": "m/s²",
    "density": "kg/m³",
    "wind": "m/s",
    "step": "s",
    "end": "s",
    "timeout": "s",
    "start_timeout": "s",
    "length": "m",
    "width": "m",
    "radius": "m",
    "diameter": "m",
    "points": "m",
    "span": "m",
    "amplitude": "m/s",
    "frequency": "Hz",
    "wavenumber": "1/m",
    "phase_deg": "°",
    "happened": "s",
    "at": "s",
}
_ROWS = 40  # of a list, all of which the scenario as logged has
_FIRST = ("name", "type", "model", "parent", "child", "mass", "inertia", "shape", "position")
_SETTINGS = ("time", "environment", "dynamics", "coupling", "bus", "log")


def tables(run: Run) -> str:
    """Return the collapsible tables; every text of the scenario and the log is escaped."""
    scenario = run.scenario
    raw = json.dumps(scenario, indent=2, ensure_ascii=False)
    blocks = [
        _block("Bodies", _records(scenario["bodies"]), opened=True),
        _block("Joints", _records(scenario.get("joints", ())), opened=True),
        _block("Events", _records(_events(run)), opened=True),
        _block("Force elements", _records(scenario.get("forces", ()))),
        _block("Force providers", _records(scenario.get("providers", ()))),
        _block("Settings", "".join(_pairs(scenario[name], name) for name in _SETTINGS if name in scenario)),
        _block("Versions and hashes", _pairs({**run.versions, "final_state_sha256": run.final_state_sha256})),
        _block("Scenario as logged", f"<pre>{escape(raw)}</pre>"),
    ]
    return "\n".join(block for block in blocks if block)


def _events(run: Run) -> list[dict[str, Any]]:
    """Return the events of the scenario with the time at which they happened."""
    times = run.trajectory.event_time
    last = times[-1] if len(times) else ()
    stated = run.scenario.get("events", ())
    happened = [float(at) if at >= 0.0 else "did not happen" for at in last[: len(stated)]]
    return [
        {"name": event["name"], "happened": at, **event} for event, at in zip(stated, happened, strict=False)
    ]


def number(value: float) -> str:
    """Return a number in at most 6 digits."""
    return f"{value:.6g}"


def _block(title: str, content: str, *, opened: bool = False) -> str:
    if not content:
        return ""
    attribute = " open" if opened else ""
    summary = f"<summary>{escape(title)}</summary>"
    return f'<details{attribute}>{summary}<div class="scroll">{content}</div></details>'


def _records(items: Iterable[Mapping[str, Any]]) -> str:
    """Return a table with a row for each item and a column for each key that any of them has."""
    items = list(items)
    if not items:
        return ""
    keys = _ordered(key for item in items for key, value in item.items() if value or key == "name")
    head = "".join(f"<th>{_heading(key)}</th>" for key in keys)
    rows = ("".join(f"<td>{_text(item.get(key))}</td>" for key in keys) for item in items)
    return f"<table><tr>{head}</tr>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</table>"


def _ordered(keys: Iterable[str]) -> list[str]:
    """Return each key once: first those that say what an item is, then the others as they come."""
    return sorted(dict.fromkeys(keys), key=lambda key: _FIRST.index(key) if key in _FIRST else len(_FIRST))


def _pairs(values: Mapping[str, Any], title: str = "") -> str:
    caption = f"<caption>{escape(title)}</caption>" if title else ""
    rows = (f"<tr><th>{_heading(key)}</th><td>{_text(value)}</td></tr>" for key, value in values.items())
    return f"<table>{caption}{''.join(rows)}</table>"


def _heading(key: str) -> str:
    unit = f" [{_UNITS[key]}]" if key in _UNITS else ""
    return escape(key.removesuffix("_deg").replace("_", " ") + unit)


def _part(key: str, value: Any) -> str:
    """Return one entry of a table inside a cell: ``length 0.5 m``, or just the name of a type."""
    label = "" if key == "type" else escape(key) + " "
    return f"{label}{_text(value)} {_UNITS.get(key, '')}".rstrip()


def _text(value: Any) -> str:
    """Return a value of the scenario as short HTML text."""
    if value is None or value in ([], {}, ""):
        return "–"
    match value:
        case bool():
            return "yes" if value else "no"
        case float() | int():
            return number(value)
        case [*items] if all(isinstance(item, float | int) for item in items):
            return "(" + ", ".join(number(item) for item in items) + ")"
        case [*items]:
            shown = items if len(items) <= _ROWS else [*items[: _ROWS // 2], f"… {len(items)} in all"]
            return "<br>".join(_text(item) for item in shown)
        case {"expression": str(text)}:
            return escape(text)
        case Mapping():
            return ", ".join(_part(key, value[key]) for key in _ordered(value) if value[key])
        case _:
            return escape(str(value))
