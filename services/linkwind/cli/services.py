"""``linkwind aero``: a force provider as a process of its own."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import Annotated

import typer

from linkwind.cli.options import ConnectOption, ListenOption


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(aero)


def aero(
    connect: ConnectOption = None,
    listen: ListenOption = None,
    name: Annotated[str, typer.Option(help="Of the provider, as in the scenario.")] = "aero",
    run: Annotated[str, typer.Option(help="Id of the run to take part in; * for the only one there.")] = "*",
    force_fmu: Annotated[
        Path | None, typer.Option(help="The FMU, for a provider whose model is fmu; its path stays here.")
    ] = None,
    start_timeout: Annotated[float, typer.Option(help="Wait this long for the dynamics [s].")] = 60.0,
) -> None:
    """Start one force provider; it takes the scenario from the dynamics.

    Example: linkwind aero --connect tcp/10.0.0.2:7447
    """
    from linkwind.aero.service import serve, session
    from linkwind.bus.zenoh import ZenohProviderLink
    from linkwind.cli.run import DEFAULT_ENDPOINT

    if not connect and not listen:
        connect = [DEFAULT_ENDPOINT]
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    link = ZenohProviderLink(connect or [], listen or [], run)
    try:
        serve(link, session(name, force_fmu), start_timeout)
    finally:
        link.close()
