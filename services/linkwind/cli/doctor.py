"""``linkwind doctor``: whether this machine can do what linkwind needs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import ConnectOption, JsonOption, TlsOption

SICK = 1  # exit code
COLORS = {"ok": typer.colors.GREEN, "warn": typer.colors.YELLOW, "fail": typer.colors.RED}


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(doctor)


def doctor(
    out: Annotated[Path, typer.Option(help="Folder that results will go to.")] = Path("runs"),
    connect: ConnectOption = None,
    tls: TlsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Check this machine, do a short run, measure the round trip; say what to change.

    ``warn``: something will not work, or slowly. ``fail``: nothing will; the exit code is then 1.

    Example: linkwind doctor --out /data/runs

    Example: linkwind doctor --tls certs/aero --connect tls/10.0.0.2:7447
    """
    from linkwind.doctor import FAIL, examine

    rows = []
    for finding in examine(out, tuple(connect or ()), tls):
        rows.append(finding)
        if not as_json:
            status = typer.style(f"{finding.status:<5}", fg=COLORS[finding.status])
            typer.echo(f"{status} {finding.check:<15} {finding.found}")
            if finding.change:
                typer.echo(f"{'':<21} → {finding.change}")
    good = all(row.status != FAIL for row in rows)
    if as_json:
        typer.echo(json.dumps({"ok": good, "rows": [vars(row) for row in rows]}))
    if not good:
        raise typer.Exit(SICK)
