"""``linkwind view``: a log, or a run that writes one, in the browser."""

from __future__ import annotations

import json
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from linkwind.view.recording import Recording

HostOption = Annotated[
    str, typer.Option("--host", help="Address to serve on; others than this machine's own see it.")
]
PortOption = Annotated[
    int, typer.Option("--port", min=0, max=65535, help="Port of the page; any free one if not given.")
]
NoOpenOption = Annotated[bool, typer.Option("--no-open", help="Only print the address of the page.")]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(view)


def view(
    log: Annotated[
        Path, typer.Argument(help="The MCAP log of a run, also one that is going on, or its folder.")
    ],
    host: HostOption = "127.0.0.1",
    port: PortOption = 0,
    no_open: NoOpenOption = False,
    foxglove_layout: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Write a layout for Foxglove or Lichtblick instead, and end."),
    ] = None,
    steered: Annotated[bool, typer.Option("--steered", hidden=True)] = False,
) -> None:
    """Show a log in the browser: mechanism, flow, forces and plots over time. Ctrl-C ends.

    Example: linkwind view runs/two_link-20260101-120000
    """
    from linkwind.view.console import Console, tell_parent
    from linkwind.view.recording import open_recording
    from linkwind.view.server import LOOPBACK, listen, server

    recording = open_recording(log)
    if foxglove_layout is not None:
        _write_layout(recording, foxglove_layout)
        return
    place = listen(host, port)
    url = f"http://{host}:{place.getsockname()[1]}/"
    console = Console(tell_parent) if steered else None
    if steered:
        tell_parent({"url": url})
    else:
        typer.echo(f"{url}  (Ctrl-C ends)")
    if not no_open:
        webbrowser.open(url)
    server(recording, console, LOOPBACK if host in LOOPBACK else ["*"]).run(sockets=[place])


def _write_layout(recording: Recording, file: Path) -> None:
    from linkwind.errors import InputError
    from linkwind.view.foxglove import layout

    try:
        file.write_text(json.dumps(layout(recording), indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(
            f"{file}: cannot write the layout: {error.strerror}. Choose another place"
        ) from error
    typer.echo(str(file))
