"""``linkwind certs``: an authority and a certificate for each role of a secure bus."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(certs)


def certs(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the certificates.")],
    role: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME[=HOST,…]",
            help="dynamics, observer, operator, router, or a provider's name; with the names and addresses "
            "that others reach it at, if they connect to it. Repeatable; dynamics=localhost,127.0.0.1,::1, "
            "aero, observer and operator if not given.",
        ),
    ] = None,
    days: Annotated[int, typer.Option(min=1, max=3650, help="That the roles' certificates are valid.")] = 397,
) -> None:
    """Make certificates for a secure bus: one authority, one folder for each role.

    Each machine gets the folder of its role and no other; the authority's, ca, stays where it was made. With
    the same DIR again, the authority issues for more roles. Nothing is ever written over.

    Example: linkwind certs certs --role dynamics=10.0.0.2,sim.example --role aero --role observer

    Then: linkwind dynamics two_link --tls certs/dynamics --listen tls/0.0.0.0:7447
    and, there: linkwind aero --tls certs/aero --connect tls/10.0.0.2:7447
    """
    from linkwind.credentials.authority import DEFAULT_ROLES, issue
    from linkwind.credentials.authority import role as parse

    for made in issue(folder, [parse(text) for text in role] if role else DEFAULT_ROLES, days):
        typer.echo(f"{made}: the role's own; --tls {made}")
    typer.echo(f"{folder / 'ca'}: makes new ones; keep it to yourself")
