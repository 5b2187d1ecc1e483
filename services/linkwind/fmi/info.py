"""What is in an FMU, for people and for programs."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from linkwind.errors import InputError
from linkwind.fmi.slave import read_description

INTERFACES = ("CoSimulation", "ModelExchange", "ScheduledExecution")


def facts(file: Path) -> dict[str, Any]:
    """Return model, platforms, capabilities and variables of an FMU, as ``fmu info --json`` prints them.

    Raises:
        InputError: the file is not there or is no FMU.
    """
    description = read_description(file)
    experiment = description.defaultExperiment
    try:
        stop, step = (
            None if text is None else float(text)
            for text in (getattr(experiment, "stopTime", None), getattr(experiment, "stepSize", None))
        )
    except ValueError as error:
        raise InputError(
            f"{file}: DefaultExperiment: expected numbers; got: {error}. Export it again."
        ) from None
    return {
        "model": description.modelName,
        "description": description.description or "",
        "fmi": description.fmiVersion,
        "made_by": description.generationTool or "",
        "platforms": platforms(file),
        "stop_s": stop,
        "step_s": step,
        "interfaces": _interfaces(file),
        "variables": [_variable(variable) for variable in description.modelVariables],
    }


def show(file: Path, out: Console) -> None:
    """Print what ``facts`` tells, as tables.

    Raises:
        InputError: the file is not there or is no FMU.
    """
    found = facts(file)
    out.print(_model(found))
    out.print(_capabilities(found["interfaces"]))
    out.print(_variables(found["variables"]))


def platforms(file: Path) -> list[str]:
    """Return the folders with binaries, and ``sources`` where there are C files."""
    with zipfile.ZipFile(file) as archive:
        names = [name.split("/") for name in archive.namelist() if not name.endswith("/")]
    found = {parts[1] for parts in names if parts[0] == "binaries" and len(parts) > 2}
    has_sources = any(parts[0] == "sources" and parts[-1].endswith(".c") for parts in names)
    return sorted(found) + (["sources"] if has_sources else [])


def _interfaces(file: Path) -> dict[str, dict[str, str | bool]]:
    """Return the attributes of each interface, as the model description states them."""
    with zipfile.ZipFile(file) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
    found = {name: element for name in INTERFACES if (element := root.find(name)) is not None}
    yes_no: dict[str, str | bool] = {"true": True, "false": False}
    return {
        name: {flag: yes_no.get(text, text) for flag, text in element.attrib.items()}
        for name, element in found.items()
    }


def _variable(variable: Any) -> dict[str, Any]:
    declared = variable.declaredType
    return {
        "name": variable.name,
        "type": variable.type,
        "shape": list(variable.shape or ()),
        "causality": variable.causality,
        "variability": variable.variability,
        "unit": variable.unit or (declared.unit if declared is not None else None),
        "start": None if variable.start is None else str(variable.start),
        "description": variable.description or "",
    }


def _model(found: dict[str, Any]) -> Table:
    table = Table(show_header=False, box=None)
    stop, step = found["stop_s"], found["step_s"]
    default = [
        *([] if stop is None else [f"to {stop} s"]),
        *([] if step is None else [f"in steps of {step} s"]),
    ]
    rows = {
        "model": found["model"],
        "description": found["description"],
        "FMI": found["fmi"],
        "made by": found["made_by"],
        "platforms": ", ".join(found["platforms"]) or "none",
        "default": " ".join(default),
        "variables": str(len(found["variables"])),
    }
    for name, value in rows.items():
        table.add_row(name, value)
    return table


def _capabilities(interfaces: dict[str, dict[str, str | bool]]) -> Table:
    table = Table("capability", *interfaces)
    for flag in sorted({flag for stated in interfaces.values() for flag in stated}):
        values = (stated.get(flag, "") for stated in interfaces.values())
        table.add_row(flag, *(value if isinstance(value, str) else str(value).lower() for value in values))
    return table


def _variables(variables: list[dict[str, Any]]) -> Table:
    table = Table("name", "type", "size", "causality", "variability", "unit", "start", "description")
    for each in variables:
        size = " × ".join(map(str, each["shape"]))
        plain = (each[key] for key in ("causality", "variability"))
        table.add_row(
            each["name"],
            each["type"],
            size,
            *plain,
            each["unit"] or "",
            _short(each["start"] or ""),
            each["description"],
        )
    return table


def _short(text: str) -> str:
    return text if len(text) <= 24 else text[:23] + "…"
