"""``linkwind aero``: a force provider as a process of its own."""

from __future__ import annotations

import logging
import time
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import ConnectOption, ListenOption, TlsOption, default_endpoint
from linkwind.errors import LinkwindError

if TYPE_CHECKING:
    from linkwind.bus.zenoh import ZenohProviderLink
    from linkwind.protocol import ProviderSession

PAUSE = (
    1.0  # s between two runs of a provider that stays, in which the dynamics of the last one leaves the bus
)


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
    model: Annotated[
        str | None,
        typer.Option(
            metavar="FILE.py:NAME",
            help="The function or class, for a provider whose model is python; its path stays here.",
        ),
    ] = None,
    start_timeout: Annotated[
        float, typer.Option(min=0.0, help="Wait so many seconds for the dynamics.")
    ] = 60.0,
    tls: TlsOption = None,
    stay: Annotated[
        bool, typer.Option("--stay", help="Serve one run after the other, until told to stop.")
    ] = False,
) -> None:
    """Start one force provider; it takes the scenario from the dynamics.

    Example: linkwind aero --connect tcp/10.0.0.2:7447

    Example: linkwind aero --connect tcp/10.0.0.2:7447 --model kite.py:Kite
    """
    from linkwind.aero.service import session
    from linkwind.aero.source import python_source
    from linkwind.bus.zenoh import ZenohProviderLink
    from linkwind.credentials import identity_in

    if model and force_fmu:
        raise typer.BadParameter("expected --force-fmu or --model; got both")
    shown = identity_in(tls, name)
    if not connect and not listen:
        connect = [default_endpoint(tls)]
    logging.basicConfig(level=logging.INFO, format="%(message)s")
    link = partial(ZenohProviderLink, connect or [], listen or [], run, name=name, identity=shown)
    own = python_source(model) if model else force_fmu
    while True:
        try:
            _serve(link(), session(name, own), start_timeout)
        except LinkwindError as error:
            if not stay:
                raise
            logging.error("error: %s", error)
        if not stay:
            return
        time.sleep(PAUSE)


def _serve(link: ZenohProviderLink, provider: ProviderSession, start_timeout: float) -> None:
    """Take part in one run."""
    from linkwind.aero.service import serve

    with closing(link):
        serve(link, provider, start_timeout)
