"""``linkwind replay``: a log on the bus again."""

from __future__ import annotations

import json
from functools import partial
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.keys import keys
from linkwind.cli.options import (
    ConnectOption,
    JsonOption,
    ListenOption,
    LogArgument,
    OutOption,
    SetOption,
    TlsOption,
    default_endpoint,
)
from linkwind.cli.own import ForceFmuOption, ModelOption

if TYPE_CHECKING:
    from collections.abc import Callable

    from linkwind.log.reader import Log
    from linkwind.runs.playback import Steering
    from linkwind.runs.replay import Replayed


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command()(replay)


def replay(
    log: LogArgument,
    rate: Annotated[
        float, typer.Option(min=0.0, help="Times as fast as in reality; 0 for as fast as possible.")
    ] = 1.0,
    start: Annotated[float | None, typer.Option(help="Begin at this simulation time, in s.")] = None,
    end: Annotated[float | None, typer.Option(help="End at this simulation time, in s.")] = None,
    topics: Annotated[
        list[str] | None,
        typer.Option(metavar="TOPIC,…", help="Only these topics, such as /motion,/wrench/aero."),
    ] = None,
    loop: Annotated[bool, typer.Option("--loop", help="Begin again at the end, until Ctrl-C.")] = False,
    paused: Annotated[bool, typer.Option("--paused", help="Pause before the first point.")] = False,
    remap: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=NEW",
            help="Another key, for a topic (/motion=lab/motion) or for all that begin with it; repeatable.",
        ),
    ] = None,
    listen: ListenOption = None,
    connect: ConnectOption = None,
    substitute: Annotated[
        str | None,
        typer.Option(
            metavar="dynamics|PROVIDER",
            help="This side is live, under --set, the other one recorded; nothing is published.",
        ),
    ] = None,
    set_: SetOption = None,
    force_fmu: ForceFmuOption = None,
    model: ModelOption = None,
    out: OutOption = None,
    tls: TlsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Publish the messages of a log as the run did, once somebody subscribes.

    On a terminal, the space bar pauses and goes on, a dot lets one point pass, + and - change the rate, the
    arrow keys seek by 1 s, Page Up and Down by 10 s, Home goes to the beginning, Ctrl-C ends. The same can be
    asked for on the bus, under linkwind/v1/RUN/playback.

    With --substitute PROVIDER, that provider is asked again about the recorded motion; it is started here, or
    comes from elsewhere to --listen or --connect. With --substitute dynamics, new dynamics move under the
    recorded forces; with --connect, dynamics elsewhere do. --set, --force-fmu, --model and --out are for
    these alone.

    Example: linkwind replay runs/two_link-20260101-120000/log.mcap --rate 0.5 --listen tcp/0.0.0.0:7447

    Example: linkwind replay LOG --substitute aero --set aero.model=none

    Example: linkwind replay LOG --substitute dynamics --set bodies.link1.mass=2.5
    """
    if substitute is not None:
        from linkwind.cli.substitute import substitute as put_in_place

        at = (listen or [], connect or [], tls)
        put_in_place(log, substitute, set_ or [], (force_fmu, model), out, *at, as_json)
        return
    if set_ or force_fmu or model or out:
        raise typer.BadParameter("expected --substitute with --set, --force-fmu, --model and --out; got none")
    from linkwind.credentials import identity_in
    from linkwind.log.reader import open_log
    from linkwind.runs.playback import Steering
    from linkwind.runs.replay import Selection
    from linkwind.runs.replay import replay as replay_log

    source = open_log(log)
    chosen = tuple(topic for text in topics or () for topic in text.split(","))
    selection = Selection(start, end, chosen, [_pair(text) for text in remap or ()])
    steering = Steering(rate, loop=loop, paused=paused)
    ends = {"listen": listen or ([] if connect else [default_endpoint(tls)]), "connect": connect or []}
    shown = identity_in(tls, "dynamics")

    def tell() -> None:
        where = ", ".join([*ends["listen"], *ends["connect"]])
        typer.echo(f"waiting at {where} for a subscriber of linkwind/v1/{source.run}/**", err=True)

    def job(progress: Callable[[float], None]) -> Replayed:
        return replay_log(
            source, selection, **ends, identity=shown, progress=progress, steering=steering, opened=tell
        )

    if source.damage is not None:
        typer.echo(f"note: the log is not complete: {source.damage.text}", err=True)
    if as_json:
        done = job(lambda t: None)
    else:
        with keys(_actions(steering)):
            done = _behind_a_bar(source, selection.start or 0.0, end, job)
    if not done.heard:
        typer.echo("note: at the end nobody listened any more", err=True)
    if as_json:
        typer.echo(json.dumps(done.as_json()))
    else:
        late = (
            "" if done.late_ms is None else "; late by {:.2f} ms median, {:.2f} ms p99".format(*done.late_ms)
        )
        typer.echo(f"{done.messages} messages in {done.wall_s:.2f} s{late}")


def _pair(text: str) -> tuple[str, str]:
    """Return both keys of a --remap."""
    old, equals, new = text.partition("=")
    if not equals:
        raise typer.BadParameter(f"--remap: expected KEY=NEW; got {text}")
    return old, new


def _actions(steering: Steering) -> dict[str, Callable[[], None]]:
    """Return what the keys of a terminal do."""
    seek = {"\x1b[C": 1.0, "\x1b[D": -1.0, "\x1b[5~": 10.0, "\x1b[6~": -10.0}
    return {
        " ": steering.toggle,
        ".": steering.step,
        "+": lambda: steering.scale(2.0),
        "-": lambda: steering.scale(0.5),
        "\x1b[H": lambda: steering.seek(0),
        **{key: partial(steering.seek_by, seconds) for key, seconds in seek.items()},
    }


def _behind_a_bar(
    log: Log, start: float, end: float | None, job: Callable[[Callable[[float], None]], Replayed]
) -> Replayed:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    from linkwind.log.scenarios import recorded

    total = end if end is not None else recorded(log).time.end
    shown = TextColumn("{task.completed:.2f} of {task.total:.2f} s")
    columns = (TextColumn("{task.description}"), BarColumn(), shown, TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(log.run, total=total)
        bar.update(task, completed=start)
        return job(lambda t: bar.update(task, completed=t))
