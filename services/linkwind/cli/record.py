"""``linkwind record``: a log of a run that was started elsewhere."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import (
    ConnectOption,
    JsonOption,
    ListenOption,
    OutOption,
    TlsOption,
    default_endpoint,
)

if TYPE_CHECKING:
    from linkwind.runs.listen import Recording
    from linkwind.scenario import Scenario


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(record)


def record(
    connect: ConnectOption = None,
    listen: ListenOption = None,
    run: Annotated[str, typer.Option(help="Id of the run; * for the only one there.")] = "*",
    out: OutOption = None,
    tls: TlsOption = None,
    start_timeout: Annotated[float, typer.Option(min=0.0, help="Wait so many seconds for the run.")] = 60.0,
    as_json: JsonOption = False,
) -> None:
    """Record a run that was started elsewhere, without disturbing it; exit code 4 if messages were missed.

    Example: linkwind record --connect tcp/10.0.0.2:7447
    """
    from linkwind.credentials import OBSERVER, identity_in
    from linkwind.errors import MissedError
    from linkwind.runs.listen import listen_to

    if not connect and not listen:
        connect = [default_endpoint(tls)]

    def opened() -> None:
        where = ", ".join([*(listen or []), *(connect or [])])
        typer.echo(f"waiting for a run at {where}, at most {start_timeout:g} s", err=as_json)

    def found(name: str, scenario: Scenario) -> None:
        if not as_json:
            typer.echo(f"listening to run {name} of {scenario.name}")

    done = listen_to(
        listen=listen or [],
        connect=connect or [],
        run=run,
        out=out,
        timeout=start_timeout,
        identity=identity_in(tls, OBSERVER),
        opened=opened,
        found=found,
    )
    report = _report(done)
    if as_json:
        summary = {"scenario": done.scenario, "messages": done.messages, "missed": done.missed or None}
        typer.echo(
            json.dumps(summary | {"error": done.error or None, "log": str(done.log), "report": report})
        )
    else:
        typer.echo(f"{done.messages} messages; log: {done.log}")
        if done.error:
            typer.echo(f"note: the run ended early: {done.error}")
    if done.missed:
        raise MissedError(f"{done.log}: {done.missed}")


def _report(done: Recording) -> str | None:
    """Write the report beside the log; return its path."""
    from linkwind.errors import LinkwindError
    from linkwind.report import write_report

    page = done.log.with_name("report.html")
    try:
        write_report(done.log, page)
    except LinkwindError:
        return None
    return str(page)
