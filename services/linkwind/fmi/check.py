"""Is a file a good FMU? What FMPy says, what other tools say, and whether it meets its own references."""

from __future__ import annotations

import csv
import io
import posixpath
import xml.etree.ElementTree as ET
import zipfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwind.errors import InputError
from linkwind.fmi.peers import CHECKERS
from linkwind.fmi.reference import EXPERIMENTS_TYPE, FOLDER
from linkwind.fmi.slave import Slave, read_description
from linkwind.spatial import Array

# Of a reference: other processors and C libraries differ in the last digits, errors in much more.
TOLERANCE = 1e-6

Table = list[tuple[float, dict[str, Array]]]  # time [s] and variables of each row


@dataclass(frozen=True)
class Checked:
    """What checks have found.

    Attributes:
        errors: what is wrong, who says so first; empty for a good FMU.
        checkers: what each checker did: ``ok``, ``failed``, ``not installed``, or why it was left out.
        reference_max_error: largest deviation from the FMU's reference results, relative to the largest
            value of the variable or to 1; None without reference results.
    """

    errors: tuple[str, ...]
    checkers: dict[str, str]
    reference_max_error: float | None

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return not self.errors


def check(file: Path) -> Checked:
    """Check any FMU.

    Raises:
        InputError: the file is not there or is no FMU.
    """
    read_description(file)
    errors, results = list[str](), dict[str, str]()
    for name, checker in CHECKERS.items():
        outcome = checker(file)
        if isinstance(outcome, str):
            results[name] = outcome
            continue
        results[name] = "failed" if outcome else "ok"
        errors += [f"{name}: {problem}" for problem in outcome]
    try:
        worst = reference_error(file)
    except InputError as error:
        worst, results["references"] = None, "failed"
        errors.append(f"references: {error}")
    else:
        results["references"] = "none in the FMU" if worst is None else "ok"
    if worst is not None and not worst <= TOLERANCE:
        results["references"] = "failed"
        errors.append(f"references: expected deviations of at most {TOLERANCE:g}; got {worst:.3g}")
    return Checked(tuple(errors), results, worst)


def reference_error(file: Path) -> float | None:
    """Return the largest deviation from the FMU's own reference results (FMI-LS-REF); None without any.

    Inputs are set before each step and held, results are read at the end of steps.

    Raises:
        InputError: the references cannot be read, or the FMU does not run.
    """
    worst = None
    with zipfile.ZipFile(file) as archive:
        for stimuli, references, step in _experiments(archive, file):
            error = _deviation(file, stimuli, references, step)
            worst = error if worst is None else max(worst, error)
    return worst


def _experiments(archive: zipfile.ZipFile, file: Path) -> list[tuple[Table, Table, float]]:
    """Return inputs, results and step of the experiments that the manifest names."""
    manifest = f"{FOLDER}/fmi-ls-manifest.xml"
    if manifest not in archive.namelist():
        return []
    found = []
    try:
        for related in ET.fromstring(archive.read(manifest)).iter("Related"):
            if related.get("type") != EXPERIMENTS_TYPE:
                continue
            place = posixpath.normpath(f"{FOLDER}/{related.attrib['source']}")
            for experiment in ET.fromstring(archive.read(place)).iter("Experiment"):
                tables = [_table(archive, place, experiment.find(name)) for name in ("Stimuli", "References")]
                found.append((tables[0], tables[1], float(experiment.attrib["stepSize"])))
    except (KeyError, ValueError, ET.ParseError) as error:
        raise InputError(
            f"{file}: {manifest}: expected experiments with stimuli and references; got {error!r}."
        ) from error
    return found


def _table(archive: zipfile.ZipFile, place: str, element: ET.Element | None) -> Table:
    """Read a table; a cell holds the elements of an array, with spaces between them."""
    if element is None:
        return []
    path = posixpath.normpath(posixpath.join(posixpath.dirname(place), element.attrib["source"]))
    head, *rows = csv.reader(io.StringIO(archive.read(path).decode()))
    return [
        (
            float(row[0]),
            {
                name: np.array(cell.split(), dtype=np.float64)
                for name, cell in zip(head[1:], row[1:], strict=True)
            },
        )
        for row in rows
    ]


def _deviation(file: Path, stimuli: Table, references: Table, step: float) -> float:
    """Return the largest deviation, relative to each variable's largest value or 1."""
    inputs = {round(time / step): values for time, values in stimuli}
    expected = {round(time / step): values for time, values in references}
    names = list(references[0][1])
    size = {name: max(1.0, *(float(np.abs(row[name]).max()) for _, row in references)) for name in names}
    worst = 0.0
    with Slave(file) as slave:
        for k in range(max(expected) + 1):
            if k in expected:
                got = slave.get(names)
                errors = [float(np.abs(got[name] - expected[k][name]).max()) / size[name] for name in names]
                worst = max(worst, float(np.max(errors)))
            if k == max(expected):
                break
            if k in inputs:
                slave.set(inputs[k])
            slave.step(k, step)
    return worst
