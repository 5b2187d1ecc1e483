"""``linkwind router``: where participants meet that cannot reach each other."""

from __future__ import annotations

from typing import Annotated

import typer

from linkwind.cli.options import ConnectOption, ListenOption, TlsOption, default_endpoint


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(router)


def router(
    listen: ListenOption = None,
    connect: ConnectOption = None,
    name: Annotated[
        list[str] | None,
        typer.Option(help="Of a provider that a secure bus lets in; repeatable, aero if not given."),
    ] = None,
    tls: TlsOption = None,
) -> None:
    """Pass messages on between dynamics, providers and observers, until told to stop.

    All of them use --connect then, in any order.

    Example: linkwind router --listen tcp/0.0.0.0:7447

    Then: linkwind dynamics two_link --connect tcp/ROUTER:7447 and linkwind aero --connect tcp/ROUTER:7447
    """
    import signal
    from contextlib import closing

    from linkwind.bus.zenoh import ZenohRouter
    from linkwind.credentials import identity_in

    shown = identity_in(tls, "router")
    where = listen or ([] if connect else [default_endpoint(tls)])
    with closing(ZenohRouter(where, connect or [], name or ["aero"], shown)):
        typer.echo(f"passing messages on at {', '.join([*where, *(connect or [])])}")
        signal.pause()
