"""``linkwind reproduce``: the paper that linkwind starts from."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import JsonOption

if TYPE_CHECKING:
    from linkwind.runs.reproduce import Reproduced


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(reproduce)


def reproduce(
    out: Annotated[
        Path, typer.Option("--out", "-o", help="New folder for the page, logs and reports.")
    ] = Path("paper"),
    short: Annotated[bool, typer.Option("--short", help="A coarser flow: half the time.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Make the figures of Rahmati & Karimi 2021 again, and judge what the paper says.

    Example: linkwind reproduce --short --out paper
    """
    from rich.console import Console
    from rich.progress import Progress

    from linkwind.runs.reproduce import JOBS
    from linkwind.runs.reproduce import reproduce as reproduce_paper

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(JOBS[0], total=len(JOBS))

        def progress(job: str, done: float) -> None:
            bar.update(task, completed=JOBS.index(job) + done, description=job)

        found = reproduce_paper(out, progress, short=short)
    if as_json:
        typer.echo(json.dumps(found.as_json()))
    else:
        _show(found)


def _show(found: Reproduced) -> None:
    from rich.table import Table

    from linkwind.cli.tables import console

    table = Table(title="Rahmati & Karimi 2021", caption=f"{sum(c.holds for c in found.claims)} hold")
    for heading in ("The paper says", "Measured"):
        table.add_column(heading, overflow="fold")
    table.add_column("Value", justify="right")
    table.add_column("")
    for claim in found.claims:
        word = "[green]holds[/]" if claim.holds else "[bold red]does not[/]"
        table.add_row(claim.claim, claim.measure.replace("[", r"\["), f"{claim.value:.3g}", word)
    console().print(table)
    typer.echo(str(found.page))
