"""``linkwind resume``: a run that was cut goes on to its end, or on another way."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import (
    ConnectOption,
    JsonOption,
    ListenOption,
    LogArgument,
    OutOption,
    SetOption,
    TlsOption,
)
from linkwind.cli.own import ForceFmuOption, ModelOption, by_provider
from linkwind.cli.run import behind_a_bar, meeting, print_summary, tell_plan
from linkwind.cli.view import LOCAL, HostOption, NoOpenOption, PortOption, ViewOption, watched
from linkwind.errors import InputError

if TYPE_CHECKING:
    from linkwind.runs.resume import Resumed
    from linkwind.runs.run import Progress


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
    model: ModelOption = None,
    listen: ListenOption = None,
    connect: ConnectOption = None,
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

    Example: linkwind resume LOG --listen tcp/0.0.0.0:7447    # providers come from elsewhere
    """
    from linkwind.log.reader import open_log
    from linkwind.runs.resume import plan, resume_elsewhere
    from linkwind.runs.resume import resume as resume_run

    found = plan(open_log(log), from_step, set_ or [])
    own = by_provider(found.scenario, force_fmu, model)
    ends = None
    if listen or connect:
        _refuse(own)
        ends = meeting(found.scenario, listen, connect, tls, quiet=as_json)

    def job(progress: Progress) -> Resumed:
        if ends is not None:
            return resume_elsewhere(found, out, progress, ends, watch)
        return resume_run(found, out, progress, own, tls, watch)

    with watched(view, host, port, no_open) as watch:
        if as_json:
            typer.echo(json.dumps(job(lambda step: None).as_json()))
        else:
            tell_plan(found)
            print_summary(behind_a_bar(found.scenario.name, found.steps, job))


def _refuse(own: Mapping[str, object]) -> None:
    if own:
        raise InputError(
            "--force-fmu, --model: expected the model where the provider runs, which is elsewhere with "
            "--listen or --connect; got it here. Give it to linkwind aero there."
        )
