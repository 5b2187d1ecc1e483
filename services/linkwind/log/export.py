"""A log as tables for tools that read no MCAP: CSV, the shortest text that gives the bits; Parquet."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from linkwind.errors import InputError, LogError
from linkwind.log import contents, tables
from linkwind.log.difference import WIDTHS
from linkwind.log.reader import Log
from linkwind.spatial import Array

Names = Mapping[str, Sequence[str]]
"""What the numbers of a field are called, by field, where they belong to no body."""

BLOCK = 4096  # messages in memory at a time

XYZ = ("x", "y", "z")
SIX = ("x", "y", "z", "rx", "ry", "rz")  # linear part, angular part
COMPONENTS = {
    "position": XYZ, "orientation": ("w", "x", "y", "z"), "linear": XYZ, "angular": XYZ, "acceleration": SIX,
    "reaction": SIX, "closure_reaction": SIX, "wrench": SIX, "force": XYZ, "torque": XYZ,
    "added_inertia": tuple(f"{row}{column}" for row in range(6) for column in range(6)),
}  # fmt: skip
UNITS: dict[str, Sequence[str]] = {
    "position": ["m"] * 3, "linear": ["m/s"] * 3, "angular": ["rad/s"] * 3, "force": ["N"] * 3,
    "torque": ["N m"] * 3, "acceleration": ["m/s^2"] * 3 + ["rad/s^2"] * 3,
    "reaction": ["N"] * 3 + ["N m"] * 3, "closure_reaction": ["N"] * 3 + ["N m"] * 3,
    "wrench": ["N"] * 3 + ["N m"] * 3,
    "kinetic_energy": ["J"], "potential_energy": ["J"], "external_work": ["J"], "dissipated_work": ["J"],
    "joint_gap": ["m"], "residual": ["J^0.5"], "interface_energy": ["J"],
}  # fmt: skip


class Block(NamedTuple):
    """Messages of a topic that follow each other: titles of columns, and the columns, shape (messages,)."""

    head: list[str]
    columns: list[NDArray[Any]]


class Reported(NamedTuple):
    """A provider's own numbers.

    Attributes:
        head: titles of their columns.
        step: of each answer, ascending, shape (answers,).
        values: shape (answers, numbers).
    """

    head: list[str]
    step: NDArray[np.uint64]
    values: Array

    def at(self, step: NDArray[np.uint64]) -> list[Array]:
        """Return the numbers of the last answer at each of some steps as columns; NaN where there is none."""
        place = np.searchsorted(self.step, step, side="right") - 1  # -1 before the first: another step's
        there = self.step[place] == step
        return list(np.where(there[:, None], self.values[place], np.nan).T)


def export_csv(log: Log, folder: Path, names: Names | None = None) -> list[Path]:
    """Write ``trajectory.csv``, ``steps.csv`` and ``wrench_PROVIDER.csv``; see :func:`_export`."""

    def write(path: Path, blocks: Iterator[Block]) -> None:
        with path.open("x", newline="", encoding="utf-8") as file:
            writer = csv.writer(file)
            for number, (head, columns) in enumerate(blocks):
                if not number:
                    writer.writerow(head)
                writer.writerows(zip(*(column.tolist() for column in columns), strict=True))

    return _export(log, folder, names or {}, "csv", write)


def export_parquet(log: Log, folder: Path, names: Names | None = None) -> list[Path]:
    """Write ``trajectory.parquet``, ``steps.parquet`` and ``wrench_PROVIDER.parquet``; see :func:`_export`.

    Raises:
        InputError: pyarrow is not there.
    """
    try:
        import pyarrow as pa
        from pyarrow.parquet import ParquetWriter
    except ImportError as error:
        raise InputError(
            "--format parquet: expected the package pyarrow; got none. Install it with: "
            "pip install 'linkwind[parquet]'"
        ) from error

    def write(path: Path, blocks: Iterator[Block]) -> None:
        tables_ = (pa.table(dict(zip(*block, strict=True))) for block in blocks)
        first = next(tables_)
        with path.open("xb") as file, ParquetWriter(file, first.schema) as writer:
            for table in (first, *tables_):
                writer.write_table(table)

    return _export(log, folder, names or {}, "parquet", write)


def _export(
    log: Log, folder: Path, names: Names, suffix: str, write: Callable[[Path, Iterator[Block]], None]
) -> list[Path]:
    """Write trajectory, steps and wrenches of what can be read.

    Args:
        log: to read.
        folder: for the files; is made if it is not there.
        names: of numbers of the trajectory; those without are numbered.
        suffix: of the files.
        write: writes one of them.

    Returns:
        the files, one for each topic that has a message.

    Raises:
        LogError: a file exists or cannot be written, or the log has no messages.
    """
    written = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for name, topic in _topics(log).items():
            if log.topics.get(topic):
                path = folder / f"{name}.{suffix}"
                write(path, _blocks(log, topic, names))
                written.append(path)
    except OSError as error:
        raise LogError(
            f"{error.filename}: expected to make a new file; got {error.strerror}. Choose another -o."
        ) from error
    if not written:
        raise LogError(f"{log.path}: expected messages to export; got none. The run ended before its first.")
    return written


def table(log: Log, name: str, names: Names | None = None) -> dict[str, NDArray[Any]]:
    """Return one of the tables as columns by title, each of shape (messages,).

    Args:
        log: to read.
        name: ``trajectory``, ``steps`` or ``wrench_PROVIDER``.
        names: of numbers of the trajectory; those without are numbered.

    Raises:
        LogError: there is no such table, or it has no row.
    """
    topics = _topics(log)
    if name not in topics or not log.topics.get(topics[name]):
        raise LogError(
            f"{log.path}: expected one of its tables, {', '.join(topics)}; got {name}, or no row of it."
        )
    heads, columns = zip(*_blocks(log, topics[name], names or {}), strict=True)
    return dict(zip(heads[0], map(np.concatenate, zip(*columns, strict=True)), strict=True))


def _topics(log: Log) -> dict[str, str]:
    """Return the topics of the tables, by name."""
    wrenches = {f"wrench_{name}": f"{contents.WRENCH}{name}" for name in log.provider_bodies}
    return {"trajectory": contents.STATE, "steps": contents.STEP} | wrenches


def _blocks(log: Log, topic: str, names: Names) -> Iterator[Block]:
    """Yield the messages of a topic, so many at a time; states with what the providers reported there."""
    reported = list(_reported(log)) if topic == contents.STATE else []
    for step, (head, columns) in _messages(log, topic, names):
        for each in reported:
            head += each.head
            columns += each.at(step)
        yield Block(head, columns)


def _messages(log: Log, topic: str, names: Names) -> Iterator[tuple[NDArray[np.uint64], Block]]:
    """Yield the messages of a topic, so many at a time, and their steps, shape (messages,)."""
    name = str(contents.message_name(topic))
    provider = topic.removeprefix(contents.WRENCH)
    bodies, numbers = log.provider_bodies.get(provider, log.bodies), log.diagnostics.get(provider, ())
    payloads = (message.payload for message in log.raw(topic))
    while block := list(islice(payloads, BLOCK)):
        columns = tables.columns(block, name, f"{log.path}: {topic}")
        t = tables.seconds(columns.pop("time_ns"))
        if "response" in columns:  # many columns, which few look for: behind the others
            columns["response"] = columns.pop("response")
        known = dict(names) | {"diagnostics": numbers}
        labels = (_labels(field, values, bodies, known) for field, values in columns.items())
        head = [label for field in labels for label in field]
        step, *others = columns.values()
        values = [column for field in (step, t, *others) for column in field.T]
        yield step[:, 0], Block([head[0], "t [s]", *head[1:]], values)


def _reported(log: Log) -> Iterator[Reported]:
    """Yield the numbers of each provider that reported any."""
    for provider, names in log.diagnostics.items():
        topic = contents.WRENCH + provider
        payloads = (message.payload for message in log.raw(topic))
        steps, values = [], []
        while block := list(islice(payloads, BLOCK)):
            columns = tables.columns(block, "WrenchStep", f"{log.path}: {topic}")
            steps.append(columns["step"][:, 0])
            values.append(columns["diagnostics"])
        if steps and values[0].shape[1] == len(names):
            head = [f"{provider}.{name}" for name in names]
            yield Reported(head, np.concatenate(steps), np.concatenate(values))


def _labels(field: str, values: NDArray[Any], bodies: Sequence[str], names: Names) -> Iterator[str]:
    """Yield the title of each column of a field: body, quantity, component, unit.

    Args:
        field: of the message, dotted.
        values: its columns.
        bodies: of the message.
        names: of numbers, by field.
    """
    leaf, width = field.rsplit(".", 1)[-1], values.shape[1]
    if len(names.get(leaf, ())) == width > 0:
        yield from names[leaf]
        return
    per_body = leaf in WIDTHS and width == WIDTHS[leaf] * len(bodies)
    for place in range(width):
        if per_body:
            body, component = divmod(place, WIDTHS[leaf])
            title = f"{bodies[body]}.{leaf}.{COMPONENTS[leaf][component]}"
        else:
            component = 0
            title = leaf if width == 1 else f"{leaf}.{place}"
        units = UNITS.get(leaf)
        yield f"{title} [{units[component]}]" if units else title
