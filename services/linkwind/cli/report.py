"""``linkwind report``: the page of a run, made again from its log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import LogArgument


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(report)


def report(
    log: LogArgument,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The page; report.html beside the log if not given.")
    ] = None,
) -> None:
    """Write the HTML report of a log.

    Example: linkwind report runs/two_link-20260101-120000/log.mcap
    """
    from linkwind.report import write_report

    target = out or log.with_name("report.html")
    write_report(log, target)
    typer.echo(str(target))
