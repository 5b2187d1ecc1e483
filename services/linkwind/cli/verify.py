"""``linkwind verify`` and ``linkwind diff``: whether two runs are the same."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from linkwind.cli.options import DIFFERENT, JsonOption, LogArgument, log_in
from linkwind.cli.own import ForceFmuOption, ModelOption, by_provider

if TYPE_CHECKING:
    from linkwind.log.reader import Log
    from linkwind.runs.diff import Compared, Growth
    from linkwind.runs.verify import Verified


def register(app: typer.Typer) -> None:
    """Add the commands."""
    app.command()(verify)
    app.command()(diff)


def verify(
    log: LogArgument,
    from_recorded_wrenches: Annotated[
        bool,
        typer.Option(
            "--from-recorded-wrenches", help="Take the forces from the log: its provider is not at hand."
        ),
    ] = False,
    force_fmu: ForceFmuOption = None,
    model: ModelOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run a log again from what it contains and compare bit for bit; exit code 5 if a bit differs.

    Example: linkwind verify runs/two_link-20260101-120000/log.mcap
    """
    from linkwind.log.scenarios import last_recorded
    from linkwind.runs.verify import scenario_of
    from linkwind.runs.verify import verify as verify_log

    opened, scenario = scenario_of(log)
    steps = last_recorded(opened).steps
    own = by_provider(scenario, force_fmu, model)

    def job(progress: Callable[[int], None]) -> Verified:
        return verify_log(opened, scenario, progress, own, from_recorded_wrenches=from_recorded_wrenches)

    found = job(lambda step: None) if as_json else _behind_a_bar(scenario.name, steps, job)
    if as_json:
        first = found.difference.as_json() | {"changed": found.changed} if found.difference else None
        typer.echo(
            json.dumps({"identical": found.identical, "steps": found.steps, "first_difference": first})
        )
        if found.remark:
            typer.echo(f"note: {found.remark}", err=True)
    else:
        _show(opened, steps, found)
    if not found.identical:
        raise typer.Exit(DIFFERENT)


def _behind_a_bar(name: str, steps: int, job: Callable[[Callable[[int], None]], Verified]) -> Verified:
    from rich.console import Console
    from rich.progress import Progress

    with Progress(console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(f"{name} (steps)", total=steps)
        return job(lambda step: bar.update(task, completed=step))


def _show(log: Log, steps: int, found: Verified) -> None:
    from linkwind.log.contents import WRENCH

    if found.difference is not None:
        typer.echo("different: the first difference is")
        rows(found.difference.lines("recorded", "again"))
        if found.changed:
            typer.echo("not as it was when the log was made:")
            rows((name, f"{then} -> {now}") for name, (then, now) in found.changed.items())
        else:
            typer.echo("versions, processor and library are those that made the log")
        if found.difference.topic.startswith(WRENCH):
            typer.echo(
                "if that provider was one of yours, take its forces as recorded: --from-recorded-wrenches"
            )
    else:
        extent = f"{found.steps} of {steps} steps, {found.messages} messages"
        typer.echo(f"identical: {extent}, every bit of them")
        if found.changed:
            typer.echo(f"though made with another {', '.join(found.changed)}")
    if found.remark:
        typer.echo(f"note: {found.remark}")


def diff(
    one: Annotated[
        Path, typer.Argument(metavar="A", help="The MCAP log of a run, or the run's folder.", callback=log_in)
    ],
    other: Annotated[Path, typer.Argument(metavar="B", help="Those of another run.", callback=log_in)],
    rtol: Annotated[
        float, typer.Option(min=0.0, help="Ignore differences up to this part of a field's largest value.")
    ] = 0.0,
    plot: Annotated[Path | None, typer.Option(help="Draw how the difference grows, as an HTML page.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show what differs between two logs, where it starts and how it grows; exit code 5 if they differ.

    Example: linkwind diff runs/a runs/b --rtol 1e-9
    """
    from linkwind.runs.diff import diff as compare

    found = compare(one, other, rtol=rtol)
    if plot is not None and found.curves is not None:
        from linkwind.report.growth import write_growth

        write_growth(plot, f"{one} and {other}", found.curves.t, found.curves.distance)
    if as_json:
        typer.echo(json.dumps(found.as_json()))
    for remark in found.remarks:
        typer.echo(f"note: {remark}", err=as_json)
    if not as_json:
        show_diff(found, rtol)
    if not found.identical:
        raise typer.Exit(DIFFERENT)


def show_diff(found: Compared, rtol: float) -> None:
    """Print what differs between two logs."""
    within = f" within {rtol:g} of the largest values" if rtol else ""
    if found.first is None:
        typer.echo(f"identical{within}: {found.points} communication points")
        return
    typer.echo(f"different; {found.points} communication points in common. The first difference is")
    rows(found.first.lines("A", "B"))
    if found.fields:
        typer.echo(
            f"{'field':>36}  {'first t [s]':>11}  {'largest':>9}  {'relative':>9}  {'at t [s]':>9}  body"
        )
    for d in found.fields:
        start = f"{d.first.time_ns / 1e9:>11g}"
        largest = f"{d.absolute:>9.2e}  {d.relative:>9.2e}  {d.t:>9g}"
        typer.echo(f"{d.topic + ' ' + d.field:>36}  {start}  {largest}  {d.body or ''}")
    if found.growth is not None:
        _show_growth(found.growth)


def _show_growth(growth: Growth) -> None:
    typer.echo("largest difference of the accepted states up to each time, from the one before on:")
    names = [name.removeprefix("motion.") for name in growth.fields]
    typer.echo(f"{'t [s]':>11}" + "".join(f"  {name:>11}" for name in names))
    for t, values in growth.rows:
        typer.echo(f"{t:>11.6g}" + "".join(f"  {value:>11.2e}" for value in values))


def rows(lines: Iterable[tuple[str, str]]) -> None:
    """Print names and texts below each other."""
    for name, text in lines:
        typer.echo(f"{name:>20}  {text}")
