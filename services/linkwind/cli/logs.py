"""``linkwind log …``: what is in a log, a clean file from a damaged one, tables for other tools, means."""

from __future__ import annotations

import json
import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import JsonOption, LogArgument

HELP = """Look into a log, recover or export it.

Example: linkwind log info runs/two_link-20260101-120000

Example: linkwind log export runs/two_link-20260101-120000 -o tables

Example: linkwind log means runs/two_link-20260101-120000 --from 0.5 --to 1
"""


class Format(StrEnum):
    """Kind of files to export."""

    CSV = "csv"
    PARQUET = "parquet"
    VTK = "vtk"


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(help=HELP, no_args_is_help=True)
    group.command()(info)
    group.command()(recover)
    group.command()(export)
    group.command()(means)
    app.add_typer(group, name="log")


def info(log: LogArgument, as_json: JsonOption = False) -> None:
    """Print what a log holds: topics, messages, steps, whether it is complete, versions.

    Example: linkwind log info runs/two_link-20260101-120000/log.mcap
    """
    from linkwind.log.origin import origin
    from linkwind.log.reader import open_log

    opened = open_log(log)
    about = opened.info._asdict()
    if as_json:
        typer.echo(json.dumps(about))
        return
    ending = "yes" if opened.complete else f"no: {opened.error or 'the run was cut off'}"
    if opened.damage is not None:
        ending += f" ({opened.damage.text})"
    head = {"run": opened.run, "scenario": about["scenario"], "steps": about["steps"], "complete": ending}
    rest = {
        "final state": opened.final_state_sha256 or "none",
        "messages": about["messages"],
        **{f"  {topic}": count for topic, count in about["topics"].items()},
        **about["versions"],
    }
    made = [("how", text) for text in origin(opened)]
    for name, value in [*head.items(), *made, *rest.items()]:
        typer.echo(f"{name:>20}  {value}")


def recover(
    log: LogArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="The clean file; it must not exist.")],
    as_json: JsonOption = False,
) -> None:
    """Write a clean log from one that was cut or damaged, with all that can be trusted.

    Example: linkwind log recover runs/two_link-20260101-120000/log.mcap -o recovered.mcap
    """
    from rich.console import Console

    from linkwind.log.recover import recover as recover_log

    if as_json:
        done = recover_log(log, out)
        summary = {"messages_recovered": done.messages, "bytes_lost": done.bytes_lost, "file": str(done.file)}
        typer.echo(json.dumps(summary))
        return
    with Console(stderr=True).status("recovering") as status:
        done = recover_log(log, out, lambda messages: status.update(f"recovering: {messages} messages"))
    typer.echo(f"wrote {done.file}: {done.messages} messages, {done.bytes_lost} bytes were lost")
    typer.echo(f"note: {done.damage}" if done.damage else "note: nothing was missing from the log")


def export(
    log: LogArgument,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder for the files.")],
    format_: Annotated[Format, typer.Option("--format", help="Kind of files.")] = Format.CSV,
) -> None:
    """Write trajectory, steps and wrenches of a log as tables; with vtk, flow, wakes and bodies for ParaView.

    Example: linkwind log export runs/two_link-20260101-120000/log.mcap -o tables --format csv
    """
    from linkwind.log.export import export_csv, export_parquet
    from linkwind.log.reader import open_log
    from linkwind.log.vtk import export_vtk
    from linkwind.runs.labels import labels_of

    opened = open_log(log)
    if not opened.complete:
        reason = opened.damage.text if opened.damage else opened.error
        typer.echo(f"note: the log is not complete: {reason or 'the run was cut off'}", err=True)
    if format_ == Format.VTK:
        paths = export_vtk(opened, out)
    else:
        paths = (export_csv if format_ == Format.CSV else export_parquet)(opened, out, labels_of(opened))
    for path in paths:
        typer.echo(f"wrote {path}")


def means(
    log: LogArgument,
    begin: Annotated[
        float | None, typer.Option("--from", help="Begin of the range of time [s]; default: of the log.")
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", help="End of the range of time [s]; default: of the log.")
    ] = None,
    name: Annotated[
        str, typer.Option("--table", help="trajectory, steps or wrench_PROVIDER.")
    ] = "trajectory",
    as_json: JsonOption = False,
) -> None:
    """Print the mean of each column of a table over a range of time, such as a beat; nan where a value is.

    Example: linkwind log means runs/two_link-20260101-120000 --from 0.5 --to 1
    """
    from linkwind import api

    found = api.means(log, begin, end, name)
    if as_json:
        typer.echo(
            json.dumps({title: mean if math.isfinite(mean) else None for title, mean in found.items()})
        )
        return
    for title, mean in found.items():
        typer.echo(f"{mean:>13.6g}  {title}")
