"""The command line. Commands import what they need when they run, so that ``--help`` answers at once."""

from __future__ import annotations

import atexit
import os
import sys
import traceback
from contextlib import suppress

import typer
from typer.models import CommandInfo, TyperInfo

from linkwind.cli import (
    certs,
    conformance,
    doctor,
    fmu,
    happen,
    logs,
    mechanism,
    record,
    replay,
    report,
    reproduce,
    resume,
    router,
    run,
    scenario,
    services,
    validate,
    verify,
    view,
)
from linkwind.errors import LinkwindError, StoppedError
from linkwind.interrupt import stops_as_interrupt

app = typer.Typer(
    name="linkwind",
    help="Co-simulation of mechanisms moving in a flow.\n\nStart with: linkwind run two_link",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
PANELS = {
    "Run": (run, services, resume, scenario),
    "Look at a run": (report, view, logs),
    "Check": (verify, validate, reproduce, conformance, doctor),
    "On the bus": (replay, record, happen, router, certs),
    "Other formats": (fmu, mechanism),
}
for panel, modules in PANELS.items():
    for module in modules:
        module.register(app)
    commands: list[CommandInfo | TyperInfo] = [*app.registered_commands, *app.registered_groups]
    for command in commands:
        if not isinstance(command.rich_help_panel, str):
            command.rich_help_panel = panel


@app.callback(invoke_without_command=True)
def version(
    show: bool = typer.Option(False, "--version", help="Print the version and exit.", is_eager=True),
) -> None:
    """Hold the options that come before a command."""
    if show:
        from linkwind import __version__

        typer.echo(__version__)
        raise typer.Exit


def main() -> None:
    """Run the command line; an error is one message and an exit code that tells its kind."""
    status = 0
    try:
        with stops_as_interrupt():
            app()
    except LinkwindError as error:
        print(f"error: {error}", file=sys.stderr)
        status = error.exit_code
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        status = StoppedError.exit_code
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
    except Exception:
        traceback.print_exc()
        status = 1
    _leave(status)


def _leave(status: int) -> None:
    """End the process now.

    Python would wait for zenoh's threads, and these for a session to be closed: one that was being opened, or
    closed, when the process was told to stop, or whose peers do not answer.
    """
    atexit._run_exitfuncs()  # children and temporary files
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError):  # nobody reads it any more
            stream.flush()
    os._exit(status)
