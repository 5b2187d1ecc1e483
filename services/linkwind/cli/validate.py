"""``linkwind validate``: the models against published and exact values."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import DIFFERENT, JsonOption
from linkwind.errors import InputError

if TYPE_CHECKING:
    from linkwind.runs.validate import Plot, Row, Suite

HELP = """Compare a model with published and exact values.

Example: linkwind validate multibody --short --out validation
"""

CaseOption = Annotated[
    list[str] | None, typer.Option("--case", metavar="NAME", help="Only this case; repeatable.")
]


def register(app: typer.Typer) -> None:
    """Add the commands."""
    group = typer.Typer(no_args_is_help=True, help=HELP)
    group.command()(flow)
    group.command()(vortex)
    group.command()(multibody)
    group.command()(coupling)
    app.add_typer(group, name="validate")


def flow(
    short: Annotated[bool, typer.Option("--short", help="A coarser form, some 90 seconds.")] = False,
    case: CaseOption = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for flow.html: the table and plots.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the model flow with published and exact values; exit code 5 if one is off.

    All of it takes some 12 minutes on two cores, half of it the flow in three dimensions.

    Example: linkwind validate flow --short --out validation
    """
    from linkwind.runs.validate import FLOW

    _validate("flow", FLOW, short, tuple(case or ()), out, as_json)


def vortex(
    short: Annotated[bool, typer.Option("--short", help="Coarser and fewer, some 10 s.")] = False,
    case: CaseOption = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for vortex.html: the table and plots.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the model vortex with published and exact values; exit code 5 if one is off.

    All of it takes half a minute on one core.

    Example: linkwind validate vortex --case flutter --out validation
    """
    from linkwind.runs.validate import VORTEX

    _validate("vortex", VORTEX, short, tuple(case or ()), out, as_json)


def multibody(
    short: Annotated[bool, typer.Option("--short", help="Shorter and fewer, some 10 s.")] = False,
    case: CaseOption = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for multibody.html: the table and plots.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the multibody dynamics with published and exact values; exit code 5 if one is off.

    All of it takes a minute on one core.

    Example: linkwind validate multibody --out validation
    """
    from linkwind.runs.validate import MULTIBODY

    _validate("multibody", MULTIBODY, short, tuple(case or ()), out, as_json)


def coupling(
    short: Annotated[bool, typer.Option("--short", help="Fewer and coarser, a second.")] = False,
    case: CaseOption = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for coupling.html: the table and plots.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Compare the coupling schemes with closed forms; exit code 5 if one is off.

    Example: linkwind validate coupling --out validation
    """
    from linkwind.runs.validate import COUPLING

    _validate("coupling", COUPLING, short, tuple(case or ()), out, as_json)


def _validate(
    name: str, suite: Suite, short: bool, chosen: tuple[str, ...], out: Path | None, as_json: bool
) -> None:
    for case in chosen:
        if case not in suite.cases:
            raise InputError(
                f'--case: expected one of {", ".join(suite.cases)}; got "{case}". Use one of these names.'
            )
    if out is not None:
        _make(out)  # rather than fail after minutes
    rows, plots = _run(suite, short, chosen)
    if out is not None:
        from linkwind.runs.validate import page

        title = f"linkwind validate {name}{' --short' if short else ''}"
        page.write(out / f"{name}.html", title, rows, plots, suite.remark)
    if as_json:
        typer.echo(json.dumps({"rows": [row.as_json() for row in rows]}))
    else:
        _show(suite.title, rows)
        if out is not None:
            typer.echo(str(out / f"{name}.html"))
    if any(row.ok is False for row in rows):
        raise typer.Exit(DIFFERENT)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be a folder: {error.strerror}. Choose another --out.") from None


def _run(suite: Suite, short: bool, chosen: tuple[str, ...]) -> tuple[list[Row], list[Plot]]:
    """Run the cases behind a progress bar on stderr."""
    from rich.console import Console
    from rich.progress import Progress

    names = suite.names(short, chosen)
    rows: list[Row] = []
    plots: list[Plot] = []
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(next(iter(names), ""), total=len(names))
        for done, found in enumerate(suite.run(short, chosen), start=1):
            rows += found.rows
            plots += found.plots
            bar.update(task, completed=done, description=names[min(done, len(names) - 1)])
    return rows, plots


def _show(title: str, rows: list[Row]) -> None:
    from rich.table import Table

    from linkwind.cli.tables import console
    from linkwind.runs.validate.page import HEADINGS, NUMBERS, cells, summary

    table = Table(title=title, caption=summary(rows))
    for heading in HEADINGS:
        right = heading in NUMBERS
        table.add_column(heading, justify="right" if right else "left", overflow="fold")
    for row in rows:
        colour = {True: "green", False: "bold red", None: "dim"}[row.ok]
        texts = zip(HEADINGS, cells(row), strict=True)
        table.add_row(*(text if heading else f"[{colour}]{text}[/]" for heading, text in texts))
    console().print(table)
