"""``linkwind resume``: a run that was cut goes on to its end, or on another way."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.force_fmu import ForceFmuOption, files_by_provider, refuse_missing
from linkwind.cli.options import JsonOption, LogArgument, OutOption, SetOption, TlsOption
from linkwind.cli.run import behind_a_bar, print_summary
from linkwind.cli.view import LOCAL, HostOption, NoOpenOption, PortOption, ViewOption, watched

if TYPE_CHECKING:
    from linkwind.runs.resume import Plan


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(resume)


def resume(
    log: LogArgument,
    from_step: Annotated[
        int | None,
        typer.Option(
            "--from-step",
            min=0,
            help="Take the log up to this step; to its last whole exchange if not given.",
        ),
    ] = None,
    set_: SetOption = None,
    out: OutOption = None,
    force_fmu: ForceFmuOption = None,
    tls: TlsOption = None,
    view: ViewOption = False,
    host: HostOption = LOCAL,
    port: PortOption = 0,
    no_open: NoOpenOption = False,
    as_json: JsonOption = False,
) -> None:
    """Go on with a run that was cut, to the same end, bit for bit; or with other settings from a step on.

    Example: linkwind resume runs/two_link-20260101-120000/log.mcap

    Example: linkwind resume LOG --from-step 600 --set environment.gravity="[0, -1.62, 0]"
    """
    from linkwind.log.reader import open_log
    from linkwind.runs.resume import plan
    from linkwind.runs.resume import resume as resume_run

    found = plan(open_log(log), from_step, set_ or [])
    files = files_by_provider(found.scenario, force_fmu or [])
    refuse_missing(found.scenario, files)
    with watched(view, host, port, no_open) as watch:
        if as_json:
            typer.echo(json.dumps(resume_run(found, out, files=files, tls=tls, watch=watch).as_json()))
        else:
            _tell(found)
            print_summary(
                behind_a_bar(
                    found.scenario.name,
                    found.steps,
                    lambda progress: resume_run(found, out, progress, files, tls, watch).outcome,
                )
            )


def _tell(found: Plan) -> None:
    """Print where a run goes on."""
    damage = found.log.damage
    if damage is not None:
        typer.echo(f"note: the log is not complete: {damage.text}")
    begin = f"a checkpoint of step {found.start}" if found.start >= 0 else "the beginning"
    typer.echo(f"goes on after step {found.last} of {found.steps}; providers start from {begin}")
