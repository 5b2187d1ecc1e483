"""What is in an FMU, as tables for people."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import zipfile
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from linkwind.fmi.slave import read_description

INTERFACES = ("CoSimulation", "ModelExchange", "ScheduledExecution")


def show(file: Path, out: Console) -> None:
    """Print model, platforms, capabilities and variables of an FMU.

    Raises:
        InputError: the file is not there or is no FMU.
    """
    description = read_description(file)
    out.print(_model(file, description))
    out.print(_capabilities(file))
    out.print(_variables(description))


def platforms(file: Path) -> list[str]:
    """Return the folders with binaries, and ``sources`` where there are C files."""
    with zipfile.ZipFile(file) as archive:
        names = [name.split("/") for name in archive.namelist() if not name.endswith("/")]
    found = {parts[1] for parts in names if parts[0] == "binaries" and len(parts) > 2}
    has_sources = any(parts[0] == "sources" and parts[-1].endswith(".c") for parts in names)
    return sorted(found) + (["sources"] if has_sources else [])


def _model(file: Path, description: Any) -> Table:
    experiment = description.defaultExperiment
    table = Table(show_header=False, box=None)
    rows = {
        "model": description.modelName,
        "description": description.description or "",
        "FMI": description.fmiVersion,
        "made by": description.generationTool or "",
        "platforms": ", ".join(platforms(file)) or "none",
        "default": f"to {experiment.stopTime} s in steps of {experiment.stepSize} s" if experiment else "",
        "variables": str(len(description.modelVariables)),
    }
    for name, value in rows.items():
        table.add_row(name, value)
    return table


def _capabilities(file: Path) -> Table:
    """The attributes of each interface, as the model description states them."""
    with zipfile.ZipFile(file) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
    interfaces = [element for name in INTERFACES if (element := root.find(name)) is not None]
    table = Table("capability", *(element.tag for element in interfaces))
    flags = {flag for element in interfaces for flag in element.attrib}
    for flag in sorted(flags):
        table.add_row(flag, *(element.get(flag, "") for element in interfaces))
    return table


def _variables(description: Any) -> Table:
    table = Table("name", "size", "causality", "variability", "unit", "start", "description")
    for variable in description.modelVariables:
        declared = variable.declaredType
        unit = variable.unit or (declared.unit if declared is not None else None) or ""
        size = " × ".join(map(str, variable.shape or ()))
        start = "" if variable.start is None else _short(str(variable.start))
        table.add_row(
            variable.name,
            size,
            variable.causality,
            variable.variability,
            unit,
            start,
            variable.description or "",
        )
    return table


def _short(text: str) -> str:
    return text if len(text) <= 24 else text[:23] + "…"
