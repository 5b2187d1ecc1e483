"""``linkwind validate``: the models against published and exact values."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import DIFFERENT, JsonOption
from linkwind.errors import InputError

if TYPE_CHECKING:
    from linkwind.runs.validate import Plot, Row


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(no_args_is_help=True, help="Compare a model with published and exact values.")
    group.command()(flow)
    group.callback()(_group)
    app.add_typer(group, name="validate")


def _group() -> None:
    """Keep the name of a single command."""


def flow(
    short: Annotated[bool, typer.Option("--short", help="A coarser form, below 3 minutes.")] = False,
    case: Annotated[
        list[str] | None, typer.Option("--case", metavar="NAME", help="Only this case; repeatable.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="Folder for flow.html: the table and plots.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the model flow with published and exact values; exit code 5 if one is off.

    All of it takes some 15 minutes on one core.

    Example: linkwind validate flow --short --out validation
    """
    from linkwind.runs import validate

    chosen = tuple(case or ())
    for name in chosen:
        if name not in validate.FLOW:
            raise InputError(
                f'--case: expected one of {", ".join(validate.FLOW)}; got "{name}". Use one of these names.'
            )
    rows, plots = _run(short, chosen)
    if out is not None:
        from linkwind.runs.validate import page

        page.write(out / "flow.html", f"linkwind validate flow{' --short' if short else ''}", rows, plots)
    if as_json:
        typer.echo(json.dumps({"rows": [row.as_json() for row in rows]}))
    else:
        _show(rows)
        if out is not None:
            typer.echo(str(out / "flow.html"))
    if any(row.ok is False for row in rows):
        raise typer.Exit(DIFFERENT)


def _run(short: bool, chosen: tuple[str, ...]) -> tuple[list[Row], list[Plot]]:
    """Run the cases behind a progress bar on stderr."""
    from rich.console import Console
    from rich.progress import Progress

    from linkwind.runs import validate

    names = [name for name in chosen or validate.FLOW if not (short and name in validate.LONG)]
    rows: list[Row] = []
    plots: list[Plot] = []
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(next(iter(names), ""), total=len(names))
        for done, (_, found) in enumerate(validate.flow(short, chosen), start=1):
            rows += found.rows
            plots += found.plots
            bar.update(task, completed=done, description=names[min(done, len(names) - 1)])
    return rows, plots


def _show(rows: list[Row]) -> None:
    from rich.console import Console
    from rich.table import Table

    from linkwind.runs.validate.page import expected, verdict

    table = Table(title="flow against published and exact values")
    for heading in ("case", "quantity", "value", "reference", "ratio", "", "source"):
        right = heading in ("value", "reference", "ratio")
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    for row in rows:
        ratio = "" if row.ratio is None or row.kind == "most" else f"{row.ratio:.3f}"
        colour = {True: "green", False: "bold red", None: "dim"}[row.ok]
        mark = f"[{colour}]{verdict(row)}[/]"
        table.add_row(row.case, row.quantity, f"{row.value:.4g}", expected(row), ratio, mark, row.source)
    Console().print(table)
