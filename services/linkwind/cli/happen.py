"""``linkwind happen``: a command to a run."""

from __future__ import annotations

from typing import Annotated

import typer

from linkwind.cli.options import ConnectOption, TlsOption, default_endpoint


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(happen)


def happen(
    event: Annotated[str, typer.Argument(help="An event of its scenario without a time or condition.")],
    connect: ConnectOption = None,
    run: Annotated[str, typer.Option(help="Id of the run; * for the only one there.")] = "*",
    tls: TlsOption = None,
) -> None:
    """Let an event of a run that waits for a command happen, at the start of the next step.

    The log knows when: verify and resume let it happen again at the same step.

    On a secure bus, the certificate is an operator's: linkwind certs DIR --role operator.

    Example: linkwind happen separation --connect tcp/10.0.0.2:7447
    """
    from linkwind.bus.zenoh import order
    from linkwind.credentials import OPERATOR, identity_in

    name = order(event, connect or [default_endpoint(tls)], run, identity=identity_in(tls, OPERATOR))
    typer.echo(f"run {name}: {event} happens with the next step")
