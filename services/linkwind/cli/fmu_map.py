"""``linkwind fmu map``: what the variables of an FMU would be in a scenario."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import ScenarioArgument, SetOption


def fmu_map(
    file: Annotated[Path, typer.Argument(help="The FMU.")],
    scenario: ScenarioArgument = "two_link",
    provider: Annotated[str, typer.Option(help="Of the scenario.")] = "aero",
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write the table to start from here, as TOML.")
    ] = None,
    set_: SetOption = None,
) -> None:
    """Print what the variables of a force FMU are taken for in a scenario; nothing of it is run.

    Example: linkwind fmu map their.fmu two_link -o their.toml
    """
    from linkwind.aero.fmu import survey
    from linkwind.errors import InputError
    from linkwind.fmi.host.mapping import refusal
    from linkwind.scenario import load

    loaded = load(scenario, set_ or [])
    chosen = next((p for p in loaded.providers if p.name == provider), None)
    if chosen is None:
        names = ", ".join(p.name for p in loaded.providers)
        raise InputError(f"--provider: expected one of {names}; got {provider}. Change it.")
    table, toml, problems = survey(file, loaded, chosen)
    typer.echo(table)
    if out is not None:
        try:
            out.write_text(toml, encoding="utf-8")
        except OSError as error:
            raise InputError(f"{out}: cannot be written: {error.strerror}. Choose another place.") from None
        print(f"wrote {out}: the table to start from, for the scenario", file=sys.stderr)
    if problems:
        raise refusal(problems, file)
