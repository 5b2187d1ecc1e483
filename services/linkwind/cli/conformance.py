"""``linkwind conformance``: a provider of somebody else against the protocol."""

from __future__ import annotations

import json
import logging
from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import JsonOption, ScenarioArgument, SetOption


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(conformance)


def conformance(
    scenario: ScenarioArgument,
    command: Annotated[
        list[str],
        typer.Argument(
            metavar="-- COMMAND…", help="Starts the provider; {endpoint} and {name} in it are replaced."
        ),
    ],
    name: Annotated[str, typer.Option(help="Of the provider, as in the scenario.")] = "aero",
    set_: SetOption = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            help="New file for what the provider prints; conformance.log, written anew, if not given.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Test whether a provider of yours keeps to the protocol; exit code 4 if it does not.

    The protocol is in schemas/README.md, and an example that uses nothing of linkwind beside it.

    Example: linkwind conformance two_link -- python my_provider.py {endpoint}

    Example: linkwind conformance two_link -- linkwind aero --connect {endpoint}
    """
    from rich.console import Console
    from rich.progress import Progress

    from linkwind.errors import InputError
    from linkwind.runs.conformance import CHECKS
    from linkwind.runs.conformance import conformance as test
    from linkwind.scenario import load

    if output is not None and output.exists():
        raise InputError(f"{output}: expected a new file; got one that exists. Name another with --output.")
    loaded = load(scenario, set_ or [])
    printed = output or Path("conformance.log")
    if output is None:
        printed.unlink(missing_ok=True)
    logging.getLogger("linkwind").setLevel(logging.ERROR)  # that it is killed, and comes back, is meant
    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=len(CHECKS))

        def progress(check: str) -> None:
            bar.update(task, completed=list(CHECKS).index(check), description=check)

        results = test(loaded, name, command, printed, progress)
    if as_json:
        typer.echo(json.dumps({"checks": [vars(result) for result in results]}))
    else:
        for result in results:
            word = {True: "ok", False: "WRONG", None: "-"}[result.ok]
            typer.echo(f"{word:>6}  {result.check}: {CHECKS[result.check]}")
            if result.saw:
                typer.echo(f"        {result.saw}")
    if any(result.ok is False for result in results):
        typer.echo(f"what it printed: {printed}", err=True)
        raise typer.Exit(4)
