"""``linkwind view``: a log, or a run that writes one, in the browser; ``--view`` of the commands that run."""

from __future__ import annotations

import json
import os
import sys
import threading
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from linkwind.runs.watch import Watch
    from linkwind.view.recording import Recording

LOCAL = "127.0.0.1"

ViewOption = Annotated[
    bool, typer.Option("--view", help="Show the run in the browser while it goes on; hold it from there.")
]
HostOption = Annotated[
    str,
    typer.Option(
        "--host",
        help="Address to serve the page on; with 0.0.0.0 other machines see it and may hold the run.",
    ),
]
PortOption = Annotated[
    int, typer.Option("--port", min=0, max=65535, help="Port of the page; any that is free if not given.")
]
NoOpenOption = Annotated[bool, typer.Option("--no-open", help="Only print the address of the page.")]


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(view)


def view(
    log: Annotated[
        Path,
        typer.Argument(help="The MCAP log of a run, also of one that goes on; its folder; or one of runs."),
    ],
    host: HostOption = LOCAL,
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
    serving = server(
        recording, Console(tell_parent) if steered else None, LOOPBACK if host in LOOPBACK else ["*"]
    )
    if steered:
        threading.Thread(target=_end_with_parent, args=(serving,), daemon=True).start()
        tell_parent({"url": url})
    else:
        typer.echo(f"{url}  (Ctrl-C ends)")
        _open(url, wanted=not no_open)
    serving.run(sockets=[place])


def _end_with_parent(serving: Any) -> None:
    """End the server as soon as the run that started this process has closed the pipe, or is gone."""
    sys.stdin.read()
    serving.should_exit = True


def _open(url: str, *, wanted: bool) -> None:
    if wanted and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        webbrowser.open(url)  # without a screen it would be one for the terminal


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


@contextmanager
def watched(wanted: bool, host: str, port: int, no_open: bool) -> Iterator[Watch | None]:
    """Provide what shows the run in the block, and keep the page until Ctrl-C when the run is over.

    Raises:
        typer.Exit: the run failed, which has been printed.
    """
    from linkwind.errors import LinkwindError, StoppedError
    from linkwind.runs.watch import Watch

    if not wanted:
        yield None
        return

    def announce(url: str) -> None:
        typer.echo(f"{url}  (stays after the run, until Ctrl-C)", err=True)
        _open(url, wanted=not no_open)

    watch = Watch(host, port, announce)
    try:
        yield watch
        watch.stay()
    except StoppedError:
        raise
    except LinkwindError as error:
        print(f"error: {error}", file=sys.stderr)
        watch.stay()
        raise typer.Exit(error.exit_code) from error
    finally:
        watch.end()
